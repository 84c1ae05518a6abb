"""Where the arc of a swing does not bend, the pivot is where the string's lines meet. Motion and strings drawn here, truth known."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.tracking.clip.held import held_swing
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import fit_swing
from toolkit.tracking.geometry.view_fit import Lines

PIVOT, LENGTH, SIZE = (240.0, 40.0), 500.0, (480, 640)


def flat_swing():
    """Places and strings of a narrow ellipse that no arc goes through, and the motion whose pivot ran away."""
    rng = np.random.default_rng(2)
    t = np.arange(240) / 60
    theta = 0.05 * np.cos(4.4 * t)
    x, y = PIVOT[0] + LENGTH * np.sin(theta) + rng.normal(0, 0.1, t.size), PIVOT[1] + LENGTH + 2 * np.sin(4.4 * t)
    one, sure = np.ones(t.size), np.ones(t.size, bool)
    places = Places(t, x, y, 0.05 * one, 0.05 * one, sure, ~sure)
    angle = np.arctan2(x - PIVOT[0], y - PIVOT[1]) + rng.normal(0, 3e-4, t.size)
    lines = Lines(x - 200 * np.sin(angle), y - 200 * np.cos(angle), angle, 3e-4 * one, 0.05 * one, 180 * one, t)
    far = 5e5
    start = np.array([PIVOT[0], PIVOT[1] + LENGTH - far, far, 0.0, 4.4**2, 0.0, 0.0, (x[0] - PIVOT[0]) / far, 0.0])
    away = fit_swing(t, x, y, 0.1 * one, start, free=("omega2", "theta0", "rate0"))
    return places, lines, away


def test_the_string_holds_a_pivot_that_ran_away():
    places, lines, away = flat_swing()
    held = held_swing(away, places, lines, SIZE)
    assert held.pivot_px == pytest.approx(PIVOT, abs=3.0)
    assert held.length_px == pytest.approx(LENGTH, abs=3.0)
    assert np.abs(held.angle(places.t_s)[0]).max() == pytest.approx(0.05, rel=0.02)
    assert held.period_s == pytest.approx(2 * np.pi / 4.4, rel=0.005)


def test_without_a_string_or_a_need_the_motion_stays():
    places, lines, away = flat_swing()
    assert held_swing(away, places, None, SIZE) is away
    beside = lines._replace(angle_rad=0 * lines.angle_rad + 1e-6 * np.arange(places.t_s.size))  # they hardly meet
    assert held_swing(away, places, beside, SIZE).length_px > 1e5
    held = held_swing(away, places, lines, SIZE)
    assert held_swing(held, places, lines, SIZE) is held


def test_what_does_not_swing_about_the_point_is_not_held_there():
    places, lines, away = flat_swing()
    steep = np.arctan2(places.x_px - PIVOT[0], 50.0)  # such lines meet a little above the bob
    near = lines._replace(x_px=places.x_px, y_px=places.y_px, angle_rad=steep)
    assert held_swing(away, places, near, SIZE) is away
