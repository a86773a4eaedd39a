"""Initial state of a flight, in the trim of the nominal vehicle in still air, used by more than the plant."""

from __future__ import annotations

from collections.abc import Mapping

from hsv.base.errors import ParameterError, QuantityError
from hsv.base.parameters import Parameter, check_all
from hsv.model.trim import Trim, trim
from hsv.model.vehicle import COUPLING_PARAMETER, Vehicle
from hsv.model.vehicle_parameters import MODELS, VehicleParameters

INITIAL_PARAMETERS = (
    Parameter("vehicle.model", "CM", "coupled model (paper eq. 1) or decoupled model (eq. 4)", choices=MODELS),
    COUPLING_PARAMETER,
    Parameter("initial.altitude", 26060.4, "altitude of the initial trim, in the vehicle's range", "m"),
    Parameter("initial.velocity", 2407.92, "velocity of the initial trim, in the vehicle's range", "m/s"),
)


def initial_trim(values: Mapping[str, object]) -> tuple[VehicleParameters, Trim]:
    """Return the nominal vehicle of a flight and its trim, from :data:`INITIAL_PARAMETERS` and the vehicle's.

    Raises:
        ParameterError, TrimError: A wrong value, named.
    """
    v = check_all(INITIAL_PARAMETERS, values)
    vehicle = Vehicle.from_parameters(values)
    vehicle.check_envelope(INITIAL_PARAMETERS, v)
    try:
        nominal = vehicle.coupled(v["vehicle.coupling"])
    except QuantityError as error:
        raise ParameterError(f"parameter vehicle.{error}") from error
    if v["vehicle.model"] == "DM":
        nominal = nominal.decoupled()
    return nominal, trim(nominal, v["initial.altitude"], v["initial.velocity"])
