"""Notch filter, nominal trajectory and tube law; what the nodes step in flight."""
