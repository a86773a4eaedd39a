"""Certification of a design with further hardware and air: ``hsv certify``."""
