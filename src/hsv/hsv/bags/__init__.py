"""The graph's topics and messages; and functions that write, read, repair, compare and replay bags in one process."""
