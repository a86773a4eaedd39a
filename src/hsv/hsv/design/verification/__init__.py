"""Verification of a design by recomputing it from its parameter file and certificate; no hash is relied on."""
