"""Robust invariant sets of the error system (paper eq. 25 to eq. 28): an ellipsoid, which star norms may narrow."""
