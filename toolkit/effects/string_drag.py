"""Drag of the air on the string, a thin cylinder whose parts move at different speeds."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    # ∫₀^s ½ρ d C_D (xω)² x dx with C_D = 1 + 10 Re^(−2/3), Re = ρ d x|ω|/μ; the string ends at the bob's surface, s = ℓ − r
    end = s.length_m - s.bob_radius_m
    density, diameter, rate = s.fluid_density_kg_per_m3, s.diameter_m, s.abs(s.omega)
    slow = (density * diameter / s.fluid_viscosity_pa_s) ** (-2 / 3)
    inner = end**4 * rate / 4 + 3 * slow * end ** (10 / 3) * rate ** (1 / 3)
    return Term(torque=-0.5 * density * diameter * inner * s.omega)


EFFECT = Effect(
    name="string_drag",
    meaning="air drag on the string, with the drag coefficient of a cylinder at its local speed",
    term=_term,
    parameters=(Parameter("diameter_m", "m", "diameter of the string", maximum=0.1, symbol="d"),),
    needs=("mass_kg", "bob_radius_m", "fluid_density_kg_per_m3", "fluid_viscosity_pa_s"),
    valid="1 < Re < 1e5 at the string's own diameter; at rest in the fluid, pivot not moving",
    reference="White, Viscous Fluid Flow: C_D = 1 + 10 Re^(−2/3); Mohazzabi & Shankar 2017",
    dissipative=True,
)
