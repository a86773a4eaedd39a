"""Vehicles and their TOML files: equations, coefficients, inertial coupling, envelope, uncertainty and limits.

Every quantity in a file carries its unit. A package registers its files as entry points of the group ``hsv.vehicles``
in its ``pyproject.toml``::

    [project.entry-points."hsv.vehicles"]
    glider = "my_vehicles:glider.toml"

Scenarios and design inputs then select it by ``vehicle = "glider"``. A file that is not registered is selected by its
path relative to the folder of the scenario or inputs, ``vehicle = "glider.toml"``. A file may extend another one
(:mod:`hsv.base.files`). The package of a registered vehicle is located, not imported: reading data runs no code.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self

import tomli_w

from hsv.base.errors import DocumentError, HsvError, ParameterError, QuantityError, VehicleError, one_of
from hsv.base.files import EXTENDS, Tables, follow_extends, is_path, parse_toml, read_text
from hsv.base.parameters import Parameter, table_values, validate
from hsv.base.units import UnitSystem, parse_quantity, readable
from hsv.model.dynamics import AT_REST, COEFFICIENT_UNITS, POSITIVE, STRUCTURES, VehicleParameters
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, PUBLISHED_ALTITUDE, PUBLISHED_VELOCITY

GROUP = "hsv.vehicles"
"""Group of the entry points of vehicles; each is ``package:file.toml``."""

SHIPPED_VEHICLES = {name: f"hsv.model:vehicles/{name}.toml" for name in ("parker", "winged_cone", "winged_cone_lift")}
"""Vehicle files of this library by name; those of other packages are entry points."""

DEFAULT_VEHICLE = "parker"
"""The default vehicle, which is the paper's."""

DEFAULT_STRUCTURE = next(iter(STRUCTURES))
"""Structure of a vehicle whose file does not name one."""

DERIVED = "derived"
"""Name of the set of inertial coupling that is scaled if a number is given as the coupling."""

MAX_COUPLING = 2.0
"""Largest multiple of the derived coupling; more exceeds what a vehicle of this structure can have."""

MAX_UNCERTAIN = 12
"""Maximum number of uncertain parameters: a design flies every corner of their bounds."""

MAX_UNCERTAINTY = 0.9
"""Largest relative bound of an uncertain parameter."""

_DAMPING = ("damping_ratio_1", "damping_ratio_2")
_PSI = dict.fromkeys(("inertial_coupling_1", "inertial_coupling_2"), "kg^0.5 m")
_AXES = {"altitude": "m", "velocity": "m/s"}

COUPLING_PARAMETER = Parameter(
    "vehicle.coupling", "paper_like", "set of inertial coupling, or a multiple of the derived"
)

