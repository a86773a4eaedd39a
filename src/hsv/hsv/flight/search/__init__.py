"""Searches among the flights of a campaign: for the worst flight, and for the probability of a rare failure."""
