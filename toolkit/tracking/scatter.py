"""How much a series scatters from frame to frame, and the factor that makes error bars agree with it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

_MOST = 3.0  # by how much a fit's own σ may be too small (noise that a codec has smeared)
_WORST = 10.0  # beyond that it is no localiser's error


class Factors(NamedTuple):
    """What the fits' own σ are to be multiplied by, and what moves all places of a frame alike (px), beyond what is known."""

    x: float
    y: float
    shake_px: float


def true_sigma(
    residuals: tuple[np.ndarray, np.ndarray],
    sigmas: tuple[np.ndarray, np.ndarray],
    velocity: tuple[np.ndarray, np.ndarray],
    shake_px: np.ndarray,
    time_sigma_s: float,
    shaking: bool,
) -> Factors:
    """Make the fit's σ agree with the scatter of the residuals from frame to frame, all (n,) for x and y over the measured
    frames, less what the shake and the clock are known to add. What bends slowly is no error of a frame but of the
    motion assumed, and is taken out.

    Where the camera shakes, or no localiser is that bad, more than `_MOST` times the fit's σ is the shake's.
    """
    (rx, ry), (sx, sy), (vx, vy) = residuals, sigmas, velocity
    speed = np.hypot(vx, vy) + 1e-9
    # the clock's error is along the motion: across it, the scatter is the localiser's own
    across = (rx * vy - ry * vx) / speed, np.hypot(sx * vy, sy * vx) / speed, np.zeros_like(rx)
    found = []
    for r, s, v in ((rx, sx, vx), (ry, sy, vy), across):
        square = scatter(r / s) ** 2
        known = float(np.mean((np.hypot(v * time_sigma_s, shake_px) / s) ** 2))
        found.append(np.sqrt(square - known) if square - known > 0.3 * square else np.nan)
    factors = [f if np.isfinite(f) else found[2] if np.isfinite(found[2]) else 1.0 for f in found[:2]]
    left = [0.0, 0.0]
    for i, s in enumerate((sx, sy)):
        if factors[i] > _MOST and (shaking or factors[i] > _WORST):
            left[i] = float(np.sqrt(factors[i] ** 2 - _MOST**2) * np.median(s))
            factors[i] = _MOST
    return Factors(max(float(factors[0]), 0.5), max(float(factors[1]), 0.5), math.hypot(*left) / math.sqrt(2))


def scatter(r: np.ndarray, width: int = 15) -> float:
    """Standard deviation of a series (n,) about parabolas through `width` neighbours."""
    if r.size < 2 * width:
        return float(np.sqrt(np.mean(r**2)))
    half = width // 2
    kernel = np.linalg.pinv(np.vander(np.arange(-half, half + 1), 3, increasing=True))[0]
    rest = r[half:-half] - np.convolve(r, kernel[::-1], "valid")
    return float(np.sqrt(np.mean(rest**2) / (1 - kernel[half])))
