"""Repeating a recorded run: process by process, or the whole loop, and comparing with what was recorded."""