VEHICLE_PARAMETERS = (
    Parameter("vehicle.name", DEFAULT_VEHICLE, "name of the vehicle, which provides the values that are not given"),
    Parameter("vehicle.structure", DEFAULT_STRUCTURE, "form of the equations of motion", choices=tuple(STRUCTURES)),
    *(
        Parameter(f"vehicle.{name}", 0.0, name.replace("_", " "), "" if unit == "1" else unit)
        for name, unit in COEFFICIENT_UNITS.items()
    ),
    Parameter("vehicle.coupling_sets.names", [""], "names of the sets of inertial coupling"),
    Parameter("vehicle.coupling_sets.values", [], "psi_1 and psi_2 of each set", "kg^0.5 m"),
    *(Parameter(f"vehicle.{axis}_range", [], f"least and largest {axis} of commands", u) for axis, u in _AXES.items()),
    Parameter(
        "vehicle.angle_limit",
        0.0,
        "|angle of attack| and |pitch angle| beyond which a flight counts as diverged",
        "rad",
    ),
    Parameter("vehicle.input_minimum", [], "least fuel equivalence ratio (-) and elevator deflection (rad)"),
    Parameter("vehicle.input_maximum", [], "largest fuel equivalence ratio (-) and elevator deflection (rad)"),
    Parameter("vehicle.uncertainty.names", [""], "names of the uncertain coefficients"),
    Parameter("vehicle.uncertainty.bounds", [], "relative bound of each", "", 0.0, MAX_UNCERTAINTY),
)
"""Parameters of a vehicle for the nodes; missing ones are taken from the vehicle that ``vehicle.name`` names."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A vehicle: its coefficients and limits, inertial coupling, envelope and uncertainty, in SI units."""

    name: str
    title: str
    decoupled: VehicleParameters
    """Coefficients and limits, without inertial coupling (paper eq. 4)"""
    couplings: Mapping[str, tuple[float, float]]
    """psi_1 and psi_2 (kg^0.5 m) of each set of inertial coupling by name; the first set is the default"""
    altitude_range: tuple[float, float]
    """Smallest and largest altitude (m) of commands"""
    velocity_range: tuple[float, float]
    """Smallest and largest velocity (m/s) of commands"""
    uncertainty: Mapping[str, float]
    """Relative bounds of the uncertain coefficients by name (paper section 5.1)"""

    def __post_init__(self) -> None:
        """Check the values; a QuantityError names the wrong one."""
        p = self.decoupled
        units = {**COEFFICIENT_UNITS, "angle_limit": "rad"}
        for name in (name for name in (*POSITIVE, "angle_limit", *_DAMPING) if name in (*p.form.names, "angle_limit")):
            value, undamped = getattr(p, name), name in _DAMPING
            if value < 0.0 or (value == 0.0 and not undamped):
                expected = "at least 0" if undamped else "above zero"
                raise QuantityError(f"{name} = {readable(value, units[name], UnitSystem.si)}: expected {expected}")
        inputs = zip(INPUT_NAMES, zip(p.input_minimum.tolist(), p.input_maximum.tolist(), strict=True), strict=True)
        ranges = {"altitude_range": self.altitude_range, "velocity_range": self.velocity_range, **dict(inputs)}
        for name, (low, high) in ranges.items():
            if not low < high:
                raise QuantityError(f"{name}: {low} to {high}, expected minimum < maximum")
        if not self.velocity_range[0] > 0.0:
            raise QuantityError(f"velocity_range: from {self.velocity_range[0]} m/s, expected above zero")
        if DERIVED not in self.couplings:
            raise QuantityError(f"coupling_sets.names = {[*self.couplings]}: expected one called {DERIVED!r}")
        for name, (psi_1, psi_2) in self.couplings.items():
            # Bessel's inequality for the rotation and orthogonal modes of unit generalised mass.
            if psi_1 * psi_1 + psi_2 * psi_2 > p.moment_of_inertia:
                raise QuantityError(
                    f"inertial_coupling.{name} = {psi_1:.6g}, {psi_2:.6g} kg^0.5 m: expected squares whose "
                    f"sum is at most {p.moment_of_inertia:.6g} kg m^2, the moment of inertia"
                )
        for name in self.uncertainty:
            if name not in p.form.names:
                raise QuantityError(f"uncertainty.names: {name!r}, expected names of coefficients")
        if len(self.uncertainty) > MAX_UNCERTAIN:
            raise QuantityError(
                f"uncertainty: of {len(self.uncertainty)} coefficients, expected at most {MAX_UNCERTAIN}: a design "
                "flies every corner of their bounds"
            )

    @property
    def structure(self) -> str:
        """Name of the form of the equations of motion."""
        return [*STRUCTURES][int(self.decoupled.structure)]

    @property
    def centre(self) -> tuple[float, float]:
        """Altitude (m) and velocity (m/s) at the middle of the envelope."""
        low, high = zip(self.altitude_range, self.velocity_range, strict=True)
        return 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])

    def condition(self, altitude: float | str, velocity: float | str) -> tuple[float | str, float | str]:
        """Return the altitude and the velocity; an empty one is replaced by that of the published trim.

        If the published trim is outside the envelope, the centre of the envelope is used instead.
        """
        published_altitude = parse_quantity(PUBLISHED_ALTITUDE, "m", "altitude")
        published_velocity = parse_quantity(PUBLISHED_VELOCITY, "m/s", "velocity")
        (h_low, h_high), (v_low, v_high) = self.altitude_range, self.velocity_range
        inside = h_low <= published_altitude <= h_high and v_low <= published_velocity <= v_high
        at = (PUBLISHED_ALTITUDE, PUBLISHED_VELOCITY) if inside else self.centre
        return at[0] if altitude == "" else altitude, at[1] if velocity == "" else velocity

    def coupling_name(self, coupling: object = "") -> str:
        """Return the canonical name of a choice of inertial coupling: a set, or a multiple of the derived set as text.

        Args:
            coupling: A name, a number or its text; empty, or ``paper_like`` for a rigid vehicle: the first set.

        Raises:
            QuantityError: There is no such set, or the number is not between 0 and :data:`MAX_COUPLING`.
        """
        if coupling == "" or (coupling == COUPLING_PARAMETER.default and not self.decoupled.form.elastic):
            return next(iter(self.couplings))
        if isinstance(coupling, str) and coupling in self.couplings:
            return coupling
        try:
            scale = float(coupling) if isinstance(coupling, str | float | int) else math.nan
        except (ValueError, OverflowError):
            scale = math.nan
        if isinstance(coupling, bool) or not 0.0 <= scale <= MAX_COUPLING:
            multiple = f", or a multiple of {DERIVED} from 0 to {MAX_COUPLING:g}, such as 0.65"
            raise QuantityError(f"coupling = {coupling!r}: expected {one_of(self.couplings, str(coupling), multiple)}")
        return repr(scale)

    def coupled(self, coupling: str | float = "") -> VehicleParameters:
        """Return the coupled model (paper eq. 1) with the inertial coupling named as in :meth:`coupling_name`."""
        name = self.coupling_name(coupling)
        if name in self.couplings:
            psi_1, psi_2 = self.couplings[name]
        else:
            psi_1, psi_2 = (float(name) * psi for psi in self.couplings[DERIVED])
        return self.decoupled._replace(inertial_coupling_1=psi_1, inertial_coupling_2=psi_2)

    def coupling_scale(self, coupling: str) -> float:
        """Return the strength kappa of a set of inertial coupling: its coefficient psi_1 over the derived set's."""
        return self.couplings[coupling][0] / self.couplings[DERIVED][0]

    def check_envelope(self, table: Iterable[Parameter], values: Mapping[str, Any]) -> None:
        """Check that altitudes and velocities (values of ``table``'s parameters in m and m/s) lie in the envelope.

        Raises:
            ParameterError: A value is outside; the message names its parameter.
        """
        ranges = {"m": self.altitude_range, "m/s": self.velocity_range}
        for parameter in table:
            if parameter.unit in ranges:
                low, high = ranges[parameter.unit]
                replace(parameter, minimum=low, maximum=high).check(values[parameter.name])

    def to_parameters(self) -> dict[str, Any]:
        """Return the values of :data:`VEHICLE_PARAMETERS` that describe this vehicle, by name."""
        p = self.decoupled
        # A coefficient that is left out does not change the digest of a vehicle that never had it.
        coefficients = {name: getattr(p, name) for name in p.form.names}
        return {
            "vehicle.name": self.name,
            "vehicle.structure": self.structure,
            **{f"vehicle.{name}": n for name, n in coefficients.items() if n or name not in p.form.optional},
            "vehicle.coupling_sets.names": list(self.couplings),
            "vehicle.coupling_sets.values": [psi for pair in self.couplings.values() for psi in pair],
            "vehicle.altitude_range": list(self.altitude_range),
            "vehicle.velocity_range": list(self.velocity_range),
            "vehicle.angle_limit": p.angle_limit,
            "vehicle.input_minimum": p.input_minimum.tolist(),
            "vehicle.input_maximum": p.input_maximum.tolist(),
            "vehicle.uncertainty.names": list(self.uncertainty),
            "vehicle.uncertainty.bounds": list(self.uncertainty.values()),
        }

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> Self:
        """Return the vehicle that the values of :data:`VEHICLE_PARAMETERS` describe.

        Missing values are taken from the registered vehicle called ``vehicle.name``.

        Raises:
            ParameterError: A value is wrong, or missing for a ``vehicle.name`` that is a path; the message names it.
            VehicleError: Values are missing, and no vehicle of that name is registered.
        """
        if lacking := missing_parameters(values):
            # Parameters may come from an untrusted bag or certificate: a path in them is not opened.
            if is_path(name := str(values.get("vehicle.name", DEFAULT_VEHICLE))):
                raise ParameterError(f"parameter {lacking[0]}: missing, expected that of the vehicle {name!r}")
            values = {**named_parameters(values), **values}
        v = {name.removeprefix("vehicle."): value for name, value in validate(VEHICLE_PARAMETERS, values).items()}
        sets, bounds = v["coupling_sets.names"], v["uncertainty.bounds"]
        sizes = {"coupling_sets.values": 2 * len(sets), "uncertainty.bounds": len(v["uncertainty.names"])}
        for name in (*sizes, "altitude_range", "velocity_range", "input_minimum", "input_maximum"):
            if len(v[name]) != sizes.get(name, 2):
                raise ParameterError(f"parameter vehicle.{name} = {v[name]}: expected {sizes.get(name, 2)} numbers")
        low, high = ([float(number) for number in v[f"input_{end}"]] for end in ("minimum", "maximum"))
        psi = list(map(float, v["coupling_sets.values"]))
        try:
            return cls(
                name=v["name"],
                title="",
                decoupled=_parameters(
                    v["structure"],
                    {name: v[name] for name in STRUCTURES[v["structure"]].names},
                    low,
                    high,
                    v["angle_limit"],
                ),
                couplings=dict(zip(sets, zip(psi[::2], psi[1::2], strict=True), strict=True)),
                altitude_range=(float(v["altitude_range"][0]), float(v["altitude_range"][1])),
                velocity_range=(float(v["velocity_range"][0]), float(v["velocity_range"][1])),
                uncertainty=dict(zip(v["uncertainty.names"], map(float, bounds), strict=True)),
            )
        except QuantityError as error:
            raise ParameterError(f"parameter vehicle.{error}") from error

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all parameters except the name; empty if it is that of the default vehicle, as in old designs."""
        own, default = (_digest(vehicle) for vehicle in (self, load_vehicle()))
        return "" if own == default else own


def _digest(vehicle: Vehicle) -> str:
    values = vehicle.to_parameters()
    del values["vehicle.name"]
    if vehicle.structure == DEFAULT_STRUCTURE:  # the only one when the first designs were certified
        del values["vehicle.structure"]
    return hashlib.sha256(json.dumps(values).encode()).hexdigest()


def missing_parameters(values: Mapping[str, Any]) -> list[str]:
    """Return the names of the parameters that ``values`` lacks for a complete vehicle of its structure."""
    form = STRUCTURES.get(str(values.get("vehicle.structure", DEFAULT_STRUCTURE)), STRUCTURES[DEFAULT_STRUCTURE])
    required = {*form.names} - {*form.optional}
    optional = {"vehicle.structure", *(f"vehicle.{name}" for name in COEFFICIENT_UNITS if name not in required)}
    names = (parameter.name for parameter in VEHICLE_PARAMETERS)
    return [name for name in names if name not in optional and name not in values]


def named_parameters(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of the vehicle called ``vehicle.name`` in ``values``; without a name, of the default one.

    Raises:
        VehicleError: There is no vehicle of that name.
    """
    return load_vehicle(str(values.get("vehicle.name", DEFAULT_VEHICLE))).to_parameters()


