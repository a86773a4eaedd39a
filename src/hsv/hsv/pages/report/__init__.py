"""The report of recorded flights: one HTML page that needs nothing but itself."""
