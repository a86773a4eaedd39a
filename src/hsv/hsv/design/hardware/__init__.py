"""Certification of a design with additional models of hardware and air: ``hsv certify``."""
