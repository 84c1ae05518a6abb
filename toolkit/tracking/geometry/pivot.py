"""Where the string is held: the centre of the bob's arc, and the point in which the string's lines meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.geometry.swing import fit_circle


@dataclass(frozen=True)
class PivotEstimate:
    """A pivot (x, y) in px with its (2, 2) covariance, how it was found, and the goodness of that fit."""

    xy: np.ndarray
    covariance: np.ndarray
    method: str
    reduced_chi2: float = 1.0

    @property
    def sigma_px(self) -> tuple[float, float]:
        """Standard uncertainties of x and y."""
        return float(np.sqrt(self.covariance[0, 0])), float(np.sqrt(self.covariance[1, 1]))


def arc_pivot(x: np.ndarray, y: np.ndarray, sx: np.ndarray, sy: np.ndarray) -> PivotEstimate | None:
    """The centre of the arc through points (n,) with standard uncertainties; None where they do not bend."""
    cx, cy, radius, _ = fit_circle(x, y, 1 / (sx * sy))
    if not np.isfinite(radius):
        return None
    ux, uy = (x - cx) / radius, (y - cy) / radius
    sigma = np.hypot(ux * sx, uy * sy)
    rest = (np.hypot(x - cx, y - cy) - radius) / sigma
    jacobian = np.column_stack([-ux, -uy, -np.ones(x.size)]) / sigma[:, None]
    chi2 = float(rest @ rest) / max(1, x.size - 3)
    try:
        covariance = np.linalg.inv(jacobian.T @ jacobian) * max(1.0, chi2)
    except np.linalg.LinAlgError:
        return None
    return PivotEstimate(np.array([cx, cy]), covariance[:2, :2], said("pivot.arc", "the arc of the bob"), chi2)


def line_pivot(x: np.ndarray, y: np.ndarray, angle: np.ndarray, sigma: np.ndarray) -> PivotEstimate | None:
    """The point nearest to lines (n,) through (x, y) with direction `angle` (rad from the downward image axis,
    positive to the right) and `sigma` (px) their distance errors at the pivot. None for fewer than 8 lines."""
    if x.size < 8:
        return None
    nx, ny = np.cos(angle), -np.sin(angle)
    offset = nx * x + ny * y
    weight = 1 / sigma**2
    for _ in range(6):
        normal = np.array(
            [[np.sum(weight * nx * nx), np.sum(weight * nx * ny)], [np.sum(weight * nx * ny), np.sum(weight * ny * ny)]]
        )
        try:
            covariance = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        xy = covariance @ np.array([np.sum(weight * nx * offset), np.sum(weight * ny * offset)])
        rest = (nx * xy[0] + ny * xy[1] - offset) / sigma
        spread = 1.4826 * np.median(np.abs(rest)) + 1e-12
        weight = np.where(np.abs(rest) < 4 * spread, 1 / sigma**2, 0.0)
    used = weight > 0
    chi2 = float(np.sum(rest[used] ** 2)) / max(1, int(used.sum()) - 2)
    return PivotEstimate(xy, covariance * max(1.0, chi2), said("pivot.lines", "the string's lines"), chi2)
