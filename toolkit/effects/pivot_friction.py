"""Dry (Coulomb) friction at the pivot: a constant torque against the motion, which can hold the pendulum still."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term


def _term(s: Any) -> Term:
    return Term(torque=-s.torque_n_m * s.sign(s.omega))


EFFECT = Effect(
    name="pivot_friction",
    meaning="dry friction at the pivot: a constant torque τ against the motion; at rest it holds up to τ",
    term=_term,
    parameters=(Parameter("torque_n_m", "N m", "torque τ", symbol=r"\tau"),),
    needs=("mass_kg",),
    valid="static and sliding friction equal, load on the pivot constant",
    reference="Coulomb 1785; turning points obey cos a − cos A = μ(A + a), μ = τ/(mgℓ)",
    dissipative=True,
)
