"""Signals, parameters, vehicles with their equipment and faults, trim, the LPV polytope and the airframe."""
