"""Topics, and bags: writing, reading, repair, comparison and replay in one process."""
