"""The fluid that an oscillating sphere carries along: inertia, and the viscous part of it."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    radius, density, viscosity = s.bob_radius_m, s.fluid_density_kg_per_m3, s.fluid_viscosity_pa_s
    layer = s.sqrt(2 * viscosity / (density * s.sqrt(s.g_m_per_s2 / s.length_m)))  # δ = √(2ν/ω)
    displaced = 4 / 3 * s.pi * radius**3 * density
    carried = displaced * (1 / 2 + 9 / 4 * layer / radius)
    damping = 6 * s.pi * viscosity * radius * (1 + radius / layer) * s.viscous_damping
    return Term(
        inertia=carried * s.length_m**2,
        drag=damping,
        radial_force=carried * s.length_m * s.omega**2,
    )


EFFECT = Effect(
    name="added_mass",
    meaning="fluid carried along by an oscillating sphere: half the displaced mass, and Stokes' viscous layer",
    term=_term,
    parameters=(
        Parameter(
            "viscous_damping",
            "1",
            "share of the layer's damping (0 where another drag covers it)",
            1.0,
            0.0,
            1.0,
            "s_v",
        ),
    ),
    needs=("mass_kg", "bob_radius_m", "fluid_density_kg_per_m3", "fluid_viscosity_pa_s"),
    valid="swing shorter than about the bob's diameter for the damping; the inertia holds for larger swings too",
    reference="Stokes 1851; Landau & Lifshitz, Fluid Mechanics, § 24",
    linear=True,
    dissipative=True,
)
