"""Free flight: what moves the bob while the string is slack."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from toolkit.effects import load_effect
from toolkit.motion.symbols import number_functions, symbols

if TYPE_CHECKING:
    from toolkit.motion.equation import Equation


Acceleration = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
"""(time, position, velocity), each (right, up) from the pivot -> acceleration in m/s²."""


@dataclass(frozen=True)
class Flight:
    """The downward pull in m/s², and the whole acceleration where there is more."""

    g_m_per_s2: float
    acceleration: Acceleration | None = None


def free_flight(equation: Equation, parameters: Mapping[str, float]) -> Flight:
    """Gravity less buoyancy, drag, and the shaking of the frame, as the equation's effects have them."""
    values = dict(zip(equation.parameters, equation.values(parameters)))
    mass, g, length = (values[n] for n in ("mass_kg", "g_m_per_s2", "length_m"))
    drags = [effect for effect, term in equation.sampled_terms if not isinstance(term.drag, int)]
    names = {e.name for e in equation.effects}
    moving = [e for e in equation.effects if e.pivot is not None]
    displaced = carried = 0.0
    if names & {"buoyancy", "added_mass"}:
        displaced = 4 / 3 * math.pi * values["bob_radius_m"] ** 3 * values["fluid_density_kg_per_m3"]
    functions = number_functions()
    state = {"t": 0.0, "theta": 0.0, "omega": 0.0}
    if "added_mass" in names:
        at_rest = symbols(functions, state, values, equation.effects, False, equation.formula_text)
        carried = float(load_effect("added_mass").term(at_rest["added_mass"]).inertia) / length**2
    inertia = mass + carried
    weight = (mass - (displaced if "buoyancy" in names else 0.0)) / inertia
    if not drags and not moving:
        return Flight(g * weight, None)

    def acceleration(t: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        seen = symbols(functions, {**state, "t": t}, values, equation.effects, False, equation.formula_text)
        pivot = seen[""].pivot
        against = velocity + np.array(pivot.velocity) if pivot is not None else velocity
        speed = float(np.hypot(*against))
        drag = sum(float(e.term(seen[e.name].of({"speed": speed, "velocity": speed})).drag) for e in drags)
        total = np.array([0.0, -g * weight]) - drag / inertia * against
        return total - np.array(pivot.acceleration) if pivot is not None else total

    return Flight(g * weight, acceleration)
