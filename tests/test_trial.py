"""Of two localisers on the frames read ahead, which finds the bob more calmly."""

from __future__ import annotations

import numpy as np
from test_track import angles

from toolkit.tracking.begin.trial import Trial
from toolkit.tracking.geometry.swing import fit_swing, start_swing
from toolkit.tracking.picture.looks import Looks

ASLANT, FAR_PX = 0.25, 480.0  # rad, and how far away the camera is


def seen_aslant(t, noise_px, seed):
    """Places of a wide swing of 300 px before a camera that looks at it aslant from near."""
    theta = angles(t, 1.0)
    across, down = 300 * np.sin(theta), 300 * np.cos(theta)
    near = FAR_PX / (FAR_PX - across * np.sin(ASLANT))
    places = near * np.array([across * np.cos(ASLANT), down])
    return places + np.random.default_rng(seed).normal(0, noise_px, places.shape)


def trial(t, places, numbers):
    x, y = places[:, numbers]
    swing = fit_swing(t[numbers], x, y, np.full(x.size, 0.1), start_swing(t[numbers], x, y))
    off = np.hypot(*(p - q for p, q in zip(swing.position(t[numbers]), (x, y))))
    strays, where = dict(zip(numbers, off)), dict(zip(numbers, zip(t[numbers], x, y)))
    return Trial(None, Looks(None), len(numbers), swing, 1.0, ((0, 1), (0.85, 0.85)), (60.0, 1.0), strays, where)


def test_who_loses_the_bob_where_the_camera_looks_most_aslant_is_no_calmer():
    t = np.arange(96) / 60
    places = seen_aslant(t, 0.1, 1)
    lost = places[0] > 0.5 * places[0].max()  # the side that is nearest
    most = trial(t, places, np.arange(96).tolist())
    part = trial(t, seen_aslant(t, 0.1, 2), np.flatnonzero(~lost).tolist())
    assert part.swing.rms_px < 0.7 * most.swing.rms_px  # each about a swing of its own
    mine_px, its_px = most.rms_with(part)
    assert abs(mine_px / its_px - 1) < 0.1
    assert most.finds_more_than(part)


def test_who_finds_it_on_more_frames_but_less_calmly_is_not_taken_for_that():
    t = np.arange(96) / 60
    rough = trial(t, seen_aslant(t, 3.0, 1), np.arange(96).tolist())
    part = trial(t, seen_aslant(t, 0.1, 2), np.arange(20, 96).tolist())
    assert not rough.finds_more_than(part)
