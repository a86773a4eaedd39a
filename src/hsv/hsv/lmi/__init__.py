"""Linear matrix inequalities: the semidefinite solver, and the problem of the nominal gains K (eq. 31 to 35)."""
