"""The vehicle plant and the fault injector."""
