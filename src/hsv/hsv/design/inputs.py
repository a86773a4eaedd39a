"""The inputs of an offline design, checked before use: a TOML file with units, or a certificate's table in SI."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from hsv.base.errors import DesignError, DocumentError, QuantityError, one_of
from hsv.base.files import follow_extends, is_path, parse_toml, read_text
from hsv.base.units import parse_quantity
from hsv.control.design_file import find_file
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.signals import N_RIGID
from hsv.model.vehicle import Vehicle, load_vehicle

_SI = "SI"
"""Validation context of tables whose quantities are plain numbers in SI, as in a certificate."""


def _quantity(unit: str) -> BeforeValidator:
    def parse(value: Any, info: ValidationInfo) -> float:
        if info.context == _SI and isinstance(value, float):
            return value
        return parse_quantity(value, unit, info.field_name or "value")

    return BeforeValidator(parse)


Number = Annotated[float, _quantity("1")]
Length = Annotated[float, _quantity("m")]
Speed = Annotated[float, _quantity("m/s")]
Acceleration = Annotated[float, _quantity("m/s^2")]
Angle = Annotated[float, _quantity("rad")]
AngleTime = Annotated[float, _quantity("rad s")]
AngularRate = Annotated[float, _quantity("rad/s")]
AngularAcceleration = Annotated[float, _quantity("rad/s^2")]
ElasticCoordinate = Annotated[float, _quantity("kg^0.5 m")]
ElasticRate = Annotated[float, _quantity("kg^0.5 m/s")]
Duration = Annotated[float, _quantity("s")]
Positive = Field(gt=0.0)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


_Model = TypeVar("_Model", bound=_Table)


class _Sizes(_Table):
    def array(self) -> np.ndarray:
        """Return the values in the order of the fields, SI."""
        return np.array(list(self.model_dump().values()), float)


class RigidScale(_Sizes):
    """Scales of the five rigid states: deviations that weigh equally."""

    altitude: Length = Positive
    velocity: Speed = Positive
    angle_of_attack: Angle = Positive
    pitch_angle: Angle = Positive
    pitch_rate: AngularRate = Positive


class InputSize(_Sizes):
    """Scales or bounds of the two inputs."""

    fuel_equivalence_ratio: Number = Positive
    elevator_deflection: Angle = Positive


class FlightPoint(_Table):
    """Level flight at an altitude and a velocity."""

    altitude: Length
    velocity: Speed = Positive


class StateScale(RigidScale):
    """Scales of all nine states: deviations that weigh equally."""

    elastic_coordinate_1: ElasticCoordinate = Positive
    elastic_rate_1: ElasticRate = Positive
    elastic_coordinate_2: ElasticCoordinate = Positive
    elastic_rate_2: ElasticRate = Positive


class FilterScale(_Sizes):
    """Scales of the two states of each section of the notch filter: deviations that weigh as much as the vehicle's."""

    state_1: Angle = Positive
    state_2: AngleTime = Positive


class GridInputs(_Table):
    """Numbers of vertices of a model on a grid over the envelope, with bilinear weights."""

    altitude_vertices: int = Field(ge=2, le=20)
    velocity_vertices: int = Field(ge=2, le=20)


class TensorProductInputs(_Table):
    """Options of the tensor-product model transformation; ``tolerance``: least relative singular value that is kept."""

    functions: Literal["singular", "polynomial"] = "singular"
    """Basis functions of the weights, see :func:`hsv.model.lpv.tensor_product.tensor_product`."""
    tolerance: Number = Field(gt=0.0, lt=1.0)
    altitude_samples: int = Field(ge=5, le=100)
    velocity_samples: int = Field(ge=5, le=100)
    state_scale: StateScale
    input_scale: InputSize
    filter_scale: FilterScale | None = None
    """Scales of the filter states of the ECM; None for the DM, which has no filter."""


class ModelInputs(_Table):
    """The polytopic model over the envelope.

    ``system``: "DM", the decoupled vehicle (paper eq. 12), or "ECM", the decoupled vehicle with its filter (eq. 45).
    """

    system: Literal["DM", "ECM"] = "DM"
    period: Duration = Positive
    representation: Literal["tensor_product", "grid"]
    grid: GridInputs | None = None
    """The grid of the representation "grid"."""
    tensor_product: TensorProductInputs


