"""Nodes of the notch filter, the nominal trajectory and the controllers, such as Tube-MPC."""
