"""A uniform string that has a mass."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    weight_arm = s.string_mass_kg * s.g_m_per_s2 * s.length_m / 2
    return Term(
        inertia=s.string_mass_kg * s.length_m**2 / 3,
        torque=-weight_arm * s.sin_theta,
        energy=weight_arm * s.rise,
    )


EFFECT = Effect(
    name="string_mass",
    meaning="mass of a uniform straight string from the pivot to the bob's centre",
    term=_term,
    parameters=(Parameter("string_mass_kg", "kg", "mass of the string", symbol="m_s"),),
    needs=("mass_kg",),
    valid="string straight; the tension given is the one at the bob",
    reference="rigid-body pendulum; period shorter by m_s/(12m)",
    linear=True,
)