def vehicle_names() -> list[str]:
    """Return the names of all registered vehicles."""
    return sorted({*SHIPPED_VEHICLES, *_places_elsewhere()})


def _places_elsewhere() -> dict[str, str]:
    """Return the entry points, such as ``package:file.toml``, of the vehicles in other packages, by vehicle name."""
    from importlib.metadata import entry_points  # slow

    return {entry.name: entry.value for entry in reversed([*entry_points(group=GROUP)])}


def load_vehicle(name: str = DEFAULT_VEHICLE) -> Vehicle:
    """Return a registered vehicle by name, or one from a file by path.

    Raises:
        VehicleError: There is no such vehicle, or a field is wrong; the message names it and what was expected.
    """
    return parse_vehicle(vehicle_tables(name), vehicle_label(name)) if is_path(name) else _registered(name)


@cache
def _registered(name: str) -> Vehicle:
    return parse_vehicle(vehicle_tables(name), name)


def vehicle_label(name: str) -> str:
    """Return the name of a vehicle given by name or path: of a path, the file name without its suffix."""
    return Path(name).stem if is_path(name) else name


def vehicle_tables(name: str) -> Tables:
    """Return the contents of a vehicle file, by name or path, merged over the files that it extends.

    Raises:
        VehicleError: The file, or a file that it extends, is missing or not TOML, or the files extend each other.
    """
    return follow_extends(name, _read, lambda file, why: VehicleError(f"vehicle {vehicle_label(file)!r}: {why}"))


