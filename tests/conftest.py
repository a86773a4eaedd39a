"""For all tests."""

import signal

# Started in the background, a shell's child ignores SIGINT, and so would every process that a test interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)
