"""How far the lens pulls a bob from where it is: an outline that it draws out is no circle, and the circle fitted to what the
string leaves of it lies beside its centre.

The pull is measured, not derived: the bob is drawn as the lens shows it, without noise, and found there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from toolkit.trackers.disc import fit_disc, locate
from toolkit.trackers.localiser import Guess, Look, Patch, disc_share
from toolkit.tracking.places import Places
from toolkit.tracking.swing import Swing
from toolkit.tracking.view import View

_NODES = 33  # places along the way on which it is drawn,
_DEGREE = 6  # and the polynomial through what was found there: where pixels lie in the outline is not to count
_SLOW = 8  # of them, the slowest, on which its size is learned
_ROUNDS = 3
_LEAST_EDGE_PX = 0.3
_WALL = 128.0
_SEEN = 30.0  # frames
_RADIUS, _EDGE = 2, 3  # of what `fit_disc` gives


class _Drawn(NamedTuple):
    """A bob to be drawn: where in the picture, how it was looked for there (about the origin), and its (2, 2) shape: from
    offsets in the picture to those before the lens."""

    guess: Guess
    look: Look
    shape: np.ndarray

    def by(self, true: Look) -> Patch:
        """Its picture, the bob before the lens being a disc of these looks."""
        streak = np.hypot(self.guess.streak_x_px, self.guess.streak_y_px)
        half = int(1.5 * self.look.radius_px + 4 * self.look.edge_px + 4 + 0.5 * streak)
        at = np.arange(-half, half + 1.0)
        parts = int(np.ceil(streak)) + 1
        share = np.zeros((at.size, at.size))
        for part in (np.arange(parts) + 0.5) / parts - 0.5:
            across = at - self.guess.x_px - part * self.guess.streak_x_px
            down = at[:, None] - self.guess.y_px - part * self.guess.streak_y_px
            a, b = (row[0] * across + row[1] * down for row in self.shape)
            far = np.hypot(a, b) + 1e-9
            steep = np.hypot(*(column[0] * a + column[1] * b for column in self.shape.T)) / far
            share += disc_share(true.radius_px + (far - true.radius_px) / steep, true) / parts
        image = (_WALL + true.contrast * share).astype(np.float32)
        return Patch(image, np.full_like(image, _WALL), np.full_like(image, _SEEN), -float(half), -float(half))


def pulled_by_lens(
    view: View, swing: Swing, places: Places, look_at: Callable[[Guess], Look], exposure_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """How far beside the bob's centre the disc fit found it on each frame, (n,) px each, the lens bending as in `view`; 0 where
    it did not."""
    good = np.flatnonzero(places.good)
    theta = view.angles(places.t_s[good], places.x_px[good], places.y_px[good])[0]
    nodes = np.argsort(theta)[np.linspace(0, good.size - 1, _NODES).astype(int)]
    some = good[nodes]
    x, y = places.x_px[some], places.y_px[some]
    vx, vy = swing.velocity(places.t_s[some])
    px, py = view.pivot_px
    phase = np.random.default_rng(0).uniform(-0.5, 0.5, (2, some.size))  # of a pixel: none is to count more than others
    columns = (*phase, vx * exposure_s, vy * exposure_s, np.arctan2(py - y, px - x))
    guesses = [Guess(*(float(v) for v in row)) for row in zip(*columns)]
    looks = [look_at(Guess(float(a), float(b))) for a, b in zip(x, y)]
    bobs = [_Drawn(*bob) for bob in zip(guesses, looks, _shapes(view, x, y))]
    true = _true_look([bobs[k] for k in np.argsort(np.hypot(vx, vy))[:_SLOW]])
    found = [locate(bob.by(true), bob.look, bob.guess) for bob in bobs]
    off = np.array([(p.x_px - bob.guess.x_px, p.y_px - bob.guess.y_px) for p, bob in zip(found, bobs)]).T
    seen = np.isfinite(off[0])
    x_off, y_off = np.zeros(places.t_s.size), np.zeros(places.t_s.size)
    if seen.sum() > 2 * _DEGREE:
        through = (np.polynomial.Polynomial.fit(theta[nodes][seen], o[seen], _DEGREE) for o in off)
        x_off[good], y_off[good] = (curve(theta) for curve in through)
    return x_off, y_off


def _true_look(bobs: list[_Drawn]) -> Look:
    """Radius and edge of the disc before the lens: those learned are of the circles that fit such outlines best."""
    radius, edge = np.median([[bob.look.radius_px, bob.look.edge_px] for bob in bobs], axis=0)
    true = bobs[0].look._replace(radius_px=float(radius))
    for _ in range(_ROUNDS):
        fits = [fit_disc(bob.by(true), bob.look, bob.guess, calibrate=True, turns=8) for bob in bobs]
        sizes = [(fit[_RADIUS], fit[_EDGE]) for fit in fits if fit is not None]
        if not sizes:
            return true
        wide, soft = np.median(sizes, axis=0)
        square = max(true.edge_px**2 + edge**2 - soft**2, _LEAST_EDGE_PX**2)
        true = true._replace(radius_px=float(true.radius_px * radius / wide), edge_px=float(np.sqrt(square)))
    return true


def _shapes(view: View, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
    """(n, 2, 2): from offsets about places in the picture to those that a lens which does not bend would show."""
    straight = view.straight(view.values, x_px, y_px)
    columns = []
    for right, down in ((0.5, 0.0), (0.0, 0.5)):
        ahead = view.bend(view.values, straight[0] + right, straight[1] + down)
        behind = view.bend(view.values, straight[0] - right, straight[1] - down)
        columns.append(np.subtract(ahead, behind))
    return np.linalg.inv(np.array(columns).transpose(2, 1, 0))
