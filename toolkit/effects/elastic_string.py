"""A string that stretches with its tension, to first order in s = mg/(kℓ)."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    # The length follows the tension at once, which adds N²/(2k) to the Lagrangian, N = mℓω² − mg(1 − cos θ);
    # to first order in s the equation is θ'' = −(g/ℓ) sin θ [1 − s(7ℓω²/g + cos θ − 1)], whose period is longer by 11/16 s A²
    spin = s.length_m * s.omega**2 / s.g_m_per_s2
    soft = (s.mass_kg * s.g_m_per_s2) ** 2 / s.stiffness_n_per_m
    return Term(
        torque=soft * s.sin_theta * (7 * spin - s.rise),
        energy=soft / 2 * (spin - s.rise) * (3 * spin + s.rise),
    )


EFFECT = Effect(
    name="elastic_string",
    meaning="slight stretch of the string with its tension; length_m is the loaded length at rest",
    term=_term,
    parameters=(Parameter("stiffness_n_per_m", "N/m", "stiffness k = EA/ℓ of the string", None, 1e-9, None, "k"),),
    needs=("mass_kg",),
    valid="mg/(kℓ) up to 0.05 (nylon 0.01): far from the 2:1 resonance with the bounce at 0.25",
    reference="first order in mg/(kℓ); period longer by (11/16) (mg/kℓ) A²",
)
