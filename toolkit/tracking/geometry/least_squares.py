"""Least squares of a few parameters, by Levenberg–Marquardt with forward differences and steps that bend along the valley.

Where data tell little of some combination of parameters, the valley of small residuals is long and curved, and straight
steps creep along it. How the residuals bend along a step costs one look more and turns the step into the valley
(geodesic acceleration: Transtrum and Sethna, arXiv:1201.5885).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

_TRIED = 0.1  # of a step: how the residuals bend is seen over so much of it
_BENT = 0.75  # a bend larger than this share of its step is none to believe
_STRAIGHT = 1e-3  # of the cost: so much less a step, squared, makes of the residuals does not bend
_HOPELESS = 0.3  # of the gain that settles it: a step that promises less is not taken


class Minimum(NamedTuple):
    """Where the sum of squares is least: all parameters, the residuals there, and the normal matrix of the free ones."""

    values: np.ndarray
    rest: np.ndarray
    normal: np.ndarray

    @property
    def chi2(self) -> float:
        """Sum of the squared residuals."""
        return float(self.rest @ self.rest)


@np.errstate(all="ignore")  # a step too far is told by its cost
def least_squares(
    rest: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    steps: np.ndarray,
    free: Sequence[int],
    *,
    turns: int = 25,
    settled: float = 1e-7,
    little: float = 0.0,
    slopes: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Minimum | None:
    """Minimise |rest(values)|² over values[free] from `start`; `steps` are the differences' steps, one a value.

    `slopes` gives d rest / d values[free] where that is to be had more cheaply than by differences of `rest`.
    Ends after `turns` or where a step gains less than the fraction `settled`, or less than `little`. None where numbers are not
    finite.
    """
    index = list(free)
    values = np.array(start, float)
    now = rest(values)
    cost = float(now @ now)
    if not np.isfinite(cost):
        return None
    damping = 1e-3
    jacobian = np.empty((now.size, len(index)))
    normal = np.empty((len(index), len(index)))
    for _ in range(turns):
        if slopes is not None:
            jacobian = slopes(values)
        else:
            for column, i in enumerate(index):
                moved = values.copy()
                moved[i] += steps[i]
                jacobian[:, column] = (rest(moved) - now) / steps[i]
        normal, pull = jacobian.T @ jacobian, jacobian.T @ now
        if not np.all(np.isfinite(normal)):
            return None
        diagonal = normal.diagonal()
        done = False
        for _ in range(8):
            damped = normal.copy()
            damped.flat[:: len(index) + 1] += damping * (diagonal + 1e-300)
            trial = values.copy()
            try:
                step = -np.linalg.solve(damped, pull)
                if -(step @ (2 * pull + normal @ step)) <= _HOPELESS * max(settled * cost, little):
                    done = True
                    break
                if (size := float(step @ (diagonal * step))) > _STRAIGHT * cost:
                    trial[index] += _TRIED * step
                    bend = ((rest(trial) - now) / _TRIED - jacobian @ step) / _TRIED
                    turned = -np.linalg.solve(damped, jacobian.T @ bend)
                    if turned @ (diagonal * turned) <= (_BENT * _BENT) * size:
                        step += turned
                    trial = values.copy()
            except np.linalg.LinAlgError:
                return None
            trial[index] += step
            after = rest(trial)
            trial_cost = float(after @ after)
            if np.isfinite(trial_cost) and trial_cost <= cost:
                done = cost - trial_cost <= max(settled * cost, little)
                values, now, cost = trial, after, trial_cost
                damping = max(damping / 10, 1e-12)
                break
            damping *= 10
        else:
            break
        if done:
            break
    return Minimum(values, now, normal) if np.all(np.isfinite(values)) else None
