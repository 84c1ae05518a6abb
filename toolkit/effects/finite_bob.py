"""A bob that is not a point: a solid sphere that turns with the string."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Term


def _term(s: Any) -> Term:
    return Term(inertia=2 / 5 * s.mass_kg * s.bob_radius_m**2)


EFFECT = Effect(
    name="finite_bob",
    meaning="moment of inertia of a solid spherical bob fixed to the string",
    term=_term,
    needs=("mass_kg", "bob_radius_m"),
    valid="bob fixed to the string (one that can rock adds 2/25 (r/ℓ)³ to the period)",
    reference="parallel-axis theorem; period longer by r²/(5ℓ²)",
    linear=True,
)
