"""The certificate of a design: its statements recomputed, their tolerances, and which flights it covers."""
