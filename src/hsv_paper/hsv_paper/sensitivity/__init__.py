"""Sensitivity of the results: sweeps over what the paper leaves open, until each controller is lost."""
