"""How a hand-held camera shook before a wall that shows nothing, told by the string.

The string's direction turns with the bob, but not as the camera is shifted: from the bob back along it by one length is where the
picture shows the pivot. What moves that place in step with the swing is the view (tilt, lens, a swing out of the plane),
what moves it otherwise is the hand. A roll of the camera turns the string too, and stays in the angles.
"""

from __future__ import annotations

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.view_fit import Lines

_MOST_SEEN = 0.7  # of the measured frames: a string seen on fewer tells too little
_LEAST_PX = 0.3  # less is no shake worth a string's noise
_OUT_OF_STEP = 0.3  # of what moves the pivot: where less is out of step with the swing, it is the view
_BESIDE_PX = 1.5  # what passes the bob farther off than usual is not its string
_STRAY = 5.0  # robust standard deviations: a line so far off is a post's or a passer-by's


def shake_on_string(places: Places, lines: Lines) -> tuple[np.ndarray, np.ndarray] | None:
    """By how much the camera's shake moved each place (n, 2) px, and the uncertainty of that (n,) px, from the string's lines
    (NaN where none was seen). None where the string is seen too seldom, or shows no shake."""
    t, measured = places.t_s, places.good & np.isfinite(lines.angle_rad)
    bob = np.column_stack([places.x_px, places.y_px])
    angle = lines.angle_rad
    string = np.column_stack([np.sin(angle), np.cos(angle)])
    passes = (bob[:, 0] - lines.x_px) * string[:, 1] - (bob[:, 1] - lines.y_px) * string[:, 0]  # the bob, by so much
    enough = max(30, _MOST_SEEN * int(places.good.sum()))
    used = measured
    for _ in range(10):
        if used.sum() < enough:
            return None
        swung, moved = (a - a[used].mean(axis=0) for a in (string, bob))
        length = float(np.sum(swung[used] * moved[used]) / np.sum(swung[used] ** 2))
        pivot = bob - length * string
        off = np.column_stack([passes, pivot])
        off -= np.median(off[used], axis=0)
        spread = _STRAY * 1.4826 * np.median(np.abs(off[used]), axis=0) + _LEAST_PX
        spread[0] = min(spread[0], _BESIDE_PX)
        before, used = used, measured & np.all(np.abs(off) < spread, axis=1)
        if np.array_equal(before, used):
            break
    if used.sum() < enough:
        return None
    pivot -= pivot[used].mean(axis=0)
    total = _size(pivot[used])
    noise = abs(length) * float(np.median(lines.sigma_rad[used]))
    hand = _size(_out_of_step(pivot[used], angle[used], t[used]))
    if hand < max(_LEAST_PX, 3 * noise, _OUT_OF_STEP * total):
        return None
    known = np.flatnonzero(used)
    shake = np.column_stack([np.interp(t, t[known], column) for column in pivot[known].T])
    rows = np.arange(t.size)
    after = known[np.clip(np.searchsorted(known, rows), 0, known.size - 1)]
    before = known[np.clip(np.searchsorted(known, rows, side="right") - 1, 0, known.size - 1)]
    apart = np.minimum(np.abs(after - rows), np.abs(rows - before))  # frames to one that shows it
    wandered = np.array([noise, *(min(_size(shake[k:] - shake[:-k]), total) for k in range(1, apart.max() + 1))])
    return shake, np.maximum(wandered[apart], noise)


def _size(moved: np.ndarray) -> float:
    """Root mean square length of vectors (n, 2), per axis."""
    return float(np.sqrt(0.5 * np.mean(np.sum(moved**2, axis=1))))


def _out_of_step(moved: np.ndarray, angle: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """What of a motion (n, 2) is no function of where in its slowly decaying swing the string is."""
    a = angle - angle.mean()
    b = np.gradient(a, t_s)
    b *= a.std() / max(float(b.std()), 1e-12)
    late = (t_s - t_s.mean()) / np.ptp(t_s)
    columns = np.column_stack([np.ones_like(a), a, b, a * a, a * b, b * b, a**3, late * a, late * b])
    return np.asarray(moved - columns @ np.linalg.lstsq(columns, moved, rcond=None)[0])
