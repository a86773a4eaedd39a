"""Equations of motion, trim and linearisation of the vehicle."""
