"""A pivot that is shaken along a line, sinusoidally."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, PivotMotion, Term


def _pivot(s: Any) -> PivotMotion:
    rate = 2 * s.pi * s.f_hz
    phase = rate * s.t + s.phase_rad
    speed = -s.amplitude_m * rate * s.sin(phase)
    acceleration = -s.amplitude_m * rate**2 * s.cos(phase)
    right, up = s.cos(s.direction_rad), s.sin(s.direction_rad)
    return PivotMotion((speed * right, speed * up), (acceleration * right, acceleration * up))


def _term(s: Any) -> Term:
    right, up = _pivot(s).acceleration
    return Term(
        torque=-s.mass_kg * s.length_m * (right * s.cos_theta + up * s.sin_theta),
        radial_force=s.mass_kg * (up * s.cos_theta - right * s.sin_theta),
    )


EFFECT = Effect(
    name="moving_pivot",
    meaning="pivot moved by a·cos(2πft + phase) along a line; θ and the energy are seen from the pivot",
    term=_term,
    parameters=(
        Parameter("amplitude_m", "m", "amplitude a of the motion", symbol="a"),
        Parameter("f_hz", "Hz", "frequency of the motion", symbol="f_p"),
        Parameter("phase_rad", "rad", "phase of the motion at t = 0", 0.0, None, None, r"\varphi_p"),
        Parameter("direction_rad", "rad", "direction of the line: 0 to the right, π/2 up", 0.0, None, None, r"\chi"),
    ),
    needs=("mass_kg",),
    valid="any amplitude and frequency; the inertia of string and fluid is not shaken",
    reference="ℓθ'' + (g + Y'') sin θ + X'' cos θ = 0; Kapitza 1951",
    pivot=_pivot,
)
