"""What the string pulls a bob's place by where a lens draws it out, against pictures drawn by counting points within the outline."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from toolkit.trackers import disc, edge
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.clip.outline import pulled_by_string
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import Swing

K1, RADIUS, FINE = -0.1, 14.0, 8
MIDDLE = np.array([319.5, 239.5])
PIVOT = np.array([319.5, 60.0])


def _bends(x: float, y: float) -> np.ndarray:
    """The slopes (2, 2) of q (1 + k q²/c²), c to the corner, at the q that the lens shows at x, y."""
    seen, corner = np.array([x, y]) - MIDDLE, float(MIDDLE @ MIDDLE)
    q = seen.copy()
    for _ in range(60):
        q = seen / (1 + K1 * (q @ q) / corner)
    return np.eye(2) * (1 + K1 * (q @ q) / corner) + 2 * K1 * np.outer(q, q) / corner


def _picture(x: float, y: float) -> tuple[Patch, Guess]:
    """A dark bob with a soft edge whose outline the lens draws out, its centre at x, y, on an even wall."""
    half = int(1.5 * RADIUS + 12)
    left, top = round(x) - half, round(y) - half
    at = np.arange((2 * half + 1) * FINE) / FINE + (0.5 / FINE - 0.5)
    dx, dy = np.meshgrid(at + left - x, at + top - y)
    a, b = np.einsum("ij,jrc->irc", np.linalg.inv(_bends(x, y)), np.array([dx, dy]))
    inside = gaussian_filter((np.hypot(a, b) < RADIUS).astype(float), 0.5 * FINE)
    image = 180 - 100 * inside.reshape(2 * half + 1, FINE, 2 * half + 1, FINE).mean(axis=(1, 3))
    image = image.astype(np.float32)
    patch = Patch(image, np.full_like(image, 180.0), np.full_like(image, 40.0), float(left), float(top))
    return patch, Guess(x, y, 0.0, 0.0, float(np.arctan2(PIVOT[1] - y, PIVOT[0] - x)))


def _swung() -> tuple[Swing, np.ndarray, np.ndarray, np.ndarray]:
    """A swing, and times with the places that it has then."""
    values = np.array([*PIVOT, 340.0, 0.0, 30.0, 0.0, 0.0, 0.8, 0.0])
    swing, t = Swing(values, np.zeros((9, 9)), 0.0, 0.0), np.linspace(0, 1.3, 60)
    return swing, t, *swing.position(t)


@pytest.mark.parametrize("locate", [disc.locate, edge.locate], ids=["disc", "edge"])
def test_a_bob_drawn_out_by_the_lens_is_put_back_to_its_centre(locate) -> None:
    swing, t, x, y = _swung()
    shown = [_picture(float(a), float(b)) for a, b in zip(x, y)]
    slow = np.argsort(np.hypot(*swing.velocity(t)))[:8]
    start = Look(RADIUS, 0.6, -100.0, noise=3.0)
    fits = [fit_disc(shown[k][0], start, shown[k][1], calibrate=True, turns=8) for k in slow]
    table = np.median([fit for fit in fits if fit is not None], axis=0)
    look = start._replace(radius_px=float(table[2]), edge_px=float(table[3]), noise=float(table[7]))
    found = np.array([locate(patch, look, guess)[:2] for patch, guess in shown])
    faced = np.array([locate(patch, look, guess._replace(faces=True))[:2] for patch, guess in shown])
    off = found - np.array([x, y]).T

    sigma = np.full(t.size, 0.05)
    places = Places(t, *found.T, sigma, sigma, np.ones(t.size, bool), np.zeros(t.size, bool))
    pulls = {k: tuple(found[k] - faced[k]) for k in range(1, t.size, 2)}
    left = off - np.array(pulled_by_string(pulls, swing, places)).T
    along = np.vander(x - PIVOT[0], 4)  # what goes with the place: the rest is how pixels lie in the outline
    was, is_left = (along @ np.linalg.lstsq(along, both, rcond=None)[0] for both in (off, left))
    assert np.sqrt(np.mean(was**2)) > 0.1
    assert np.sqrt(np.mean(is_left**2)) < 0.25 * np.sqrt(np.mean(was**2))


def test_what_chance_makes_of_a_round_bob_moves_nothing() -> None:
    swing, t, x, y = _swung()
    sigma = np.full(t.size, 0.05)
    places = Places(t, x, y, sigma, sigma, np.ones(t.size, bool), np.zeros(t.size, bool))
    chance = np.random.default_rng(1).normal(0, 0.02, (200, t.size, 2))
    moved = [pulled_by_string({k: tuple(off[k]) for k in range(t.size)}, swing, places) for off in chance]
    assert np.sqrt(np.mean(np.square(moved))) < 0.003  # fitted as it is, it would be 0.02 √(7/60) = 0.007


def test_frames_without_the_bob_are_left_alone() -> None:
    swing, t, x, y = _swung()
    good = np.arange(t.size) % 7 != 3
    x, y = np.where(good, x, np.nan), np.where(good, y, np.nan)
    places = Places(t, x, y, 0 * x, 0 * x, good, ~good)
    wild = {k: (0.1, 0.2) if good[k] else (50.0, np.nan) for k in range(t.size)}
    off = np.array(pulled_by_string(wild, swing, places))
    np.testing.assert_allclose(off[:, good], [[0.1], [0.2]] * np.ones(good.sum()), atol=1e-6)
    assert not off[:, ~good].any()
