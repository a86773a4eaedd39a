"""Nodes of the simulated vehicle (plant) and of the fault injector."""
