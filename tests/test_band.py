"""Noise beneath what moves slowly, against noise made up here."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.tracking.clip.band import beyond_band
from toolkit.tracking.clip.scatter import quick_scatter


def told(t, series, unit):
    beyond = beyond_band(t, series, unit)
    return np.sqrt(np.sum(beyond.rest**2, axis=1) / beyond.holds(np.ones(t.size)))


@pytest.mark.parametrize(("fps", "even"), [(30, True), (60, True), (60, False)])
def test_noise_beneath_a_hands_shake_is_told_better_than_by_differences(fps, even):
    found, differences = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        t = np.arange(4 * fps) / fps
        if not even:
            t = t[rng.random(t.size) > 0.1] + 0
            t = t + rng.uniform(-0.2, 0.2, t.size) / fps
        unit = 0.03 * (1 + 0.4 * np.sin(3 * t))
        f, phase = rng.uniform(0.4, 5.0, (2, 9, 1)), rng.uniform(0, 6.28, (2, 9, 1))
        shake = np.sum(3 / f * np.sin(2 * np.pi * f * t + phase), axis=1)
        series = shake + unit * rng.normal(size=(2, t.size))
        found.append(told(t, series, unit))
        differences.append(quick_scatter(t, series, np.array([unit, unit])))
    assert np.mean(found) == pytest.approx(1.0, abs=0.05)
    off, by_differences = (np.sqrt(np.mean((np.array(v) - 1) ** 2)) for v in (found, differences))
    assert off < 0.8 * by_differences


def test_noise_alone_keeps_nearly_all_of_its_values():
    rng = np.random.default_rng(0)
    t = np.arange(300) / 60
    beyond = beyond_band(t, rng.normal(size=(2, 300)), np.ones(300))
    assert beyond.left > 0.8 * 300


def test_what_independent_errors_leave_is_what_they_leave_on_the_mean():
    rng = np.random.default_rng(2)
    t = np.arange(200) / 60
    variance = np.where(np.arange(200) % 3, 1.0, 4.0)
    slow = np.array([5 * np.sin(9 * t), 5 * np.cos(7 * t)])
    beyond = beyond_band(t, slow + 0.1 * rng.normal(size=(2, 200)), np.full(200, 0.1))
    mixed = beyond.mixes(variance[:, None])[:, 0]
    assert mixed.sum() == pytest.approx(beyond.holds(variance), rel=1e-9)
    span, q = beyond.pieces[0]
    rest = np.sqrt(variance[span]) * rng.normal(size=(4000, q.shape[0]))
    rest = rest - (rest @ q) @ q.T
    assert np.mean(rest**2, axis=0) == pytest.approx(mixed[span], rel=0.2)
