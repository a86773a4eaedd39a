"""Robust invariant sets of the error system, in place of the box of eq. 25 to 28: ellipsoid and narrower star norms."""
