"""The topics and messages of the graph; bags: writing, reading, repair, comparison, and replay in one process."""
