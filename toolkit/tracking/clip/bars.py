"""The error bars of every frame's place about a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.tracking.clip.band import beyond_band
from toolkit.tracking.clip.picture_type import factors_of_types
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.scatter import Factors, quick_sigma, tamed, true_sigma
from toolkit.tracking.clip.shake import Shake


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
    ) -> None:
        self.places, self.shake = places, shake
        good = places.good
        self.t_s, self.velocity = places.t_s[good], velocity[:, good]
        self.own = np.array([places.sigma_x_px, places.sigma_y_px])[:, good]
        self.shaken = np.array([shake.x, shake.y])[:, good]
        self.shake_sigma = shake.sigma[good]
        self.kind = None if places.kind is None else places.kind[good]
        self.time_sigma_s, self.unsteady_px, self.slow_px = time_sigma_s, unsteady_px, slow_px

    def about(self, x_px: np.ndarray, y_px: np.ndarray, rough: bool = False, full: bool = False) -> ErrorBars:
        """Those about a motion that has the bob there, (n,); a `rough` one is known to leave much unexplained, a `full` one was seen
        with every camera effect free."""
        good = self.places.good
        rest = np.array([self.places.x_px - x_px, self.places.y_px - y_px])[:, good]
        factors = self._factors(rest, self.own, rough, full)
        of_type = np.ones(self.places.t_s.size)
        if not rough and self.kind is not None and np.ptp(self.kind) > 0:
            of_type[good] = self._of_types(rest, factors)
            sigma = self.own * of_type[good]
            if factors.wholly and not self.time_sigma_s:  # of the residuals only their mean square is another
                x, y = (_rms(tamed(r / s)) / _rms(tamed(r / o)) for r, s, o in zip(rest, sigma, self.own))
                factors = factors._replace(x=factors.x * x, y=factors.y * y)
            else:
                factors = self._factors(rest, sigma, full=full)
        return ErrorBars(
            factors.x,
            factors.y,
            factors.shake_px,
            self.places.sigma_x_px * factors.x * of_type,
            self.places.sigma_y_px * factors.y * of_type,
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

    def _of_types(self, rest: np.ndarray, factors: Factors) -> np.ndarray:
        """What σ (n,) of pictures of different types are to be multiplied by."""
        assert self.kind is not None
        sigma = self.own * [[factors.x], [factors.y]]
        member = (self.kind[:, None] == np.unique(self.kind)).astype(float)
        if factors.wholly:  # across the motion no clock errs
            ux, uy = self.velocity / (np.hypot(*self.velocity) + 1e-9)
            turned = np.array([[ux, uy], [uy, -ux]])
            variance = np.einsum("ijn,jn->in", turned**2, sigma**2)
            late = np.einsum("ijn,jn->in", turned, self.velocity * self.time_sigma_s) ** 2 / variance
            squares = np.array([tamed(r) for r in np.einsum("ijn,jn->in", turned, rest) / np.sqrt(variance)]) ** 2
            return factors_of_types(self.kind, squares.ravel(), np.tile(member, (2, 1)), late.ravel(), squares.size)
        unit = np.sqrt(sigma[0] * sigma[1])
        beyond = beyond_band(self.t_s, rest + self.shaken, unit)
        own = [beyond.mixes((s / unit)[:, None] ** 2 * member) for s in sigma]
        known = beyond.mixes((self.velocity * self.time_sigma_s / unit).T ** 2).T
        squares = np.array([tamed(r) for r in beyond.rest]) ** 2
        return factors_of_types(self.kind, squares.ravel(), np.concatenate(own), known.ravel(), 2 * beyond.left)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
