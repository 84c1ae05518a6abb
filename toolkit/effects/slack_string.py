"""A string that can go slack: where the tension would be negative, the bob flies free until the string is taut."""

from __future__ import annotations

from typing import Any

from toolkit.effects.effect import Effect, Term


def _term(s: Any) -> Term:
    return Term()  # adds nothing to the swing itself: `simulate` watches the tension


EFFECT = Effect(
    name="slack_string",
    meaning="string, not rod: goes slack where T < 0, free flight, and the radial velocity is lost when it tightens",
    term=_term,
    needs=("mass_kg",),
    valid="a light string that does not rebound",
    reference="from rest it needs more than 90°; from the bottom 2gℓ < v² < 5gℓ",
)
