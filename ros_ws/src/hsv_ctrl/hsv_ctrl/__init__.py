"""Notch filter, nominal trajectory and Tube-MPC controller."""
