"""How far the string pulls a bob from where it is: where it hides the outline, a circle is fitted to the rest, and where a lens, a
near camera or a rolling shutter makes that no circle, or one of another size, it lies beside the bob.

The pull was measured now and then as the bob was followed, on fits that see as little of it on the side opposite.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import Swing

_DEGREE = 4  # of the pull as a polynomial in the angle of swing; and in two terms it goes with the bob's speed
_ROUNDS, _STRAY = 3, 4.0  # robust standard deviations


def pulled_by_string(
    pulls: Mapping[int, tuple[float, float]], swing: Swing, places: Places
) -> tuple[np.ndarray, np.ndarray]:
    """How far beside the bob's centre it was found on each frame, (n,) px each, from what was measured on some; 0 where it was
    not seen. Drawn in towards none as far as chance could have made it."""
    x_off, y_off = np.zeros(places.t_s.size), np.zeros(places.t_s.size)
    rows = np.array([k for k, off in pulls.items() if places.good[k] and np.isfinite(off).all()], int)
    theta, rate = swing.angle(places.t_s)
    a, b = theta / np.abs(theta).max(), rate / np.abs(rate).max()
    terms = np.column_stack([np.vander(a, _DEGREE + 1), b, a * b])
    count = terms.shape[1]
    if rows.size < 3 * count:
        return x_off, y_off
    for off, found in zip((x_off, y_off), np.array([pulls[k] for k in rows.tolist()]).T):
        used = np.ones(rows.size, bool)
        for _ in range(_ROUNDS):
            fitted = terms @ np.linalg.lstsq(terms[rows[used]], found[used], rcond=None)[0]
            left = found - fitted[rows]
            used = np.abs(left) <= _STRAY * 1.4826 * np.median(np.abs(left)) + 1e-9
        noise = float(np.sum(left[used] ** 2)) / (int(used.sum()) - count)
        told = float(np.sum(fitted[rows[used]] ** 2)) / max(noise, 1e-12)
        off[places.good] = fitted[places.good] * max(0.0, 1 - count / max(told, 1e-12))
    return x_off, y_off
