"""Does the string stay taut? On a string the tension m(g cos θ + ℓ θ̇²) must stay positive; a rod can push."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import Evidence, omega_g_of
from toolkit.checks.finding import FAILS, HOLDS, Finding


def check(evidence: Evidence) -> Finding | None:
    """`fails` where the fitted motion would need a push; None where the swing stays below the horizontal, since a string
    cannot go slack there."""
    best = evidence.best
    if not best.success or float(np.max(evidence.amplitude())) < math.pi / 2:
        return None
    offset = best.parameters["theta_offset"].value if "theta_offset" in best.parameters else 0.0
    ratio = np.cos(best.theta_rad - offset) + (best.omega_rad_per_s / omega_g_of(best)) ** 2
    least = float(np.min(ratio))
    t = evidence.series.t_s
    slack = ratio < 0
    values = {"tension_over_weight": least, "amplitude_max_rad": float(np.max(evidence.amplitude()))}
    if not slack.any():
        return Finding(
            "taut_string",
            HOLDS,
            evidence=values,
            sentence=f"The string stays taut: its tension never falls below {least:.2g} of the weight.",
            words_key="taut_string.holds",
            words_values=values,
        )
    where = {"t_start_s": float(t[slack][0]), "t_stop_s": float(t[slack][-1]), "amplitude_above_rad": math.pi / 2}
    share = float(np.mean(slack))
    return Finding(
        "taut_string",
        FAILS,
        where=where,
        evidence={**values, "slack_share": share},
        sentence=(
            f"A string would be slack on {100 * share:.2g} % of the points (first at {where['t_start_s']:.3g} s): the motion needs a "
            f"push of up to {-least:.2g} of the weight. With a rod this is no matter; with a string the model does not apply there."
        ),
        remedy="with a string, leave out the swings above the horizontal (--start), or name slack_string in the scene",
        words_key="taut_string.fails",
        words_values={**values, **where, "slack_share": share},
    )
