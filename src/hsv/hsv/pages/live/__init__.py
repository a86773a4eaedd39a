"""Watching a flight while it is flown: the page, the Foxglove server, and what both show and may ask for."""
