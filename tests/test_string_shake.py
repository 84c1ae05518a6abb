"""The camera's shake by the string, against shakes that were put in."""

import numpy as np
import pytest

from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.string_shake import shake_on_string
from toolkit.tracking.geometry.view_fit import Lines

T = np.arange(240) / 60
PIVOT, LENGTH, REACH = np.array([320.0, -60.0]), 430.0, 0.06
ANGLE = REACH * np.exp(-0.05 * T) * np.cos(2 * np.pi * T / 1.4)


def hand(seed=3, rms_px=2.5):
    """Both ways a sum of sines of 0.4 to 5 Hz."""
    rng = np.random.default_rng(seed)
    waves = np.sin(2 * np.pi * np.outer(T, rng.uniform(0.4, 5, 12)) + rng.uniform(0, 6.28, 12))
    return rms_px * waves @ rng.normal(0, np.sqrt(2 / 12), (12, 2))


def seen(shake, angle=ANGLE, view=0.0, noise_rad=2e-4):
    """Bob and string as such a camera shows them; `view` moves the picture's pivot in step with the swing."""
    rng = np.random.default_rng(5)
    direction = np.column_stack([np.sin(angle), np.cos(angle)])
    at = PIVOT + shake + np.column_stack([view * angle**2, view * angle]) / REACH
    bob = at + LENGTH * direction
    x, y = (bob - 100 * direction).T
    sigma, yes = np.full(T.size, 0.03), np.ones(T.size, bool)
    places = Places(T, *bob.T, sigma, sigma, yes, ~yes)
    measured = angle + noise_rad * rng.normal(size=T.size)
    return places, Lines(x, y, measured, np.full(T.size, noise_rad), sigma, np.full(T.size, 80.0), T)


def error_px(found, shake):
    off = found - shake
    return np.sqrt(np.mean((off - off.mean(axis=0)) ** 2, axis=0))


def test_a_shake_before_a_plain_wall_is_read_off_the_string():
    shake = hand()
    places, lines = seen(shake)
    found, sigma = shake_on_string(places, lines)
    across, down = error_px(found, shake)
    assert down < 0.02  # a wrong length moves it with the square of the swing only
    assert across < 0.25 * shake[:, 0].std()  # what of the shake looks like a longer string stays
    still = np.column_stack([places.x_px, places.y_px]) - found
    middle = still.mean(axis=0) - PIVOT
    bent = np.arctan2(still[:, 0] - PIVOT[0] - middle[0], still[:, 1] - PIVOT[1])
    assert np.corrcoef(bent, ANGLE)[0, 1] > 0.9999  # the angles are the string's
    assert sigma == pytest.approx(LENGTH * 2e-4, rel=0.1)


def test_what_moves_the_pivot_in_step_with_the_swing_is_no_shake():
    assert shake_on_string(*seen(np.zeros((T.size, 2)), view=4.0)) is None
    assert shake_on_string(*seen(np.zeros((T.size, 2)))) is None


def test_a_post_taken_for_the_string_moves_nothing():
    shake = hand()
    places, lines = seen(shake)
    wrong = slice(60, 75)
    lines.angle_rad[wrong] += 0.1
    found, sigma = shake_on_string(places, lines)
    rest = np.ones(T.size, bool)
    rest[wrong] = False
    assert np.all(error_px(found[rest], shake[rest]) < 0.25 * shake.std(axis=0))
    assert sigma[67] > 3 * sigma[30]  # there it is guessed from before and after
    off = found - shake
    assert np.all(np.abs(off[67] - off[rest].mean(axis=0)) < 4 * sigma[67])


def test_a_string_seen_seldom_tells_nothing():
    places, lines = seen(hand())
    lines.angle_rad[::2] = np.nan
    assert shake_on_string(places, lines) is None
