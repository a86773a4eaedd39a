"""Certification of a design with hardware and air beside the disturbances of its certificate: ``hsv certify``."""
