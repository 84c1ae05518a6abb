"""Frames that a camera lost again and again, counted anew about the motion as the camera saw it: a slant, a swing out of the
plane and a rolling shutter move a bob that turns by as much as it moves there in several frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.least_squares import Minimum, least_squares
from toolkit.tracking.geometry.swing import small_steps
from toolkit.tracking.geometry.view import AT, NAMES, View
from toolkit.tracking.geometry.view_fit import PRIOR

_FIT_PX = 0.3  # a place's σ where lost frames are still to be counted: more than its own
_ROUNDS = 60
_MOST = 1000  # frames; more would take too long
_LEFT_PX = 0.15  # a count that is wrong where the bob moves leaves more (rms)
_FREE = [AT[name] for name in NAMES if name not in ("off_x", "off_y")]


def count_as_seen(
    places: Places, lost: np.ndarray, start: np.ndarray, size_px: tuple[int, int], rows_along_x: bool = False
) -> np.ndarray | None:
    """How many frames were lost before each, (n,) int never falling, from a count (n,) that is wrong in places and a motion (9,)
    at the first good place. None where no count explains the places.

    In turns: the view of the times counted, and of all ways to lose one more or one less at one place or at two the one
    that leaves least once the view has given way to it, as far as that is linear.
    """
    seen = np.flatnonzero(places.good)
    if seen.size > _MOST:
        return None
    usual = float(np.median(np.diff(places.t_s)))
    values = np.concatenate([start, [1.0], np.zeros(len(NAMES) - 10)])
    values[AT["log_nearness"]] = PRIOR["log_nearness"][0]
    values[AT["sway_cos"]] = PRIOR["sway_cos"][1]  # in the plane there is no slope out of it
    best, (least, moved) = lost, _seen(places, seen, lost, usual, values, size_px, rows_along_x)
    for _ in range(_ROUNDS):
        if least is None:
            return None
        for more in _changes(least, moved, np.diff(best[seen], prepend=best[seen[0]])):
            change = np.zeros_like(lost)
            change[seen] = more
            trial = np.minimum.accumulate((best + np.cumsum(change))[::-1])[::-1]  # nor does it fall between those seen
            found = _seen(places, seen, trial, usual, least.values, size_px, rows_along_x)
            if found[0] is not None and found[0].chi2 < least.chi2:
                best, (least, moved) = trial, found
                break
        else:
            break
    if least is None:
        return None
    strays_px = _FIT_PX * np.sqrt(np.mean(least.rest[: 2 * seen.size] ** 2))
    return best if strays_px < _LEFT_PX else None


def _seen(
    places: Places,
    seen: np.ndarray,
    lost: np.ndarray,
    usual_s: float,
    start: np.ndarray,
    size_px: tuple[int, int],
    rows_along_x: bool,
) -> tuple[Minimum | None, np.ndarray]:
    """The view that fits the places `seen` best at the times counted, and how its residuals change, and the values give
    way, as all from one place on come a frame later: (r, k) with what the values can take of it taken away."""
    t, x, y = (places.t_s + usual_s * lost)[seen], places.x_px[seen], places.y_px[seen]
    none = np.zeros(0)
    middle = (size_px[0] - 1) / 2, (size_px[1] - 1) / 2
    model = View(start, none, none, none, (), middle, float(t[0]), 1.0, rows_along_x)
    tied = [(AT[name], *pair) for name, pair in PRIOR.items()]

    def rest(values: np.ndarray, later_s: float = 0.0) -> np.ndarray:
        mx, my = replace(model, values=values).position(t + later_s, x, y)
        pulls = [(values[i] - value) / sigma for i, value, sigma in tied]
        return np.concatenate([(mx - x) / _FIT_PX, (my - y) / _FIT_PX, pulls])

    steps = np.full(len(NAMES), 1e-5)
    steps[:9] = small_steps(start[:9])

    def slopes(values: np.ndarray) -> np.ndarray:
        here = rest(values)
        return np.array([(rest(values + steps * (np.arange(steps.size) == i)) - here) / steps[i] for i in _FREE]).T

    least = least_squares(rest, start, steps, _FREE, turns=15, slopes=slopes)
    if least is None:
        return None, none
    later = 0.5 * (rest(least.values, usual_s) - rest(least.values, -usual_s))
    after = np.tri(t.size)
    moved = np.concatenate(
        [after * later[: t.size, None], after * later[t.size : 2 * t.size, None], np.zeros((len(tied), t.size))]
    )
    own = np.linalg.qr(slopes(least.values))[0]
    return least, moved - own @ (own.T @ moved)


def _changes(found: Minimum, moved: np.ndarray, losses: np.ndarray) -> list[np.ndarray]:
    """By how many frames more (k,) are to be lost right before each place for less χ², as far as it is linear: the best of one more,
    one less, two more, two less, and one moved; the best of these first."""
    pull, together = moved.T @ found.rest, moved.T @ moved
    alone = np.diag(together)
    first = np.arange(losses.size) > 0
    can = {1: first, 0: first, -1: first & (losses > 0)}
    changes: list[tuple[float, np.ndarray]] = []
    for a, b in ((1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1)):
        chi2 = (alone + 2 * a * pull)[:, None] + (b * b * alone + 2 * b * pull + 2 * a * b * together)
        chi2[~can[a]] = np.inf
        chi2[:, ~can[b]] = np.inf
        if b:
            np.fill_diagonal(chi2, np.inf)
        k, m = np.unravel_index(int(np.argmin(chi2)), chi2.shape)
        if chi2[k, m] < 0:
            change = np.zeros(losses.size, int)
            change[k] += a
            change[m] += b
            changes.append((float(chi2[k, m]), change))
    return [change for _, change in sorted(changes, key=lambda c: c[0])]
