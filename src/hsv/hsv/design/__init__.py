"""Offline design: feedback and nominal gains by linear matrix inequalities, design files, certificates."""
