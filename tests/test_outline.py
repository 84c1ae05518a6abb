"""The pull of the lens on the bob's place, against pictures drawn by counting points within the outline."""

import numpy as np
from scipy.ndimage import gaussian_filter

from toolkit.trackers.disc import fit_disc, locate
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.outline import pulled_by_lens
from toolkit.tracking.places import Places
from toolkit.tracking.swing import Swing
from toolkit.tracking.view import NAMES, View

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


def test_a_bob_drawn_out_by_the_lens_is_put_back_to_its_centre() -> None:
    values = np.zeros(len(NAMES))
    values[:10] = *PIVOT, 340.0, 0.0, 30.0, 0.0, 0.0, 0.8, 0.0, 1.0
    values[NAMES.index("k1")] = K1
    none = np.zeros((0, len(NAMES)))
    view = View(values, np.zeros((19, 19)), none, np.zeros(0), ("lens",), (319.5, 239.5), 0.0, 1.0)
    swing = Swing(values[:9], np.zeros((9, 9)), 0.0, 0.0)
    t = np.linspace(0, 1.3, 40)
    x, y = view.position(t, *swing.position(t))
    shown = [_picture(float(a), float(b)) for a, b in zip(x, y)]
    slow = np.argsort(np.hypot(*swing.velocity(t)))[:8]
    start = Look(RADIUS, 0.6, -100.0, noise=3.0)
    fits = [fit_disc(shown[k][0], start, shown[k][1], calibrate=True, turns=8) for k in slow]
    table = np.median([fit for fit in fits if fit is not None], axis=0)
    look = start._replace(radius_px=float(table[2]), edge_px=float(table[3]), noise=float(table[7]))
    off = np.array([locate(patch, look, guess)[:2] for patch, guess in shown]) - np.array([x, y]).T

    sigma = np.full(t.size, 0.05)
    places = Places(t, x + off[:, 0], y + off[:, 1], sigma, sigma, np.ones(t.size, bool), np.zeros(t.size, bool))
    left = off - np.array(pulled_by_lens(view, swing, places, lambda _: look, 0.0)).T
    assert np.sqrt(np.mean(off**2)) > 0.1
    assert np.sqrt(np.mean(left**2)) < 0.4 * np.sqrt(np.mean(off**2))


def test_frames_without_the_bob_are_left_alone() -> None:
    values = np.zeros(len(NAMES))
    values[:10] = *PIVOT, 340.0, 0.0, 30.0, 0.0, 0.0, 0.8, 0.0, 1.0
    values[NAMES.index("k1")] = K1
    view = View(values, np.zeros((19, 19)), np.zeros((0, 19)), np.zeros(0), ("lens",), (319.5, 239.5), 0.0, 1.0)
    swing = Swing(values[:9], np.zeros((9, 9)), 0.0, 0.0)
    t = np.linspace(0, 1.3, 40)
    x, y = view.position(t, *swing.position(t))
    good = np.arange(t.size) % 7 != 3
    x, y = np.where(good, x, np.nan), np.where(good, y, np.nan)
    places = Places(t, x, y, 0 * x, 0 * x, good, ~good)
    off = np.array(pulled_by_lens(view, swing, places, lambda _: Look(RADIUS, 0.6, -100.0, 3.0), 0.0))
    assert np.isfinite(off).all()
    assert off[:, good].any(axis=0).all()
    assert not off[:, ~good].any()
