"""How much a series scatters from frame to frame, and the factor that makes error bars agree with it."""

from __future__ import annotations

import numpy as np


def true_sigma(r: np.ndarray, s: np.ndarray, good: np.ndarray, others: np.ndarray) -> float:
    """The factor that makes the fit's σ `s` agree with the scatter of the residuals `r` from frame to frame, less that of
    `others` (the shake, the clock). What bends slowly is no error of a frame but of the motion assumed, and is taken out."""
    square = scatter(r[good] / s[good]) ** 2
    known = float(np.mean((others[good] / s[good]) ** 2))
    return float(np.sqrt(max(square - known, 0.5 * square, 0.25)))


def scatter(r: np.ndarray, width: int = 15) -> float:
    """Standard deviation of a series (n,) about parabolas through `width` neighbours."""
    if r.size < 2 * width:
        return float(np.sqrt(np.mean(r**2)))
    half = width // 2
    kernel = np.linalg.pinv(np.vander(np.arange(-half, half + 1), 3, increasing=True))[0]
    rest = r[half:-half] - np.convolve(r, kernel[::-1], "valid")
    return float(np.sqrt(np.mean(rest**2) / (1 - kernel[half])))
