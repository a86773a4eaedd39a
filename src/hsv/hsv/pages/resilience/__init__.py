"""The page of a resilience campaign."""