def vehicle_text(name: str) -> str:
    """Return the text of a valid vehicle file, by name or path, with the files that it extends merged in."""
    load_vehicle(name)
    return tomli_w.dumps(vehicle_tables(name)) if EXTENDS in _read(name) else read_text(_path(name))


def _read(name: str) -> Tables:
    path = _path(name)
    try:
        return parse_toml(read_text(path))
    except DocumentError as error:
        raise VehicleError(f"vehicle {name!r}: {error}, expected a TOML file") from error


def _path(name: str) -> Path:
    if is_path(name):
        return Path(name)
    place = SHIPPED_VEHICLES.get(name) or _places_elsewhere().get(name, "")
    if not place:
        choices = one_of(vehicle_names(), name, " or the path of a TOML file")
        raise VehicleError(f"vehicle {name!r}: expected {choices}")
    package, _, file = place.partition(":")
    spec = find_spec(package)
    folders = list(spec.submodule_search_locations or ()) if spec else []
    if not folders or not file:
        raise VehicleError(f"vehicle {name!r}: registered as {place!r}, expected package:file.toml of an installed one")
    return Path(folders[0], file)


def parse_vehicle(tables: Mapping[str, Any], name: str) -> Vehicle:
    """Return the vehicle that the ``tables`` of a file describe, with the given ``name``.

    Raises:
        VehicleError: A field is missing, unknown or wrong; the message names it and what was expected.
    """
    try:
        return _parsed(tables, name)
    except HsvError as error:
        raise VehicleError(f"vehicle {name!r}: {error}") from error