class FeedbackDisturbance(_Table):
    """Disturbances that the feedback gain rejects, each constant over a period; only their proportions matter."""

    acceleration: Acceleration = Positive
    angle_of_attack_rate: AngularRate = Positive
    pitch_acceleration: AngularAcceleration = Positive
    elevator_loss: Number = Field(gt=0.0, lt=1.0)
    """Lost share of the trim elevator."""


class FeedbackInputs(_Table):
    """Inputs of the feedback gain F (paper eq. 24)."""

    method: Literal["guaranteed_cost", "feasibility"]
    state_scale: RigidScale
    input_scale: InputSize
    disturbance: FeedbackDisturbance


class NominalInputs(_Table):
    """Inputs of the nominal gains K (eq. 32 to 35): one gain for each of the ``scales`` of x_n(0) = start - target."""

    interpolated: bool | None = None
    """True: the gain is interpolated between two ellipsoids. False or None: it is switched."""

    start: FlightPoint
    target: FlightPoint
    scales: list[Annotated[float, Field(gt=0.0, le=1.0)]] = Field(min_length=1, max_length=20)
    state_scale: RigidScale
    input_scale: InputSize
    input_bound: InputSize

    @field_validator("scales")
    @classmethod
    def _decreasing(cls, scales: list[float]) -> list[float]:
        if any(a <= b for a, b in pairwise(scales)):
            raise ValueError(f"scales = {scales}: expected decreasing factors above zero")
        return scales


class NotchInputs(_Table):
    """One section of the notch filter for which the design is made (paper eq. 38)."""

    zero_frequency: AngularRate = Positive
    zero_damping: Number = Field(ge=0.0)
    pole_frequency: AngularRate = Positive
    pole_damping: Number = Positive


class RampInputs(_Table):
    """A ramp of the commands from the nominal start to the target, with its corners at the times ``start`` and ``end``.

    ``blend``: half the duration of the change of rate about either corner; None: the rate jumps at the corners.
    """

    start: Duration = Field(ge=0.0)
    end: Duration = Positive
    blend: Duration | None = Field(default=None, gt=0.0)

    @field_validator("end")
    @classmethod
    def _later(cls, end: float, info: ValidationInfo) -> float:
        start = info.data.get("start", 0.0)
        if end <= start:
            raise ValueError(f"end = {end:g} s: expected later than start = {start:g} s")
        return end


def _coupling(value: Any) -> Any:
    """Return a number, the multiple of the derived coupling, as text ("0.5" too), and any other ``value`` unchanged."""
    try:
        return value if isinstance(value, bool) else repr(float(value))
    except (TypeError, ValueError):
        return value


class DisturbanceInputs(_Table):
    """Flights that measure the disturbances (eq. 13 to 19): from nominal start to target, with an elevator fault."""

    coupling: Annotated[str, BeforeValidator(_coupling)]
    """Name of a set of inertial coupling of the vehicle, or a multiple of the derived coupling."""
    duration: Duration = Positive
    elevator_effectiveness: Number = Field(gt=0.0, lt=1.0)
    fault_start: Duration = Positive
    fault_window: list[Duration] = Field(default=[], max_length=2)
    """First and last start of a fault for which flights stay in the set; empty: ``fault_start`` alone."""
    inflation: Number = Field(ge=1.0)
    """Factor on all measured bounds."""
    share: Number = Field(gt=0.0, le=1.0)
    """Share of the inflated disturbance set for which the invariant set is certified."""
    ramp: RampInputs | None = None
    """Ramp of the commands from the nominal start to the target; None: a step at t = 0."""

    @model_validator(mode="after")
    def _around_the_fault(self) -> Self:
        window = self.fault_window
        if window and not (len(window) == 2 and window[0] <= self.fault_start <= window[1] < self.duration):
            raise ValueError(
                f"fault_window = {window}: expected two times, with fault_start = {self.fault_start:g} s between them, "
                f"before duration = {self.duration:g} s"
            )
        return self


class RateInputs(_Sizes):
    """Largest rates of altitude and velocity for which the tightened bounds are certified; slower flights keep them."""

    altitude: Speed = Positive
    velocity: Acceleration = Positive


class InvariantSetInputs(_Table):
    """Inputs of the invariant set (paper eq. 25 to eq. 28); the scales weigh its half-widths and its feedback."""

    method: Literal["ellipsoid", "star_norms"]
    """"ellipsoid": one ellipsoid for all disturbances; "star_norms": also one for each output and channel."""
    contraction: list[Annotated[float, Field(gt=0.0, lt=1.0)]] = Field(min_length=1, max_length=20)
    """Values of the multiplier lam of the S-procedure to try for the ellipsoid."""
    state_scale: RigidScale
    input_scale: InputSize
    rates: RateInputs | None = None
    """If stated, the feedback is bounded for these rates; else for vertices that jump from step to step."""


