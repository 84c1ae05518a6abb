"""Drag in proportion to the bob's velocity: F = −k_d v (α_d = k_d/(2m))."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    return Term(drag=s.k_d_kg_per_s)


EFFECT = Effect(
    name="linear_drag",
    meaning="drag in proportion to the bob's velocity, F = −k_d v",
    term=_term,
    parameters=(Parameter("k_d_kg_per_s", "kg/s", "drag coefficient k_d", symbol="k_d"),),
    needs=("mass_kg",),
    valid="viscous flow around the bob (Re < 1), oil, or a magnet; a lab bob in air reaches Re = 130 … 20 000",
    reference="Stokes 1851; Wanaek & Hutem 2023, eq. (5)",
    linear=True,
    dissipative=True,
)
