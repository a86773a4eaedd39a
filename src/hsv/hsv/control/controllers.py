"""The controllers that can close the loop, by name."""

from __future__ import annotations

from hsv.parameters import Parameter

CONTROLLERS = ("tube_mpc", "robust_mpc")

CONTROLLER_PARAMETERS = (Parameter("controller", "tube_mpc", "which controller closes the loop", choices=CONTROLLERS),)
