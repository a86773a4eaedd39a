"""Geometry of the side view of the vehicle, as plain data: outlines with the bending mode at each point; its image."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np

from hsv.pages.airframe.geometry import Airframe, Point, airframe

SPACING = 0.5
"""Maximum distance (m) along x between neighbouring points of an outline."""


@cache
def geometry(plain: bool = False) -> dict[str, Any]:
    """Return the geometry that the class ``SideView`` of ``vehicle.js`` draws, ready for JSON.

    Points are ``[x, z, mode, shape, slope]``: x and z in body axes (m), the index of the elastic coordinate (kg^0.5 m)
    that bends the vehicle there, and, per unit of it, the deflection (kg^-0.5) and its slope along x (kg^-0.5/m).
    Points of the elevator's outline are ``[x, z]``, relative to the hinge (m). The airframe is that of the paper's
    vehicle with, under ``plain``, the cone that is drawn for a rigid vehicle, whose shape is not known.
    """
    frame = airframe()
    chord, thickness = frame.elevator_chord, frame.elevator_thickness
    cowl = frame.engine_roof - frame.engine_height
    ramp = [(frame.nozzle, frame.engine_roof), (frame.inlet, frame.engine_roof)]
    found: dict[str, Any] = {
        "length": frame.length,
        "exaggeration": frame.exaggeration,
        "largest_exaggeration": frame.largest_exaggeration,
        "body": _outline(frame, [frame.nose, frame.tail, *ramp]),
        "engine": _outline(frame, [*reversed(ramp), (frame.nozzle, cowl), (frame.inlet, cowl)]),
        "axis": [_point(frame, x, 0.0) for x in np.linspace(frame.fore_body, -frame.aft_body, 62)],
        "elevator": {
            "hinge": _point(frame, *frame.elevator_hinge),
            # Leading edge, top, trailing edge and bottom, relative to the hinge.
            "outline": [[0.5 * chord, 0.0], [0.0, 0.5 * thickness], [-0.5 * chord, 0.0], [0.0, -0.5 * thickness]],
        },
        "flame": {
            "roof": _point(frame, frame.nozzle, frame.engine_roof),
            "cowl": _point(frame, frame.nozzle, cowl),
            "length": 3.0 * frame.engine / frame.full_fuel_equivalence_ratio,
        },
    }
    if plain:
        top, roof, hinge, lip, bottom = (
            _point(frame, -frame.aft_body, z * frame.length) for z in (0.06, 0.03, 0.0, -0.03, -0.06)
        )
        found |= {"body": [_point(frame, frame.fore_body, 0.0), top, bottom], "engine": [bottom]}
        found["elevator"] |= {"hinge": hinge}
        found["flame"] |= {"roof": roof, "cowl": lip}
    return found if plain else found | {"plain": geometry(plain=True)}


class Image:
    """The side view of a vehicle as an image, of 640 x 400 pixels; angles are true, the bending is exaggerated."""

    def __init__(self, shown: bool, elastic: bool) -> None:
        """Open a window if the image is ``shown``; a vehicle that is not ``elastic`` is drawn as a plain cone."""
        # Imported here, as pages need the geometry only and matplotlib takes long to import.
        from matplotlib import pyplot
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._geometry = geometry(plain=not elastic)
        self._opened = pyplot.fignum_exists
        self.figure = (pyplot.figure if shown else Figure)(figsize=(6.4, 4.0), dpi=100)
        if shown and self.figure.canvas.required_interactive_framework is None:
            warnings.warn("render_mode = 'human': no window can be opened without a display", stacklevel=2)
        self._pixels = FigureCanvasAgg(self.figure) if not shown else None
        self._axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))

    def draw(self, time: float, state: np.ndarray, effector: np.ndarray) -> np.ndarray | None:
        """Draw the state (9, SI) at a ``time`` (s) with the inputs ``effector`` (2), and show it.

        Return the pixels (400, 640, 3), or None if they are in a window; a window that the user closed stays closed.
        """
        if self._pixels is None and not self._opened(self.figure.number):
            return None
        drawn, axes, half = self._geometry, self._axes, 0.65 * self._geometry["length"]
        altitude, velocity, alpha, pitch, _, *elastic = state
        bend = drawn["exaggeration"] * np.array([*elastic[::2], 0.0])
        turn = np.array([[np.cos(pitch), np.sin(pitch)], [-np.sin(pitch), np.cos(pitch)]])

        def bent(points: Any) -> np.ndarray:
            x, z, mode, shape, slope = np.array(points).T
            by = bend[mode.astype(int)]
            return np.column_stack((x - z * slope * by, z + shape * by))

        hinge = drawn["elevator"]["hinge"]
        angle = effector[1] + hinge[4] * bend[int(hinge[2])]
        deflect = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        roof, cowl = np.array(drawn["flame"]["roof"]), np.array(drawn["flame"]["cowl"])
        tip = 0.5 * (roof + cowl)
        tip[0] -= drawn["flame"]["length"] * max(effector[0], 0.0)
        parts = {
            "#d97706": bent([roof, tip, cowl]),
            "#94a3b8": bent(drawn["body"]),
            "#475569": bent(drawn["engine"]),
            "#b91c1c": bent([hinge]) + np.array(drawn["elevator"]["outline"]) @ deflect,
        }
        axes.clear()
        axes.set(xlim=(-half, half), ylim=(-0.625 * half, 0.625 * half))
        axes.set_axis_off()
        path = half * np.array([np.cos(pitch - alpha), np.sin(pitch - alpha)])
        axes.plot(*np.array([-path, path]).T, "--", color="#64748b", linewidth=1.0)
        for colour, points in parts.items():
            axes.fill(*(points @ turn).T, color=colour)
        words = f"{time:.2f} s   {altitude:.0f} m   {velocity:.1f} m/s"
        words += f"   angle of attack {np.degrees(alpha):.2f} deg   elevator {np.degrees(effector[1]):.2f} deg"
        axes.text(0.02, 0.03, words, transform=axes.transAxes, fontsize=9)
        self.figure.canvas.draw()
        if self._pixels is None:
            self.figure.show()
            self.figure.canvas.flush_events()
            return None
        return np.asarray(self._pixels.buffer_rgba())[..., :3].copy()


def _outline(frame: Airframe, corners: list[Point]) -> list[list[float]]:
    points = []
    for (x0, z0), (x1, z1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        steps = max(1, int(np.ceil(abs(x1 - x0) / SPACING)))
        for along in np.arange(steps) / steps:
            points.append(_point(frame, x0 + along * (x1 - x0), z0 + along * (z1 - z0)))
    return points


def _point(frame: Airframe, x: float, z: float) -> list[float]:
    x, z, shape, slope = (float(f"{number:.7g}") for number in (x, z, frame.shape(x), frame.shape(x, 1)))
    return [x, z, frame.mode(x), shape, slope]
