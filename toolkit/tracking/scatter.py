"""How much a series scatters, and the factor that makes error bars agree with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_FITS = 2.5  # a motion fits where places stray from it by less than so many times their scatter from frame to frame
_CLOCK = 3.0  # by how much a localiser may be worse along the motion than across it
_MOST = 3.0  # what a fit's own σ may be wrong by in a bad clip
_WORST = 10.0  # beyond this it is not the localiser's
_FREE = 9  # what a fitted motion has taken from the residuals of each axis


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
    rough: bool = False,
) -> Factors:
    """Make the fit's σ agree with the residuals about a motion, all (n,) for x and y over the measured frames, less what the
    shake and the clock are known to add.

    Where the motion fits, its residuals are the localiser's errors, slow ones too (a codec's, a shadow's). Where it does
    not, what changes from frame to frame is the localiser's; the rest is a camera's shake as far as it is across the
    motion, where no pendulum moves and no clock errs. About a `rough` motion, or where a shake was taken away, only what
    changes from frame to frame tells of the localiser.
    """
    (rx, ry), (sx, sy), (vx, vy) = residuals, sigmas, velocity
    speed = np.hypot(vx, vy) + 1e-9
    ux, uy = vx / speed, vy / speed
    across = rx * uy - ry * ux, np.hypot(sx * uy, sy * ux)
    clock = vx * time_sigma_s, vy * time_sigma_s, np.zeros_like(speed)
    found, fits = [], []
    for (r, s), late in zip(((rx, sx), (ry, sy), across), clock):
        known = float(np.mean((np.hypot(late, shake_px) / s) ** 2))
        r = _tamed(r / s) * s  # a few pictures may be of another time
        square = scatter(r / s) ** 2
        near = square - known if square - known > 0.3 * square else np.nan
        whole = float(np.mean((r / s) ** 2)) * r.size / max(r.size - _FREE, 1) - known
        fits.append(whole <= _FITS**2 * near)
        if rough or np.any(shake_px):
            found.append(near)
        else:
            found.append(max(near, whole) if fits[-1] else min(near, scatter(r / s, 7) ** 2))
    own = found[2] if np.isfinite(found[2]) else 1.0
    factors = [f if f <= _CLOCK**2 * own else own for f in found[:2]]  # the rest is the clock's
    r, s = across
    left = 0.0
    if not rough and not fits[2] and np.isfinite(found[2]):
        left = float(np.sqrt(max(np.mean(r**2) - found[2] * np.mean(s**2) - np.mean(shake_px**2), 0.0)))
    x, y = (max(float(np.sqrt(f)), 0.5) if f < _WORST**2 else _MOST for f in factors)
    return Factors(x, y, left)


def _tamed(r: np.ndarray) -> np.ndarray:
    """The series with its strays drawn in to five of its robust standard deviation."""
    most = 5 * 1.4826 * float(np.median(np.abs(r - np.median(r))))
    return np.clip(r, np.median(r) - most, np.median(r) + most)


def scatter(r: np.ndarray, width: int = 15) -> float:
    """Standard deviation of a series (n,) about parabolas through `width` neighbours."""
    if r.size < 2 * width:
        return float(np.sqrt(np.mean(r**2)))
    half = width // 2
    kernel = np.linalg.pinv(np.vander(np.arange(-half, half + 1), 3, increasing=True))[0]
    rest = r[half:-half] - np.convolve(r, kernel[::-1], "valid")
    return float(np.sqrt(np.mean(rest**2) / (1 - kernel[half])))