def _parsed(tables: Mapping[str, Any], name: str) -> Vehicle:
    structure = tables.get("structure", DEFAULT_STRUCTURE)
    if structure not in [*STRUCTURES]:  # a list, because a TOML table cannot be looked up in a dict
        raise QuantityError(f"structure = {structure!r}: expected {one_of(STRUCTURES, str(structure))}")
    form = STRUCTURES[structure]
    sets = tables.get("inertial_coupling", {}) if form.elastic else {}
    names = [*sets] if isinstance(sets, Mapping) else []
    for coupling in names:
        if not (coupling.isidentifier() and coupling.islower()):
            raise QuantityError(f"inertial_coupling.{coupling}: expected a name of lower-case letters, digits and _")
    coefficients = {f"{table}.{key}": unit for table, units in form.tables.items() for key, unit in units.items()}
    rows = coefficients | {f"inertial_coupling.{one}.{psi}": unit for one in names for psi, unit in _PSI.items()}
    ends = {f"envelope.{axis}": unit for axis, unit in _AXES.items()}
    ends |= {f"input_limits.{field}": unit for field, unit in zip(INPUT_NAMES, INPUT_UNITS, strict=True)}
    quantities = {f"{row}.value": unit for row, unit in rows.items()} | {"envelope.angle.maximum": "rad"}
    quantities |= {f"{row}.{end}": unit for row, unit in ends.items() for end in ("minimum", "maximum")}
    parameters = [
        Parameter("title", "", "title of the vehicle"),
        Parameter("structure", "", "form of the equations of motion"),
        *(Parameter(field, 0.0, "", "" if unit == "1" else unit) for field, unit in quantities.items()),
        *(Parameter(f"{row}.symbol", "", "") for row in rows),
        *(Parameter(f"{row}.uncertainty", 0.0, "", "", 0.0, MAX_UNCERTAINTY) for row in coefficients),
    ]
    v = table_values(parameters, tables)
    title = v.get("title", "")
    if not title.strip() and "title" in tables:
        raise QuantityError(f"title = {title!r}: expected a text that is not empty")
    optional = {f"{row}.value" for row in coefficients if row.rpartition(".")[2] in form.optional}
    for field, unit in quantities.items():
        if field not in v and field not in optional:
            raise QuantityError(
                f"{field}: missing, expected a quantity such as {'1.0' if unit == '1' else f'1.0 {unit}'!r}"
            )
    (altitude, velocity, *limits) = [(v[f"{row}.minimum"], v[f"{row}.maximum"]) for row in ends]
    low, high = zip(*limits, strict=True)
    psi = {one: [v[f"inertial_coupling.{one}.{key}.value"] for key in _PSI] for one in names}
    known = {
        row.rpartition(".")[2]: (v.get(f"{row}.value", 0.0), v.get(f"{row}.uncertainty", 0.0)) for row in coefficients
    }
    return Vehicle(
        name=name,
        title=title,
        decoupled=_parameters(
            structure, {key: value for key, (value, _) in known.items()}, low, high, v["envelope.angle.maximum"]
        ),
        couplings={one: (pair[0], pair[1]) for one, pair in psi.items()} if form.elastic else {DERIVED: (0.0, 0.0)},
        altitude_range=altitude,
        velocity_range=velocity,
        # A vehicle that extends another one may set a bound to zero.
        uncertainty={key: bound for key, (_, bound) in known.items() if bound},
    )


def _parameters(
    structure: str, coefficients: Mapping[str, float], low: Iterable[float], high: Iterable[float], angle_limit: float
) -> VehicleParameters:
    ends = {"minimum": low, "maximum": high}
    limits = {f"{name}_{end}": n for end, row in ends.items() for name, n in zip(INPUT_NAMES, row, strict=True)}
    places = {} if STRUCTURES[structure].elastic else AT_REST
    code = float([*STRUCTURES].index(structure))
    return VehicleParameters(**coefficients, **places, **limits, structure=code, angle_limit=angle_limit)
