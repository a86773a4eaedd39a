"""The fault vocabulary as pure functions of command and time."""
