"""Looks at the bob in a few spots: against plain NumPy."""

import numpy as np
import pytest

from toolkit.trackers.localiser import Patch
from toolkit.tracking.picture.front import WITHIN
from toolkit.tracking.picture.spots import tell_bob


@pytest.mark.parametrize(("x", "y"), [(70.3, 55.8), (41.0, 55.8), (42.2, 30.4)])
def test_spots_are_those_that_numpy_looks_at(x: float, y: float):
    rng = np.random.default_rng(12)
    still = rng.uniform(0, 250, (120, 150)).astype(np.float32)
    image = np.where(rng.random(still.shape) < 0.5, 1.1 * 90, 1.1 * still).astype(np.float32)
    front = rng.random(still.shape) < 0.2
    part = np.s_[30:95, 40:111]
    patch = Patch(image[part], still[part], still[part], 40.0, 30.0)

    def seen(picture: np.ndarray, offsets: np.ndarray, reach: float) -> np.ndarray:
        u, v = np.rint(reach * offsets + np.array([[x - 40], [y - 30]])).astype(int)
        inside = (u >= 0) & (v >= 0) & (u < 71) & (v < 65)
        return picture[part][v[inside], u[inside]].astype(float)

    shown, behind = seen(image, WITHIN, 12.0) / 1.1, seen(still, WITHIN, 12.0)
    for before in (None, front):
        clear = np.ones(shown.shape, bool) if before is None else ~seen(before, WITHIN, 12.0).astype(bool)
        tells = clear & (np.abs(behind - 90) > 7)
        bobs = tells & (np.abs(shown - 90) < np.abs(shown - behind))
        told = tell_bob(patch, still, before, (x, y, 12.0), 90.0, 1.1, 7.0)
        if shown.size < WITHIN.shape[1]:  # beyond the patch the still picture goes on
            assert told is None
        else:
            assert told == (clear.sum(), tells.sum(), bobs.sum())


@pytest.mark.parametrize("length", [14.0, 40.0])
def test_a_streak_shows_the_bob_as_long_as_it_is_there(length: float):
    size, x, y, radius, streak = 100, 50.0, 49.5, 12.0, (length, 0.3 * length)
    rows, columns = np.ogrid[:size, :size]
    way = np.linspace(-0.5, 0.5, 401)
    there = np.mean([np.hypot(columns - x - u * streak[0], rows - y - u * streak[1]) < radius for u in way], axis=0)
    still = np.full((size, size), 180.0, np.float32)
    picture = (180 - 120 * there).astype(np.float32)
    half = np.where(columns < x, picture, still)  # a post of the wall's brightness stands before the other half

    def told(image: np.ndarray):
        return tell_bob(Patch(image, still, still, 0.0, 0.0), still, None, (x, y, radius), 60.0, 1.0, 10.0, streak)

    whole, hidden = told(picture), told(half)
    assert whole.seen == WITHIN.shape[1]
    assert whole.bobs > 0.97 * whole.seen
    assert 0.4 < hidden.bobs / hidden.tells < 0.6
