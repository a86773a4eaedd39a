"""What each controller survives: faults of rising severity, at two times, on the nominal vehicle and at corners."""
