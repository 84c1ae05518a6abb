"""Buoyancy of the bob in the fluid around it."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Term


def _term(s: Any) -> Term:
    weight = 4 / 3 * s.pi * s.bob_radius_m**3 * s.fluid_density_kg_per_m3 * s.g_m_per_s2
    return Term(
        torque=weight * s.length_m * s.sin_theta,
        radial_force=-weight * s.cos_theta,
        energy=-weight * s.length_m * s.rise,
    )


EFFECT = Effect(
    name="buoyancy",
    meaning="buoyancy of a spherical bob: the weight of the displaced fluid, upwards",
    term=_term,
    needs=("mass_kg", "bob_radius_m", "fluid_density_kg_per_m3"),
    valid="a fluid at rest; a bob that is denser than the fluid swings, a lighter one is driven upwards",
    reference="Archimedes; period longer by ρ_fluid/(2 ρ_bob)",
    linear=True,
)
