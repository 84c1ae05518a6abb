"""The motion over the whole clip, from the motion that was followed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.tracking.begin.acquire import REMEDY
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import CALM, NAMES, Swing, fit_swing, start_swing

_LED = 0.1  # of the way across the picture: a motion that is no farther from the places leads there


def whole_swing(followed: Swing, places: Places, path: Path) -> Swing:
    """The motion over the whole clip, from the one followed (on the places' clock); where that does not lead there, from
    the places alone.

    Raises JobError where no pendulum's motion goes through the places.
    """
    t, x, y = places.t_s, places.x_px, places.y_px
    chosen = np.flatnonzero(places.good)
    swing = _grown(followed.values_at(t[chosen[0]]), t, x, y, chosen)
    if swing is None or swing.rms_px > 0.02 * places.extent_px:
        first = chosen[t[chosen] < t[chosen[0]] + 1.5 * followed.period_s]
        other = start_swing(t[first], x[first], y[first]) if first.size >= 12 else None
        anew = None if other is None else _grown(other, t, x, y, chosen)
        if anew is not None and (swing is None or anew.rms_px < swing.rms_px):
            swing = anew
    if swing is None:
        raise JobError(f"what moves in {path} does not swing like a pendulum; if there is one, {REMEDY}")
    return swing


def _grown(values: np.ndarray, t: np.ndarray, x: np.ndarray, y: np.ndarray, chosen: np.ndarray) -> Swing | None:
    """The motion through the `chosen` frames, fitted in growing pieces, at least as far as the last one's motion leads, so that no
    swing is lost count of."""
    swing: Swing | None = None
    period = 2 * np.pi / np.sqrt(max(values[4], 1e-9))
    stop = t[chosen[0]] + max(0.75 * period, 0.3)
    at_most = _LED * float(np.hypot(np.ptp(x[chosen]), np.ptp(y[chosen])))
    while True:
        mx, my = Swing(values, np.zeros((9, 9)), t[chosen[0]], 0.0).position(t[chosen])
        astray = chosen[~(np.hypot(mx - x[chosen], my - y[chosen]) < at_most)]
        stop = max(stop, t[astray[0]] if astray.size else t[-1])
        whole = stop >= t[-1]
        part = chosen[t[chosen] <= stop]
        if part.size >= 12:
            p = part[:: max(1, part.size // (1500 if whole else 150))]
            # damping seen over a second or so may be none, and leads nowhere later
            undamped = np.where([name in CALM for name in NAMES], 0.0, values)
            free = [(values, None)] if whole else []
            for start, prior in [*free, (values, CALM), (undamped, CALM)]:
                swing = fit_swing(t[p], x[p], y[p], np.full(p.size, 0.5), start, prior=prior)
                if swing is not None:
                    break
            if swing is None:
                return None
            values = swing.values
        if whole:
            return swing
        stop = t[chosen[0]] + 2 * (stop - t[chosen[0]])
