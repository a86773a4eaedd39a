"""The study of the paper: its figures, its claims, the sensitivity of its results, and the physical limits."""
