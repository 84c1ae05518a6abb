"""Real recordings, against what others measured in them."""

from __future__ import annotations

import math

import pytest

from toolkit import JobError
from toolkit.analyse import analyse, measure


def test_a_red_apple_on_a_string(shared_data):
    import av

    clip = shared_data / "redapple" / "redapple_480p.mov"
    with av.open(str(clip)) as file:
        header_rate = float(file.streams.video[0].average_rate)
    analysis = analyse(clip)
    track = analysis.track
    assert len(track.frame) == 1299
    assert track.ok.mean() >= 0.99
    assert track.pivot_px[1] < 0  # above the frame
    # The stamps are even at 59.94 a second, the header's mean rate is 59.77: frames are missing that no stamp tells of.
    # Where the motion leaps by whole frames they are placed, which may not take the clock past the header's.
    rate = (len(track.frame) - 1) / float(track.t_s[-1])
    assert header_rate * (1 - 1e-6) < rate < 60000 / 1001
    # The sine that fits best has the mean period. The published 2.0841 s counted frames at the header's rate.
    mean_period_s = 2 * math.pi / analysis.fits["small_angle_linear_drag"].parameters["omega_g"].value
    assert mean_period_s * rate / header_rate == pytest.approx(2.084, rel=5e-4)
    assert any("59.768" in sentence and "59.94" in sentence for sentence in analysis.series.meta["warnings"])


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
    for fit in analysis.fits.values():
        assert fit.message
