"""The error bars of every frame's place about a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.tracking.clip.band import beyond_band
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.scatter import Factors, late_px, quick_sigma, tamed, true_sigma
from toolkit.tracking.clip.shake import Shake
from toolkit.tracking.clip.unalike import relative_sigma, traits


class ErrorBars(NamedTuple):
    """What the localiser's own σ were multiplied by on the whole (rms), what moves all places of a frame alike (px), beyond what is
    known, and what came of it, (n,) px."""

    x: float
    y: float
    shake_px: float
    sigma_x_px: np.ndarray
    sigma_y_px: np.ndarray


class Bars:
    """What the error bars are told by, whatever the motion: `velocity` (2, n) px/s of the bob, what the clock and the camera may add."""

    def __init__(
        self,
        places: Places,
        shake: Shake,
        velocity: np.ndarray,
        time_sigma_s: float,
        unsteady_px: float,
        slow_px: float,
        even: bool = True,
    ) -> None:
        self.places, self.shake = places, shake
        good = places.good
        self.t_s, self.velocity = places.t_s[good], velocity[:, good]
        self.own = np.array([places.sigma_x_px, places.sigma_y_px])[:, good]
        self.shaken = np.array([shake.x, shake.y])[:, good]
        self.shake_sigma = shake.sigma[good]
        kind, misfit = (None if part is None else part[good] for part in (places.kind, places.misfit))
        uneven = None if even else np.sqrt(self.own[0] * self.own[1])
        self.traits = traits(kind, misfit, uneven, np.array([places.x_px, places.y_px])[:, good], self.velocity)
        self.time_sigma_s, self.unsteady_px, self.slow_px = time_sigma_s, unsteady_px, slow_px

    def about(self, x_px: np.ndarray, y_px: np.ndarray, rough: bool = False, full: bool = False) -> ErrorBars:
        """Those about a motion that has the bob there, (n,); a `rough` one is known to leave much unexplained, a `full` one was seen
        with every camera effect free."""
        good = self.places.good
        rest = np.array([self.places.x_px - x_px, self.places.y_px - y_px])[:, good]
        factors = self._factors(rest, self.own, rough, full)
        unalike = np.ones(self.places.t_s.size)
        if not rough:
            unalike[good] = self._unalike(rest, factors)
            sigma = self.own * unalike[good]
            if factors.wholly and not self.time_sigma_s:  # of the residuals only their mean square is another
                x, y = (_rms(tamed(r / s)) / _rms(tamed(r / o)) for r, s, o in zip(rest, sigma, self.own))
                factors = factors._replace(x=factors.x * x, y=factors.y * y)
            else:
                factors = self._factors(rest, sigma, full=full)
        return ErrorBars(
            factors.x,
            factors.y,
            factors.shake_px,
            self.places.sigma_x_px * factors.x * unalike,
            self.places.sigma_y_px * factors.y * unalike,
        )

    def _factors(self, rest: np.ndarray, own: np.ndarray, rough: bool = False, full: bool = False) -> Factors:
        """What makes the σ `own` agree with the residuals, both (2, n)."""
        found = true_sigma(
            self.t_s,
            rest,
            own,
            self.velocity,
            self.shake_sigma,
            self.time_sigma_s,
            self.unsteady_px,
            rough,
            self.slow_px,
            full,
        )
        if not self.shake.taken:
            return found
        # the picture's own places hold the shake, which is smooth, but not the error with which it was measured
        x, y = quick_sigma(self.t_s, rest + self.shaken, own, self.velocity, self.time_sigma_s)
        left_px = found.shake_px
        if self.shake.by_string:
            # by the string each place is at its length from the pivot, and what strays is along the motion: the camera's roll
            left = float(np.mean(np.sum(rest**2, axis=0))) - float(np.mean(self.shake_sigma**2))
            left_px = float(np.sqrt(max(left, 0.0)))
        return Factors(x, y, left_px)

    def _unalike(self, rest: np.ndarray, factors: Factors) -> np.ndarray:
        """What σ (n,) of frames of different traits are to be multiplied by."""
        sigma = self.own * [[factors.x], [factors.y]]
        if factors.wholly:  # across the motion no clock errs
            ux, uy = self.velocity / (np.hypot(*self.velocity) + 1e-9)
            turned = np.array([[ux, uy], [uy, -ux]])
            variance = np.einsum("ijn,jn->in", turned**2, sigma**2)
            late = np.einsum("ijn,jn->in", turned, self.velocity * self.time_sigma_s) ** 2 / variance
            squares = np.array([tamed(r) for r in np.einsum("ijn,jn->in", turned, rest) / np.sqrt(variance)]) ** 2
            return relative_sigma(
                self.traits, squares.ravel(), lambda v: np.tile(v, (2, 1)), late.ravel(), squares.size
            )
        unit = np.sqrt(sigma[0] * sigma[1])
        beyond = beyond_band(self.t_s, rest + self.shaken, unit)
        mixing = beyond.mixing()
        own = (sigma / unit) ** 2
        late = late_px(self.t_s, self.velocity, rest + self.shaken - unit * beyond.rest, self.time_sigma_s)
        known = mixing((late / unit).T ** 2).T
        squares = np.array([tamed(r) for r in beyond.rest]) ** 2

        def spread(v: np.ndarray) -> np.ndarray:
            return np.concatenate([mixing(o[:, None] * v) for o in own])

        return relative_sigma(self.traits, squares.ravel(), spread, known.ravel(), 2 * beyond.left)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
