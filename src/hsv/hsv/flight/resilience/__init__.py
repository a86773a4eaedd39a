"""Resilience of controllers: faults of increasing severity, at two times, on the nominal vehicle and at corners."""
