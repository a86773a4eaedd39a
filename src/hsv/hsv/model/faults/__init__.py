"""Faults: their types and parameters, the schedule of a flight, and the fault injector."""
