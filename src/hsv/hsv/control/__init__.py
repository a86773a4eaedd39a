"""Designs, notch filter, reference and nominal trajectory, the laws that fly, and the interface of a controller."""
