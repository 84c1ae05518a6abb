"""What moves and is no pendulum is refused in a sentence that says why; pendulums of all kinds are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolkit.errors import JobError
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.verdict import require_pendulum
from toolkit.tracking.geometry.swing import Swing

SIZE_PX = (640, 480)
TIMES = np.arange(180) / 30.0


def judge(omega2=20.0, length=400.0, theta0=0.3, rate0=0.0, gamma=0.01, seen=None, strays=0.0, misfit=0.0, repeated=0):
    """Refused or not: a bob that strays so far (of its swing) from the fitted motion, seen on the frames `seen`, some of which
    show the one two before once more."""
    values = np.array([320.0, 20.0, length, 0.0, omega2, gamma, 0.0, theta0, rate0])
    swing = Swing(values, np.zeros((9, 9)), 0.0, 0.02)
    x, y = swing.position(TIMES)
    good = np.ones(TIMES.size, bool) if seen is None else seen
    sigma = np.full(TIMES.size, 0.02)
    shown = np.array([x, y])
    again = np.arange(repeated) * 20 + 21
    shown[:, again] = shown[:, again - 2]
    places = Places(TIMES, *shown, sigma, sigma, good, ~good)
    off_px = strays * places.extent_px
    late_px = float(np.sqrt(np.mean((shown - [x, y])[:, good] ** 2)))
    shown += np.random.default_rng(1).normal(0, off_px, shown.shape)
    swing, places = replace(swing, rms_px=0.02 + off_px + late_px), replace(places, x_px=shown[0], y_px=shown[1])
    require_pendulum(swing, places, SIZE_PX, Path("clip.mp4"), misfit)


def test_a_bob_seen_on_half_of_the_frames_may_have_repeated_pictures_but_no_other_strays():
    half = np.arange(TIMES.size) % 20 < 10
    judge(seen=half, repeated=8)
    with pytest.raises(JobError, match="seen on 50%"):
        judge(seen=half, strays=0.03)


def test_what_does_not_look_like_a_bob_has_to_swing_the_better():
    judge(strays=0.05, misfit=0.1)  # a hand held the camera
    judge(strays=0.03, misfit=0.5)
    with pytest.raises(JobError, match="strays"):
        judge(strays=0.05, misfit=0.5)


@pytest.mark.parametrize(
    "pendulum",
    [
        {},
        {"theta0": 3.1},
        {"theta0": 0.01},
        {"length": 15 * 800.0, "theta0": 0.02, "omega2": 3.0},
        {"gamma": 3.0},
        {"omega2": (np.pi / 5.5) ** 2},  # just over half a period
    ],
)
def test_a_pendulum_is_let_through(pendulum):
    judge(**pendulum)


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        ({"length": 25 * 800.0, "theta0": 0.01}, "straight line"),
        ({"omega2": 1e-4, "theta0": 0.0, "rate0": 0.1}, "does not turn back"),
        ({"rate0": 20.0}, "does not turn back"),  # over the top
        ({"omega2": -1.0, "theta0": 0.01}, "nothing pulls it back"),
        ({"gamma": -0.1}, "swing grows"),
        ({"omega2": (np.pi / 6.5) ** 2}, "less than half a period"),
    ],
)
def test_what_is_no_pendulum_is_refused_with_the_reason(motion, why):
    with pytest.raises(JobError, match=why):
        judge(**motion)


@pytest.mark.parametrize(("away", "refused"), [(0.0, False), (12.0, True)])
def test_an_ellipse_before_a_tilted_camera_is_a_swing_but_not_what_leaps_about_it(away, refused):
    swing = Swing(np.array([320.0, 20.0, 400.0, 0.0, 20.0, 0.0, 0.0, 0.1, 0.0]), np.zeros((9, 9)), 0.0, 7.0)
    phase = np.sqrt(20.0) * TIMES
    x, y = 320 + 40 * np.cos(phase), 420 + 10 * np.sin(phase) + away * np.random.default_rng(1).normal(size=TIMES.size)
    sigma, good = np.full(TIMES.size, 0.02), np.ones(TIMES.size, bool)
    places = Places(TIMES, x, y, sigma, sigma, good, ~good)
    if refused:
        with pytest.raises(JobError, match="strays"):
            require_pendulum(swing, places, SIZE_PX, Path("clip.mp4"))
    else:
        require_pendulum(swing, places, SIZE_PX, Path("clip.mp4"))


def test_a_motion_that_is_beyond_all_numbers_on_a_frame_before_it_was_seen_is_refused():
    seen = TIMES >= 0.4
    swing = Swing(np.array([320.0, 20.0, 400.0, 0.0, 50.0, 0.0, 2.0, 0.8, -17.0]), np.zeros((9, 9)), 0.4, 0.02)
    assert np.isfinite(swing.angle(TIMES[seen])).all()
    assert not np.isfinite(swing.angle(TIMES)).all()  # so quick a bob, its drag undone, is infinitely quick in no time
    x, y = swing.position(TIMES)
    sigma = np.full(TIMES.size, 0.02)
    with pytest.raises(JobError, match="does not turn back"):
        require_pendulum(swing, Places(TIMES, x, y, sigma, sigma, seen, ~seen), SIZE_PX, Path("clip.mp4"))
