"""Finding: what a check of one assumption returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

HOLDS, FAILS, NOT_DISTINGUISHABLE = "holds", "fails", "not_distinguishable"


@dataclass(frozen=True)
class Finding:
    """A verdict on one assumption.

    assumption : `small_angle`, `linear_drag` …    verdict : holds | fails | not_distinguishable.
    where : in which part it fails, with units in the keys (`amplitude_above_rad`, `t_start_s`, `t_stop_s` …).
    evidence : the numbers that decide (`delta_chi2`, `delta_aic`, `p_value` …).
    sentence : English, for a student.    remedy : what to do about it ("" where nothing is needed).
    strength_sigma : how strongly, as a number of standard deviations, where that makes sense.
    words_key, words_values : with which the report writes the same sentence in another language.
    """

    assumption: str
    verdict: str
    where: Mapping[str, float] = field(default_factory=dict)
    evidence: Mapping[str, float] = field(default_factory=dict)
    sentence: str = ""
    remedy: str = ""
    strength_sigma: float | None = None
    words_key: str = ""
    words_values: Mapping[str, Any] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import finding_html

        return finding_html(self)
