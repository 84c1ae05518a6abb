"""Drag in proportion to the square of the bob's speed: F = −c |v| v."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    return Term(drag=s.c_kg_per_m * s.speed)


EFFECT = Effect(
    name="quadratic_drag",
    meaning="drag in proportion to the square of the bob's speed, F = −c |v| v",
    term=_term,
    parameters=(Parameter("c_kg_per_m", "kg/m", "drag coefficient c = ½ ρ C_D π r²", symbol="c"),),
    needs=("mass_kg",),
    valid="Re from 1e3 to 2e5, where C_D of a sphere is nearly constant (0.39 … 0.5)",
    reference="Newton, Principia II; Clift, Grace & Weber 1978",
    dissipative=True,
)
