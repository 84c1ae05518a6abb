"""Error bars of places against scatter made up here, and the string found where it is only roughly thought to be."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.tracking.clip.scatter import quick_scatter, true_sigma
from toolkit.tracking.clip.verdict import poor_picture
from toolkit.tracking.picture.string_line import measure_string, seen_half

N = 400
T = np.arange(N) / 60
VX, VY = 500 * np.cos(5 * T), 120 * np.sin(10 * T)


def factors(rx, ry, time_sigma=0.0, known=0.0, unsteady=np.inf, slow=0.0):
    one = np.ones(N)
    return true_sigma(T, (rx, ry), (0.02 * one, 0.02 * one), (VX, VY), known * one, time_sigma, unsteady, slow_px=slow)


def test_quick_and_slow_errors_of_a_localiser_both_count():
    rng = np.random.default_rng(0)
    quick = rng.normal(0, 0.03, (2, N))
    slow = 0.03 * np.sqrt(2) * np.sin(1.3 * T)  # what a codec carries from frame to frame
    found = factors(quick[0] + slow, quick[1])
    assert found.x == pytest.approx(1.5 * np.sqrt(2), rel=0.1)
    assert found.y == pytest.approx(1.5, rel=0.1)
    assert found.shake_px == 0


def test_what_a_fit_has_taken_from_errors_that_neighbours_share_is_put_back():
    rng = np.random.default_rng(6)
    waves = [f(k * 5 * T) * T**n for k in (1, 2) for f in (np.cos, np.sin) for n in (0, 1)]
    motion = np.stack([np.ones(N), *waves], axis=1)
    for alike, tolerance in ((0.0, 0.03), (0.8, 0.05)):
        ratios = []
        for _ in range(40):
            errors = rng.normal(0, 0.03 * np.sqrt(1 - alike**2), (2, N + 50))
            for k in range(1, N + 50):
                errors[:, k] += alike * errors[:, k - 1]
            errors = errors[:, 50:]
            left = errors - (motion @ np.linalg.lstsq(motion, errors.T, rcond=None)[0]).T
            found = factors(*left, unsteady=0.005)  # the camera stood still
            ratios += [found.x / (np.std(errors[0]) / 0.02), found.y / (np.std(errors[1]) / 0.02)]
        assert np.mean(ratios) == pytest.approx(1.0, abs=tolerance)


def test_a_shaking_camera_is_told_from_the_localiser_by_what_is_across_the_motion():
    rng = np.random.default_rng(1)
    quick = rng.normal(0, 0.03, (2, N))
    shake = np.sin(np.outer([9.0, 11.0], T)) * np.sqrt(2)
    found = factors(*(quick + shake))
    assert (found.x, found.y) == (pytest.approx(1.5, rel=0.25), pytest.approx(1.5, rel=0.25))
    assert found.shake_px == pytest.approx(1.0, rel=0.3)


def test_slow_errors_are_the_localisers_as_far_as_the_bobs_picture_lets_it_err():
    rng = np.random.default_rng(3)
    quick = rng.normal(0, 0.03, (2, N))
    pattern = 0.5 * np.sin(np.outer([3.0, 4.0], T)) * np.sqrt(2)  # a pattern that turns
    found = factors(*(quick + pattern), unsteady=0.03, slow=1.0)
    assert (found.x, found.y) == (pytest.approx(25, rel=0.1), pytest.approx(25, rel=0.1))
    assert found.shake_px == 0
    found = factors(
        *(quick + pattern), unsteady=0.03, slow=0.1
    )  # an even disc is not found half a pixel off: the motion is another
    assert (found.x, found.y) == (pytest.approx(1.5, rel=0.3), pytest.approx(1.5, rel=0.3))
    late = 0.01 * np.sign(np.sin(3 * T))  # nor is a clock a localiser
    found = factors(quick[0] + VX * late, quick[1] + VY * late, unsteady=0.03, slow=1.0)
    assert (found.x, found.y) == (pytest.approx(1.5, rel=0.3), pytest.approx(1.5, rel=0.3))


def test_quick_scatter_sees_through_a_shake_at_uneven_times():
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0, 4, 240))
    t = t[np.diff(t, prepend=-1.0) > 0.004]
    sigma = rng.uniform(0.02, 0.04, t.size)
    shaken = 3 * np.sin(2 * np.pi * 0.7 * t) + rng.normal(0, 1.0, t.size) * sigma
    assert quick_scatter(t, shaken, sigma) == pytest.approx(1.0, rel=0.15)


def test_a_clock_that_errs_or_a_drive_is_no_shake():
    rng = np.random.default_rng(2)
    quick = rng.normal(0, 0.03, (2, N))
    late = 0.01 * np.sin(3 * T)
    found = factors(quick[0] + VX * late, quick[1] + VY * late)
    assert found.shake_px < 0.02
    jitter = rng.normal(0, 3e-4, N)
    found = factors(quick[0] + VX * jitter, quick[1] + VY * jitter, time_sigma=3e-4)
    assert (found.x, found.y) == (pytest.approx(1.5, rel=0.25), pytest.approx(1.5, rel=0.25))


def test_beside_a_clock_both_axes_are_told_by_what_is_slow_or_across():
    ratios = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        own = rng.normal(0, 0.03, (2, N))
        jitter = rng.uniform(-5e-4, 5e-4, N)  # stamps in whole milliseconds
        found = factors(own[0] + VX * jitter, own[1] + VY * jitter, time_sigma=1e-3 / np.sqrt(12))
        ratios.append((found.x / 1.5, found.y / 1.5))
    assert np.mean(ratios, axis=0) == pytest.approx([1.0, 1.0], abs=0.05)
    assert np.std(ratios, axis=0).max() < 0.12


def test_behind_a_shake_the_axes_are_drawn_together_unless_they_clearly_differ():
    rng = np.random.default_rng(5)
    shake = np.sin(np.outer([2.0, 3.0], T)) * np.sqrt(2)
    for y_px, one in ((0.03, 1.0), (0.15, 5.0)):
        ratios = []
        for _ in range(30):
            found = factors(*(shake + rng.normal(0, [[0.03], [y_px]], (2, N))), known=0.001)
            ratios.append((found.x / 1.5, found.y / (1.5 * one)))
        assert np.mean(ratios, axis=0) == pytest.approx([1.06, 1.06], abs=0.06)


@pytest.mark.parametrize("wrong_px", [0.0, -45.0, 45.0])
def test_a_string_is_found_though_the_pivot_is_not_known_well(wrong_px):
    cv2 = pytest.importorskip("cv2")
    pivot, bob, radius = (190.0, 20.0), (240.0, 300.0), 15.0
    wall = np.full((360, 480), 180.0, np.float32)
    cv2.line(wall, tuple(round(16 * v) for v in pivot), tuple(round(16 * v) for v in bob), 90.0, 2, cv2.LINE_AA, 4)
    luma = np.clip(wall + np.random.default_rng(3).normal(0, 2, wall.shape), 0, 255).astype(np.uint8)
    line = measure_string(luma, bob, (pivot[0] + wrong_px, pivot[1]), radius)
    truth = np.arctan2(bob[0] - pivot[0], bob[1] - pivot[1])
    assert line is not None
    assert line.angle_rad == pytest.approx(truth, abs=5 * line.sigma_angle_rad + 2e-4)
    for slope in (line.slope, line.slope + 0.004, 0.3):  # where it was thought to be of late, nearly there, elsewhere
        again = measure_string(luma, bob, (pivot[0] + wrong_px, pivot[1]), radius, before=line._replace(slope=slope))
        assert again is not None
        assert 260.0 * abs(again.angle_rad - line.angle_rad) < 0.06  # px: both end within 0.03 of the best
    half = seen_half(np.hypot(line.x_px - bob[0], line.y_px - bob[1]), radius)
    assert half == pytest.approx(0.5 * (np.hypot(280.0, 50.0) - 1.15 * radius - 10.0), abs=12.0)


def test_a_bob_with_a_pattern_is_warned_of_only_where_its_places_stray():
    followed_well = poor_picture(0.03, False, 0.2, 0.05)
    assert followed_well == []
    (strays,) = poor_picture(0.03, False, 0.2, 0.6)
    assert strays.values["off_px"] == 0.6
    (shadowed,) = poor_picture(0.2, True, 1.0, 0.05)
    assert shadowed.values["off_px"] == 1.0
