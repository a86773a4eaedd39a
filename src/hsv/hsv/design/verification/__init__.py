"""Recomputing a design from its parameter file and certificate, claim by claim; no hash is relied on."""
