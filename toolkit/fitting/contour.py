"""Δχ² over two parameters with all others fitted anew: the true contour, beside the covariance's ellipse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.errors import UsageError
from toolkit.fit import FitResult
from toolkit.fitting.parameters import DRAGS
from toolkit.fitting.problem import IMPOSSIBLE
from toolkit.registry import did_you_mean


@dataclass(frozen=True)
class Contour:
    """Values of two parameters on a net (m, m) along the axes of their covariance, and Δχ² there over the noise's inflation:
    2.30, 6.18 and 11.83 bound 68.3, 95.4 and 99.7 %. NaN where a drag would be negative or no motion exists."""

    names: tuple[str, str]
    first: np.ndarray
    second: np.ndarray
    delta_chi2: np.ndarray


def contour(result: FitResult, first: str, second: str, reach: float = 3.0, count: int = 21) -> Contour:
    """Profile of χ² over `first` and `second`, out to `reach` standard errors along each axis, with an odd `count` of places.

    At every place the others begin where the covariance leads them and take one step of Gauss and Newton with the analytic
    derivatives: one solution a place. Raises UsageError for names that are not free or a fit that failed.
    """
    for name in (first, second):
        if name not in result.free or first == second:
            raise UsageError(f"a contour needs two free parameters, got {name!r}{did_you_mean(name, result.free)}")
    if result.problem is None or not np.all(np.isfinite(result.covariance)):
        raise UsageError(f"the fit of {result.model} failed ({result.message}); it has no contour")
    problem, covariance = result.problem, np.asarray(result.covariance)
    pair = [result.free.index(first), result.free.index(second)]
    others = [i for i in range(len(result.free)) if i not in pair]
    best = {name: p.value for name, p in result.parameters.items()}
    block = covariance[np.ix_(pair, pair)]
    size = np.sqrt(np.diag(block))
    eigenvalue, axes = np.linalg.eigh(block / np.outer(size, size))
    axes = axes * np.sqrt(np.maximum(eigenvalue, 1e-12)) * size[:, None]
    follow = covariance[np.ix_(others, pair)] @ np.linalg.pinv(block, rcond=1e-12)
    steps = np.linspace(-reach, reach, count)
    net = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1) @ axes.T
    cost = np.full((count, count), np.nan)
    for place in np.ndindex(count, count):
        moved = dict(best)
        for i, change in zip([*pair, *others], [*net[place], *(follow @ net[place])]):
            moved[result.free[i]] += float(change)
        if any(moved[name] < 0 for name in (first, second) if name in DRAGS):
            continue
        residual, jacobian = problem.residuals(moved, result.free)
        if residual[0] < IMPOSSIBLE:
            own = jacobian[:, others]
            length = np.linalg.norm(own, axis=0)
            basis, _ = np.linalg.qr(own / np.where(length > 0, length, 1.0))
            cost[place] = residual @ residual - np.sum((basis.T @ residual) ** 2)
    weight = float(result.noise["inflation"]) ** 2 * (
        1.0 if problem.sigma_known else float(result.noise["sigma_rad"]) ** 2
    )
    delta = (cost - problem.cost_at(best, ())) / weight
    return Contour((first, second), best[first] + net[..., 0], best[second] + net[..., 1], delta)
