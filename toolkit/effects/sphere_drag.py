"""Drag of a sphere at any speed, from the drag coefficient C_D(Re) of Clift and Gauvin."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    # ½ρπr² C_D |v| v with C_D = 24/Re (1 + 0.152 Re^0.677) + 0.417/(1 + 5070 Re^−0.94) and Re = 2ρr|v|/μ,
    # written without a division by the speed, so that it is regular at the turning points
    radius = s.bob_radius_m
    per_speed = 2 * s.fluid_density_kg_per_m3 * radius / s.fluid_viscosity_pa_s
    re = per_speed * s.speed
    viscous = 6 * s.pi * s.fluid_viscosity_pa_s * radius * (1 + 0.152 * re**0.677)
    wake = s.pi / 2 * s.fluid_density_kg_per_m3 * radius**2 * 0.417 * s.speed * re**0.94 / (re**0.94 + 5070)
    return Term(drag=s.factor * (viscous + wake))


EFFECT = Effect(
    name="sphere_drag",
    meaning="drag of a smooth sphere at any speed, C_D(Re) of Clift and Gauvin",
    term=_term,
    parameters=(
        Parameter("factor", "1", "multiplies the whole drag (1: as the correlation gives it)", default=1.0, symbol="k"),
    ),
    needs=("mass_kg", "bob_radius_m", "fluid_density_kg_per_m3", "fluid_viscosity_pa_s"),
    valid="0 < Re < 2e5, steady flow (swing many radii long: π ℓ A / r > 10); correlations differ by 3–12 %",
    reference="Clift & Gauvin 1970, as in Barati et al. 2014",
    dissipative=True,
)
