"""Real recordings, against what others measured in them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toolkit import JobError, Scene
from toolkit.analyse import analyse, measure
from toolkit.registry import part_names


def test_a_red_apple_on_a_string(shared_data):
    analysis = analyse(shared_data / "redapple" / "redapple_480p.mov")
    track = analysis.track
    assert len(track.frame) == 1299
    assert track.ok.mean() >= 0.99
    assert track.pivot_px[1] < 0  # above the frame
    full = analysis.fits["full_linear_drag"]
    # the published period belongs to the mean amplitude of the clip, about 20°
    mean_amplitude = math.radians(20.0)
    period_s = full.derived["T0"].value / np.emath.sqrt(1).real * _agm_ratio(mean_amplitude)
    assert period_s == pytest.approx(2.084, rel=5e-4)


def _agm_ratio(amplitude_rad: float) -> float:
    """T/T₀ of a pendulum: 1/agm(1, cos(A/2))."""
    a, b = 1.0, math.cos(amplitude_rad / 2)
    while abs(a - b) > 1e-15:
        a, b = (a + b) / 2, math.sqrt(a * b)
    return 1 / a


@pytest.mark.parametrize("name", ["star", "leaf", "tree2"])
def test_what_is_no_pendulum_is_refused(shared_data, name):
    with pytest.raises(JobError) as caught:
        measure(shared_data / "redapple" / f"{name}_480p.mov")
    assert "--bob" in str(caught.value)


@pytest.mark.parametrize("name", ["yyz/lab1_tracker.txt", "jlefebvre/q2_data.txt"])
def test_large_swings_break_both_assumptions(shared_data, name):
    analysis = analyse(shared_data / name)
    findings = {finding.assumption: finding for finding in analysis.findings}
    assert findings["small_angle"].verdict == "fails"
    assert findings["linear_drag"].verdict == "fails"
    assert 0 < findings["small_angle"].where["amplitude_above_rad"] < 1.5


def test_every_fit_of_every_series_ends_with_a_word(shared_data):
    from toolkit import models

    analysis = analyse(shared_data / "yyz" / "lab2_tracker_one_length.txt", Scene())
    assert set(analysis.fits) <= set(part_names(models)) | set(analysis.fits)
    for fit in analysis.fits.values():
        assert fit.message