class TighteningInputs(_Table):
    """Inputs for the bounds of the nominal input (paper eq. 30 and 35)."""

    chain: Literal["design_bounds", "literal"]
    """"literal": the bounds in (35) follow from (30). "design_bounds": they are inputs, and (30) checks the plan."""


class MarginInputs(_Table):
    """Required disk margins of the loops at every vertex; None: none required."""

    fuel: Number | None = Field(default=None, gt=0.0, lt=2.0)
    elevator: Number | None = Field(default=None, gt=0.0, lt=2.0)
    both: Number | None = Field(default=None, gt=0.0, lt=2.0)


class AdjustableInputs(_Table):
    """The tube factor tau (paper section 4.3): one value, or one for each of the five rigid states."""

    tau: Annotated[list[Number], BeforeValidator(lambda tau: tau if isinstance(tau, list) else [tau])] = Field(
        min_length=1
    )

    @field_validator("tau")
    @classmethod
    def _shares(cls, tau: list[float]) -> list[float]:
        if len(tau) not in (1, N_RIGID) or not all(0.0 < value <= 1.0 for value in tau):
            raise ValueError(f"tau = {tau}: expected one value, or five, above 0 and at most 1")
        return tau

    def array(self) -> np.ndarray:
        """Return the factors, one for each of the five rigid states."""
        return np.full(N_RIGID, self.tau[0]) if len(self.tau) == 1 else np.array(self.tau)


class ActuatorInputs(_Table):
    """Names of the actuators that the design includes; None: an ideal actuator.

    Their dynamics add states to the error system. In place of their own stops, the vehicle's input limits hold.
    """

    fuel_equivalence_ratio: str | None = None
    elevator_deflection: str | None = None

    @field_validator("fuel_equivalence_ratio", "elevator_deflection")
    @classmethod
    def _known(cls, name: str | None, info: ValidationInfo) -> str | None:
        names = [key for key, actuator in ACTUATOR_SETS.items() if actuator.channel == info.field_name]
        if name is not None and name not in names:
            raise ValueError(f"{info.field_name} = {name!r}: expected {one_of(names, name)}")
        return name

    def names(self) -> tuple[str, ...]:
        """Return the names of the actuators that are not ideal, in the order of the inputs."""
        return tuple(name for name in (self.fuel_equivalence_ratio, self.elevator_deflection) if name)


def _vehicle_values(vehicle: Vehicle | None) -> dict[str, Any] | None:
    return vehicle.to_parameters() if vehicle else None


def _vehicle(value: Any, info: ValidationInfo) -> Vehicle | None:
    """Return the vehicle given by name, path or certificate table; None if it is the default one, as if not given."""
    if info.context == _SI:
        return Vehicle.from_parameters(value)
    if not isinstance(value, str):
        raise ValueError(f"vehicle = {value!r}: expected a name or a path")
    vehicle = load_vehicle(value)
    return vehicle if vehicle.digest else None


class CertifiedInputs(_Table):
    """The inputs of a design that its certificate states, SI: those that say what is certified and how it was flown."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    vehicle: Annotated[Vehicle | None, BeforeValidator(_vehicle), PlainSerializer(_vehicle_values)] = None
    """The vehicle, in a file given by its registered name or a path; None: the default vehicle."""
    model: ModelInputs
    actuator: ActuatorInputs | None = None
    notch: list[NotchInputs] = Field(default=[], max_length=4)
    nominal: NominalInputs
    disturbance: DisturbanceInputs
    invariant_set: InvariantSetInputs
    adjustable: AdjustableInputs | None = None
    margins: MarginInputs = Field(default=MarginInputs(), exclude=True)
    """They decide whether a design is written; the certificate states the margins that the design has."""

    @model_validator(mode="after")
    def _coupled(self) -> Self:
        try:
            self.flown_vehicle.coupling_name(self.disturbance.coupling)
        except QuantityError as error:
            raise ValueError(f"disturbance.{error}") from error
        if self.actuators and self.adjustable:
            raise ValueError("actuator: given, expected none in an adjustable design")
        return self

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators of the design that are not ideal."""
        return self.actuator.names() if self.actuator else ()

    @property
    def flown_vehicle(self) -> Vehicle:
        """The vehicle for which the design is made."""
        return self.vehicle or load_vehicle()

    def report(self) -> dict[str, Any]:
        """Return these inputs for a certificate, without those of the search and without a grid that is not used."""
        table = self.model_dump(include=set(CertifiedInputs.model_fields), exclude_none=True)
        if self.model.representation != "grid":
            table["model"].pop("grid", None)
        return table


