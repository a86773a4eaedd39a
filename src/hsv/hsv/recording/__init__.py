"""MCAP bags: writing, reading, recovering."""
