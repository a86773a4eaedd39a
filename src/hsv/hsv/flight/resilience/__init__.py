"""Resilience of controllers: flights with faults of increasing severity, at two times, on one or several vehicles."""