class DesignInputs(CertifiedInputs):
    """All inputs, in SI, of a design: adjustable (paper section 4) if ``adjustable`` is given, else a baseline."""

    description: str
    feedback: FeedbackInputs
    tightening: TighteningInputs

    def error_scale(self) -> np.ndarray:
        """Return the scales of the errors, shape (5 + 2 m,), for the rigid states and the m filter sections, SI.

        Those of the rigid states are those for F. Those of the two states of a section are the scale of the pitch
        rate divided by the pole frequency, and by its square: roughly the amplitudes that this pitch rate excites.
        """
        rigid = self.feedback.state_scale.array()
        filters = [rigid[-1] / section.pole_frequency**power for section in self.notch for power in (1, 2)]
        return np.concatenate((rigid, filters))


def parse_inputs(table: dict[str, Any]) -> DesignInputs:
    """Return the design inputs in a ``table`` read from TOML, with quantities as texts with units.

    Raises:
        DesignError: A field is missing, unknown or has a wrong value; the message names it.
    """
    return _validated(DesignInputs, table)


def inputs_from_report(table: dict[str, Any]) -> CertifiedInputs:
    """Return the design inputs in a certificate's ``table``: plain numbers, SI; errors as in :func:`parse_inputs`."""
    return _validated(CertifiedInputs, table, "inputs: ", _SI)


def _validated(model: type[_Model], table: dict[str, Any], prefix: str = "", context: str = "") -> _Model:
    try:
        return model.model_validate(table, context=context)
    except ValidationError as error:
        raise DesignError(prefix + _first_line(error, table)) from error


def read_inputs(path: Path) -> DesignInputs:
    """Return the design inputs in a TOML file and the files that it extends.

    Raises:
        DesignError: A file is missing or is not TOML, files extend each other, or a field is wrong.
    """
    table = follow_extends(str(path), _read, lambda name, why: DesignError(f"{name}: {why}"))
    try:
        return parse_inputs(table)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error


def _read(name: str) -> dict[str, Any]:
    path = Path(name) if is_path(name) else find_inputs(name)
    try:
        table = parse_toml(read_text(path))
    except DocumentError as error:
        raise DesignError(f"{path}: {error}, expected a design input file in TOML") from error
    vehicle = table.get("vehicle")
    if isinstance(vehicle, str) and is_path(vehicle):
        table["vehicle"] = str(path.parent / vehicle)
    return table


def with_tau(inputs: DesignInputs, tau: list[float]) -> DesignInputs:
    """Return ``inputs`` with another tube factor ``tau``: one value, or one for each of the five rigid states.

    Raises:
        DesignError: The design is not adjustable, or the value is wrong.
    """
    if inputs.adjustable is None:
        raise DesignError(f"design {inputs.name!r}: tau = {tau} given, expected a design with an [adjustable] table")
    return inputs.model_copy(update={"adjustable": _validated(AdjustableInputs, {"tau": tau})})


def find_inputs(name: str) -> Path:
    """Return the path of a design's TOML file; ``name``: a path, or a name in HSV_DESIGN_PATH or of a shipped one.

    Raises:
        DesignError: There is no such file.
    """
    return find_file(name, ".toml")


def _first_line(error: ValidationError, table: dict[str, Any]) -> str:
    first = error.errors()[0]
    cause = first.get("ctx", {}).get("error")
    if not first["loc"]:
        return str(cause)  # an error of the inputs as a whole names its field
    *parents, leaf = (str(part) for part in first["loc"])
    if isinstance(cause, ValueError):  # the message names the field, but not the tables that contain it
        return ".".join((*(parents[:-1] if leaf.isdigit() else parents), str(cause)))
    field = ".".join((*parents, leaf))
    if first["type"] == "missing":
        return f"{field}: missing, expected a value"
    if first["type"] == "extra_forbidden":
        return f"{field}: unknown field, expected none of that name"
    written: Any = table
    for part in first["loc"]:
        written = written[part]
    return f"{field} = {written!r}: {first['msg'][0].lower()}{first['msg'][1:]}"
