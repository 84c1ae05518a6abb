"""Are the times right? Uneven steps and repeated frames are seen in the record itself; a jump of the clock or a change of
the frame rate shows as a shift of all later swings against the best model."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import Evidence
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding

_CLEAR = 30.0
_PLACES = 80
_SHARE = 0.3


def check(evidence: Evidence) -> Finding | None:
    """`fails` for repeated frames, for a shift in time of at least a tenth of a frame from some moment on, or for a change
    of rate of more than 0.05 % there, each beyond chance."""
    best = evidence.best
    if not best.success or len(evidence.series) < 40:
        return None
    t = evidence.series.t_s
    step = float(np.median(np.diff(t)))
    repeated = _repeated(evidence)
    omega = best.omega_rad_per_s
    places = evidence.places(_PLACES)
    jump, bend = evidence.clock_gains(places)
    kind = "jump" if jump.max() >= bend.max() else "rate"
    place = float(places[np.argmax(jump if kind == "jump" else bend)])
    after = t >= place
    column = omega * after if kind == "jump" else omega * np.where(after, t - place, 0.0)
    found = evidence.added(column[:, None])
    size = float(found.coefficients[0])
    excess = float(np.sum((best.residuals_rad / evidence.sigma_rad) ** 2))
    taken = max(jump.max(), bend.max()) / excess if excess > 0 else 0.0
    uneven = float(np.max(np.diff(t)) / step)
    numbers = {
        "delta_chi2": found.delta_chi2,
        "jump_s" if kind == "jump" else "rate_change_relative": size,
        "share_of_residuals": taken,
        "repeated_frames": float(repeated.size),
        "largest_step_over_median": uneven,
    }
    large = abs(size) > (0.1 * step if kind == "jump" else 5e-4)
    if repeated.size >= max(2, 0.002 * len(evidence.series)):
        return Finding(
            "clock",
            FAILS,
            where={"t_start_s": float(t[repeated[0]]), "t_stop_s": float(t[repeated[-1]])},
            evidence=numbers,
            sentence=(
                f"{repeated.size} frames repeat the one before although the bob was moving (first at {t[repeated[0]]:.3f} s): "
                "the video was converted to another frame rate."
            ),
            remedy="use the camera's own file, or leave the repeated frames out",
            words_key="clock.repeated",
            words_values={"frames": int(repeated.size), "t_start_s": float(t[repeated[0]])},
        )
    rival = evidence.scale_gain()  # angles out of scale look like a slow change of rate
    numbers["delta_chi2_angle_scale_over_clock"] = rival / max(jump.max(), bend.max(), 1e-300)
    leads = rival < max(jump.max(), bend.max())
    if found.delta_chi2 > _CLEAR and large and leads and (taken > _SHARE or bool(best.noise["white"])):
        sentence = (
            f"At {place:.2f} s the clock jumps by {1000 * size:.3g} ms ({size / step:.2g} frames): all later swings are shifted."
            if kind == "jump"
            else f"From {place:.2f} s on the clock runs {100 * size:.2g} % differently: the frame rate changed."
        )
        return Finding(
            "clock",
            FAILS,
            where={"t_start_s": place},
            evidence=numbers,
            sentence=sentence,
            remedy="film with a fixed frame rate; fit the part before or after alone (--start, --stop)",
            strength_sigma=math.sqrt(found.delta_chi2),
            words_key="clock.jump" if kind == "jump" else "clock.rate",
            words_values={"t_start_s": place, "jump_s" if kind == "jump" else "rate_change": size},
        )
    if found.delta_chi2 > _CLEAR and large and leads:
        return Finding(
            "clock",
            NOT_DISTINGUISHABLE,
            evidence=numbers,
            sentence=(
                f"A change of the clock at {place:.2f} s would improve the fit, but it explains only {100 * taken:.0f} % of what the "
                "model leaves over: something else is missing too."
            ),
            remedy="film with a fixed frame rate and look at the residuals against time",
            words_key="clock.not_distinguishable",
            words_values={"t_start_s": place, "share": taken},
        )
    return Finding(
        "clock",
        HOLDS,
        evidence=numbers,
        sentence="The times are even enough: no repeated frame and no jump of the clock is seen.",
        words_key="clock.holds",
    )


def _repeated(evidence: Evidence) -> np.ndarray:
    """Indices of points that repeat the angle before to the last digit while the bob moved by many error bars."""
    theta = evidence.series.theta_rad
    moved = np.abs(np.diff(evidence.best.theta_rad))
    same = np.diff(theta) == 0
    digits = float(np.median(np.abs(np.diff(theta))[~same])) if (~same).any() else 0.0
    coarse = np.unique(theta).size < 0.5 * theta.size  # a quantised angle repeats for another reason
    far = moved > np.maximum(6 * evidence.sigma_rad[1:], 0.3 * digits)
    return np.flatnonzero(same & far & (not coarse)) + 1
