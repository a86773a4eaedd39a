"""Designs and their verification, notch filter, nominal trajectory, control laws, and custom controllers."""
