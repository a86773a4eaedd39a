"""The airframe as it is drawn: published geometry, bent by its two modes, with elevator and flame."""
