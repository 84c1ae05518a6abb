"""Is what was followed a pendulum, and how good a one?"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.tracking.begin.acquire import REMEDY
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import Swing

_POOR_PICTURE = 0.12  # of the contrast
_UNLIKE = 0.25  # of the contrast: with more left unexplained the picture does not speak for a bob
_STRAYS_PX = 0.1  # less does not stray, whatever its error bar
_STRAYS = 0.04  # of the bob's radius: more does
_ROLLS = 0.1  # of the bob's radius: what strays less may be the roll of a camera that a hand is known to hold
_ENDLESS = 20  # so many times longer than the clip, half a period is no swing
STRAIGHT = 20  # diagonals of the picture: a pivot farther off is none
_STRETCH = 3.0  # periods
_UNEVEN_PX = 0.15  # by so much the places of an uneven bob may stray, unmentioned


def require_pendulum(swing: Swing, places: Places, size_px: tuple[int, int], path: Path, misfit: float = 0.0) -> None:
    """Raises JobError where what was followed in a picture of `size_px` does not move like a pendulum. `misfit` is the share of its
    contrast that is not explained: what does not look like a bob either has to swing the better."""
    t, good, extent = places.t_s, places.good, places.extent_px
    span = float(t[good][-1] - t[good][0])
    half = 0.5 * swing.period_s
    if half / _ENDLESS < span < half:
        raise JobError(f"{path} shows {span:.2f} s, less than half a period ({half:.2f} s); film at least one period")
    theta = np.abs(swing.angle(t)[0])
    reasons = []
    if swing.values[4] <= 0:
        reasons.append("nothing pulls it back")
    # what was not fitted, at the ends, need not be a swing, but no motion of a pendulum goes beyond all numbers there
    if span <= half / _ENDLESS or not (0 < theta[good].max() < np.pi and np.isfinite(theta).all()):
        reasons.append("it does not turn back")
    straight = swing.length_px > STRAIGHT * np.hypot(*size_px)
    clear = good.mean() > 0.95 and misfit < _UNLIKE
    shaky = 0.06 if clear else 0.04  # a hand-held camera before a plain wall: told as a warning
    strays = swing.rms_px > max(shaky * extent, 0.3)
    off = np.hypot(*(p[good] - m for p, m in zip((places.x_px, places.y_px), swing.position(t[good]))))
    mostly_px = float(np.median(off)) / 1.18  # a standard deviation per axis, whatever a repeated picture adds
    seldom = good.mean() < 0.6 and mostly_px > 0.015 * extent
    if (straight or strays or seldom) and swing.values[4] > 0 and _is_ellipse(swing, places):
        straight = strays = seldom = False
    if straight:
        reasons.append("it moves along a straight line")
    if strays:
        reasons.append(f"it strays {swing.rms_px:.1f} px from a swing of {extent:.0f} px")
    if seldom:
        reasons.append(f"it was seen on {good.mean():.0%} of the frames, straying {mostly_px:.1f} px")
    growth, growth_sigma = _growth(swing, t[good])
    if growth - 3 * growth_sigma > 0.5:
        reasons.append(f"its swing grows by {np.expm1(growth):.0%}")
    if reasons:
        raise JobError(f"what moves in {path} is no pendulum ({reasons[0]}); if there is one, {REMEDY}")


def _is_ellipse(swing: Swing, places: Places) -> bool:
    """Does it swing in an ellipse, which before a tilted camera is no arc? Told as a warning. Then a slowly changing ellipse
    with a little of its first overtone goes through the places of any few swings far more closely than the arc does."""
    t, points = places.t_s[places.good], np.column_stack([places.x_px, places.y_px])[places.good]
    rate, square, count, seen = 2 * np.pi / swing.period_s, 0.0, 0, 0
    edges = np.linspace(t[0], t[-1], 1 + max(1, round((t[-1] - t[0]) / (_STRETCH * swing.period_s))))
    for begin, end in pairwise(edges):
        part = (t >= begin) & ((t < end) | (end == t[-1]))
        late = t[part] - begin
        if part.sum() < 20 or np.ptp(late) < 1.5 * swing.period_s:
            continue
        least = np.inf
        for factor in np.linspace(0.88, 1.12, 25):
            phase = factor * rate * late
            c, s = np.cos(phase), np.sin(phase)
            waves = np.stack([np.ones_like(c), c, s, late * c, late * s, np.cos(2 * phase), np.sin(2 * phase)], axis=1)
            rest = points[part] - waves @ np.linalg.lstsq(waves, points[part], rcond=None)[0]
            least = min(least, float(np.sum(rest**2)))
        square, count, seen = square + least, count + 2 * (int(part.sum()) - 7), seen + 1
    rms_px = np.sqrt(square / count) if count else np.inf
    told = 0.5 * count + 7 * seen > 0.9 * t.size
    return bool(told and rms_px < min(0.25 * swing.rms_px, max(0.005 * places.extent_px, 0.3)))


def _growth(swing: Swing, t: np.ndarray) -> tuple[float, float]:
    """How much the amplitude grew from the first to the last time (natural logarithm), and its standard uncertainty."""
    ends = np.array([t[0], t[-1]])

    def grown(values: np.ndarray) -> float:
        theta, rate = Swing(values, swing.covariance, swing.t0_s, swing.rms_px).angle(ends)
        with np.errstate(all="ignore"):  # of a motion beyond all numbers the growth is none
            energy = 0.5 * rate**2 + values[4] * (1 - np.cos(theta))
        return 0.5 * float(np.log(max(energy[1], 1e-12) / max(energy[0], 1e-12)))

    now = grown(swing.values)
    sigma = np.sqrt(np.diag(swing.covariance))
    slope = np.zeros(sigma.size)
    for i in range(4, 9):
        moved = swing.values.copy()
        moved[i] += 0.1 * sigma[i]
        slope[i] = (grown(moved) - now) / (0.1 * sigma[i]) if sigma[i] > 0 else 0.0
    return now, float(np.sqrt(max(slope @ swing.covariance @ slope, 0.0)))


def poor_motion(
    swing: Swing,
    t: np.ndarray,
    good: np.ndarray,
    rms_px: float,
    sigma_px: float,
    radius_px: float,
    held: bool = False,
) -> list[str]:
    """Sentences on a motion that was accepted, but is not quite that of a pendulum; `rms_px` is how far places stray from
    it as the camera saw it, `sigma_px` a place's error bar. `held` if the string shows that a hand holds the camera."""
    poor: list[str] = []
    growth, sigma = _growth(swing, t[good])
    if growth > 0.02 + 4 * sigma:
        poor.append(
            said(
                "track.grows",
                "the swing grows by {share:.1%}: it is driven, or swings towards the camera by turns; a free decay does not "
                "describe it",
                share=float(np.expm1(growth)),
            )
        )
    if rms_px > max(_STRAYS_PX, min(3 * sigma_px, (_ROLLS if held else _STRAYS) * radius_px)):
        poor.append(
            said(
                "track.strays",
                "the bob's places stray {rms_px:.2f} px (rms) from a pendulum's swing, whatever tilt and lens the camera had: the "
                "camera shook, the pendulum was driven or touched, or the bob was not followed well",
                rms_px=rms_px,
            )
        )
    if good.mean() < 0.7:
        share = float(good.mean())
        poor.append(said("track.few", "the bob was measured on only {share:.0%} of the frames", share=share))
    return poor


def poor_picture(misfit: float, even: bool, off_px: float, rms_px: float) -> list[str]:
    """A sentence on a bob that is no even disc: `misfit` is the share of its contrast that is not explained, `off_px` by how
    much its centre may be off for that on all frames, `rms_px` by how much it strays. An uneven bob whose outline was
    followed as well as another's is not mentioned."""
    if misfit <= _POOR_PICTURE and (even or rms_px <= _UNEVEN_PX):
        return []
    off_px = max(off_px, rms_px)
    return [
        said(
            "track.poor_picture",
            "the bob does not look like an even disc (a pattern, a highlight or a shadow: {share:.0%} of its contrast is not "
            "explained); its centre may be off by about {off_px:.1f} px, much of it the same on all frames",
            share=misfit,
            off_px=off_px,
        )
    ]
