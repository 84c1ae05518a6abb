"""A force along the path of the bob that is a cosine of time: f₀ cos(2πft + phase)."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Harmonic, Parameter, Term


def _term(s: Any) -> Term:
    return Term(harmonic=Harmonic(s.f0_n * s.length_m, s.f_hz, s.phase_rad))


EFFECT = Effect(
    name="cosine_drive",
    meaning="a tangential force f₀ cos(2πft + phase)",
    term=_term,
    parameters=(
        Parameter("f0_n", "N", "amplitude of the force", minimum=None, symbol="f_0"),
        Parameter("f_hz", "Hz", "frequency of the force", symbol="f"),
        Parameter("phase_rad", "rad", "phase of the force at t = 0", 0.0, None, None, r"\varphi_f"),
    ),
    needs=("mass_kg",),
    valid="any; the force follows the bob's direction of motion, so the tension does not see it",
    reference="Wanaek & Hutem 2023, eq. (5)",
    linear=True,
)
