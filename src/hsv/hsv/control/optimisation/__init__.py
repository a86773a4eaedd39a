"""Linear matrix inequalities: centring, solver, scaling and rounding."""
