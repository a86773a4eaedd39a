"""Launch files, recorder and player of the bench."""
