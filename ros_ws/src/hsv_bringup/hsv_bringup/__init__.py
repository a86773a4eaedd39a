"""Launch file, recorder, player, live view and command-line client of the bench."""
