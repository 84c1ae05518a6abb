"""A bob whose stripes are by turns dark and as bright as the wall: its size and place by what shows of its outline."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.begin.bold import learn_bold
from toolkit.tracking.geometry.swing import fit_swing, start_swing
from toolkit.tracking.picture.looks import Sightings

WALL, DARK, RADIUS = 180.0, 70.0, 16.0


def striped_ball(cx, cy, turn, size=64, over=6):
    """6×6 samples a pixel of a ball with three dark and three wall-coloured stripes from pole to pole, turned by `turn`."""
    fine = (np.arange(size * over) + 0.5) / over - 0.5
    u, v = (fine[None, :] - cx) / RADIUS, (fine[:, None] - cy) / RADIUS
    square = u**2 + v**2
    longitude = np.arctan2(u + 0 * v, np.sqrt(np.maximum(1 - square, 0))) + turn
    dark = (square < 1) & (np.sin(3 * longitude) > 0)
    return WALL + (DARK - WALL) * dark.reshape(size, over, size, over).mean(axis=(1, 3))


@pytest.mark.parametrize("guessed", [0.9, 1.12])
def test_the_size_of_a_bob_is_learned_though_half_of_its_outline_is_the_walls(guessed):
    rng = np.random.default_rng(5)
    t = np.arange(48) / 30
    theta = 0.2 * np.cos(5 * t)
    x, y, turn = 300 + 300 * np.sin(theta), -100 + 300 * np.cos(theta), 2.4 * t
    x0, y0 = np.floor(x).astype(int) - 32, np.floor(y).astype(int) - 32
    images = [striped_ball(a - b, c - d, w) for a, b, c, d, w in zip(x, x0, y, y0, turn)]
    images = [(i + rng.normal(0, 1.5, i.shape)).astype(np.float32) for i in images]
    wall = np.full((64, 64), WALL, np.float32)

    def show(k, look, centre, streak_s):
        return Guess(*centre), Patch(images[k], wall, np.full_like(wall, 20.0), x0[k], y0[k])

    pulled = x + 2.5 * np.sin(3 * turn)  # towards where it is dark
    swing = fit_swing(t, pulled, y, np.full(t.size, 0.3), start_swing(t, pulled, y))
    seen = Sightings(pulled, y, np.gradient(x, t), np.gradient(y, t), show)
    found = learn_bold(seen, t, Look(guessed * RADIUS, 1.0, -20.0), swing, None)
    assert found.look.radius_px == pytest.approx(RADIUS, rel=0.03)
    assert found.look.contrast == pytest.approx(DARK - WALL, rel=0.15)
    assert found.calm
    where = found.swing.position(t)
    assert np.std(where[0] - x) < 0.5 * np.std(pulled - x)
