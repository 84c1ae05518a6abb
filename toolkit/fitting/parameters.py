"""The numbers that a fit reports: their names, units and order, and what they are in the reduced equation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolkit.fit import FittedParameter
    from toolkit.scene import Scene

UNITS = {
    "k_d": "kg/s",
    "alpha_d": "1/s",
    "c": "kg/m",
    "beta": "1",
    "torque": "N m",
    "mu": "1/s^2",
    "theta0": "rad",
    "phi": "rad",
    "omega_g": "rad/s",
    "length": "m",
    "theta_offset": "rad",
    "f0": "N",
    "f": "Hz",
    "drive_phase": "rad",
    "angle_scale": "1",
    "time_scale": "1",
    "row_time": "s",
}
DRAGS = ("k_d", "alpha_d", "c", "beta", "torque", "mu")
"""Those that take energy out: never below zero."""

NOT_GUESSED = ("theta_offset", "angle_scale", "time_scale", "row_time", "f0", "f", "drive_phase")
"""Those that start from what is known beforehand, not from the record."""

_FIRST = (*DRAGS, "theta0", "phi", "omega_g", "length", "theta_offset")


def reduce(
    values: Mapping[str, float], scene: Scene, shift_s: float
) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
    """Coefficients of the reduced equation, and name -> {coefficient: derivative} for each reported name.

    shift_s : the time of the drive's clock at which the motion's own begins.
    """
    mass, gravity = scene.pendulum.mass_kg, scene.environment.gravity_m_per_s2
    reduced = {"theta0": values["theta0"], "phi": values["phi"]}
    by: dict[str, dict[str, float]] = {"theta0": {"theta0": 1.0}, "phi": {"phi": 1.0}}
    length = values.get("length")
    if length is None:
        reduced["omega_g"] = values["omega_g"]
        by["omega_g"] = {"omega_g": 1.0}
    else:
        reduced["omega_g"] = math.sqrt(gravity / length) if length > 0 else math.nan
        by["length"] = {"omega_g": -reduced["omega_g"] / (2 * length)}
    m, el = mass or math.nan, length or math.nan
    table = {  # reported name: coefficient, factor, power of the length in the factor
        "alpha_d": ("alpha_d", 1.0, 0),
        "k_d": ("alpha_d", 1 / (2 * m), 0),
        "beta": ("beta", 1.0, 0),
        "c": ("beta", el / m, 1),
        "mu": ("mu", 1.0, 0),
        "torque": ("mu", 1 / (m * el**2), -2),
        "f0": ("drive", 1 / (m * el), -1),
        "f": ("f", 1.0, 0),
        "drive_phase": ("drive_phase", 1.0, 0),
    }
    for name, (coefficient, factor, power) in table.items():
        if name in values:
            reduced[coefficient] = factor * values[name]
            by[name] = {coefficient: factor}
            if power and "length" in by:
                by["length"][coefficient] = by["length"].get(coefficient, 0.0) + power * reduced[coefficient] / el
    if "drive_phase" in reduced:
        reduced["drive_phase"] += 2 * math.pi * reduced["f"] * shift_s
        by["f"]["drive_phase"] = 2 * math.pi * shift_s
    return reduced, by


def tidied(values: Mapping[str, float], small_angle: bool) -> dict[str, float]:
    """The same motion with θ₀ ≥ 0 (and ≤ π with the full sine) and −π < φ ≤ π."""
    tidy = dict(values)
    if not small_angle and not abs(tidy["theta0"]) <= math.pi:  # only sin(θ₀/2) counts
        tidy["theta0"] = 2 * math.asin(math.sin(tidy["theta0"] / 2))
    if tidy["theta0"] < 0:
        tidy["theta0"], tidy["phi"] = -tidy["theta0"], tidy["phi"] + math.pi
    if abs(tidy["phi"]) > math.pi:
        tidy["phi"] = math.remainder(tidy["phi"], 2 * math.pi)
    return tidy


def ordered(parameters: Mapping[str, FittedParameter]) -> dict[str, FittedParameter]:
    """Drags, start, frequency first, as every table has them."""
    first = [name for name in _FIRST if name in parameters]
    return {name: parameters[name] for name in [*first, *(n for n in parameters if n not in first)]}
