"""Robust invariant sets of the error system (for paper eq. 25 to eq. 28): an ellipsoid, and narrower star norms."""
