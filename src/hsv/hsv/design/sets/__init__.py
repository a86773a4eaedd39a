"""Robust invariant sets of the error system (paper eq. 25 to eq. 28): one interface, four ways to compute them."""
