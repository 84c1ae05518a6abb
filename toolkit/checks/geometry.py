"""Is the camera square to the plane of the swing? Angles that are all too large or too small by a factor show in how the
period depends on amplitude, which the full sine fixes; and the video's two pivots (arc, string) must agree."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import Evidence
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding

_CLEAR = 16.0
_SMALLEST_SCALE = 0.005
_USEFUL_U = 0.05
_PLACES = 50


def check(evidence: Evidence) -> Finding | None:
    """`fails` where all angles would have to be scaled by more than 0.5 % beyond chance (4 sigma), or where the calibration
    found that arc and string disagree; `not_distinguishable` where the record fixes the scale no better than 5 %."""
    best = evidence.best
    if not best.success or len(evidence.series) < 40:
        return None
    offset = best.parameters.get("theta_offset")
    vertical = offset.value if offset is not None else 0.0
    held = best.parameters.get("angle_scale")
    found = evidence.added((best.theta_rad - vertical)[:, None])
    scale, u, gain = float(found.coefficients[0]), float(found.sigmas[0]), found.delta_chi2
    if held is not None:  # already free within its prior: how far was it pulled?
        prior_u = float(best.problem.priors["angle_scale"][1]) if "angle_scale" in best.problem.priors else 0.0
        scale, u = held.value, held.stderr or prior_u
        gain = (scale / prior_u) ** 2 if prior_u else 0.0
    calibration = evidence.series.meta.get("calibration") or {}
    pivots = float(calibration.get("pivot_disagreement_sigma", 0.0))
    numbers = {
        "angle_scale": scale,
        "angle_scale_u": u,
        "delta_chi2": gain,
        "vertical_rad": vertical,
        "pivot_disagreement_sigma": pivots,
    }
    values = {"scale": scale, "scale_u": u, "pivots_sigma": pivots}
    if pivots > 4:
        return Finding(
            "geometry",
            FAILS,
            evidence=numbers,
            sentence=(
                f"The pivot from the bob's arc and the one from the string's lines differ by {pivots:.0f} sigma: the camera was tilted, "
                "its lens distorts, or the bob swung out of the plane."
            ),
            remedy="film from farther away, square to the swing, with the pivot in the picture",
            strength_sigma=pivots,
            words_key="geometry.pivots",
            words_values=values,
        )
    clock = max(float(np.max(g)) for g in evidence.clock_gains(evidence.places(_PLACES)))
    rival = clock > evidence.scale_gain()  # a clock that changes explains more: then `clock` says so
    if (
        gain > _CLEAR
        and not (rival and held is None)
        and abs(scale) > _SMALLEST_SCALE
        and (held is None or abs(scale) > 3 * u)
    ):
        too = "small" if scale < 0 else "large"
        return Finding(
            "geometry",
            FAILS,
            evidence=numbers,
            sentence=(
                f"The period changes with amplitude as if all angles were {100 * abs(scale):.2g} % too {too} "
                f"(± {100 * u:.1g} %): camera tilt, lens distortion, a wrong pivot or a swing out of the plane."
            ),
            remedy="film square to the swing; give the pivot; amplitude and quadratic drag are off by that much",
            strength_sigma=math.sqrt(gain),
            words_key="geometry.scale",
            words_values=values,
        )
    if rival and held is None and gain > _CLEAR and abs(scale) > _SMALLEST_SCALE:
        return Finding(
            "geometry",
            NOT_DISTINGUISHABLE,
            evidence=numbers,
            sentence=(
                f"The period does not change with amplitude as it should; angles out of scale by {100 * abs(scale):.2g} % would explain "
                "it, but a change of the clock explains it better: see there."
            ),
            remedy="film with a fixed frame rate, square to the swing",
            words_key="geometry.or_clock",
            words_values=values,
        )
    loose = min(max(u, abs(scale)), 9.99) if np.isfinite(u) else 9.99
    if loose > _USEFUL_U:
        return Finding(
            "geometry",
            NOT_DISTINGUISHABLE,
            evidence=numbers,
            sentence=f"This record fixes the scale of the angles only to {100 * loose:.2g} %: a tilted camera would not show.",
            remedy="start from a larger angle, or film square to the swing",
            words_key="geometry.not_distinguishable",
            words_values={**values, "scale_u": loose},
        )
    return Finding(
        "geometry",
        HOLDS,
        evidence=numbers,
        sentence=f"The period changes with amplitude as it should: angles are right to {100 * max(u, abs(scale)):.2g} %.",
        words_key="geometry.holds",
        words_values=values,
    )
