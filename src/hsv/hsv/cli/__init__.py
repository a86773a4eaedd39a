"""The hsv command."""
