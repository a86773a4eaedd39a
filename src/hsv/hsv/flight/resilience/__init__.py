"""Resilience of controllers: flights with faults of increasing severity, at two times, on several vehicles."""
