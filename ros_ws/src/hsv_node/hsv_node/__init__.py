"""Shared code of all nodes of the bench: lockstep links, parameters, message conversion, start and stop."""
