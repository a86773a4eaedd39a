"""Monte Carlo campaigns: many flights of one scenario, each of which can be repeated by itself."""
