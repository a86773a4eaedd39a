"""A design's blocks as C source, for a computer that flies them without this library."""
