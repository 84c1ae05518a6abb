"""From a start to the least cost, with every drag ≥ 0.

Our own Levenberg–Marquardt walks there, first on part of the record, because one solution of the equation gives residuals and
Jacobian; lmfit takes over near the minimum, so that what is reported is lmfit's result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.fitting.parameters import DRAGS
from toolkit.fitting.problem import IMPOSSIBLE

if TYPE_CHECKING:
    from toolkit.fitting.problem import Problem

_LEAST_DAMPING, _FIRST_DAMPING = 1e-12, 1e-4
_SETTLED = 5e-3
_FAR = 10.0
_MANY_PERIODS = 16
_POINTS_A_PERIOD = 16
_FEWEST_POINTS = 600


@dataclass(frozen=True)
class Solved:
    """Where one descent ended: parameter values, what the camera should see there, (n,), and the weighted sum of squares.
    lmfit : its result, None for a search of our own.    at_zero : drags that their bound holds."""

    values: dict[str, float]
    seen: np.ndarray
    cost: float
    success: bool
    lmfit: Any = None
    at_zero: tuple[str, ...] = ()


def descend(problem: Problem, begin: Mapping[str, float]) -> Solved | None:
    """The minimum that `begin` leads to. None where the equation cannot be solved there."""
    if problem.loss != "linear":
        return _bounded(problem, begin, polish)
    near = _bounded(problem, _nearer(problem, begin), approach)
    if near is None:
        return None
    free = tuple(name for name in problem.free if name not in near.at_zero)
    found = polish(problem, near.values, free)
    if found is not None and all(found.values[name] >= 0 for name in free if name in DRAGS):
        return replace(found, at_zero=near.at_zero)
    return _bounded(problem, near.values, polish)


def _nearer(problem: Problem, begin: Mapping[str, float]) -> Mapping[str, float]:
    """A start that is far off led nearer by the first quarter of the record, where steps cost a quarter; kept only if all
    of the record agrees."""
    thin = thinned(problem, begin)
    off = distance(thin, begin)
    omega = problem.reduce(begin)[0]["omega_g"]
    if not off > _FAR * problem.point_noise_rad or not omega * problem.series.duration_s > 2 * math.pi * _MANY_PERIODS:
        return begin
    t = thin.series.t_s
    head = _bounded(thin.part(slice(int(np.searchsorted(t, t[0] + 0.25 * (t[-1] - t[0]))))), begin, approach)
    return begin if head is None or not distance(problem, head.values) < off else head.values


def distance(problem: Problem, values: Mapping[str, float]) -> float:
    """Rms distance of the record from the motion at `values`, in rad."""
    free = tuple(name for name in problem.free if name not in held_at_zero(problem, values))  # as the search asks next
    residual, _ = problem.residuals(values, free)
    return float(np.sqrt(np.mean((residual[: len(problem.series)] * problem.sigma) ** 2)))


def search_bounded(problem: Problem, begin: Mapping[str, float]) -> Solved | None:
    """As `descend` for one of many fits whose lmfit result nobody reads."""
    return _bounded(problem, begin, search if problem.loss == "linear" else polish)


def thinned(problem: Problem, values: Mapping[str, float]) -> Problem:
    """Every so many points, enough a period to keep the swing; the problem itself where that saves little."""
    omega = problem.reduce(values)[0]["omega_g"]
    periods = omega * problem.series.duration_s / (2 * math.pi)
    if not math.isfinite(periods):
        return problem
    step = int(len(problem.series) / max(_FEWEST_POINTS, _POINTS_A_PERIOD * periods))
    return problem.every(step) if step > 2 else problem


def approach(problem: Problem, begin: Mapping[str, float], free: tuple[str, ...]) -> Solved | None:
    """A search that leaves the last steps to another: near enough to say which drags are at zero."""
    return search(problem, begin, free, close=0.1, steps=12)


def search(
    problem: Problem, begin: Mapping[str, float], free: tuple[str, ...], close: float = 1e-2, steps: int = 60
) -> Solved | None:
    """At most so many of Levenberg and Marquardt's steps with Nielsen's damping, until the next promises less than `close`
    standard errors. None where the equation cannot be solved at `begin`."""
    values = dict(begin)
    residual, jacobian = problem.residuals(values, free)
    if not residual[0] < IMPOSSIBLE:
        return None
    cost, damping, growth = float(residual @ residual), _LEAST_DAMPING, 2.0
    settled = False
    for _ in range(steps):
        gram, slope = _gram(jacobian), jacobian.T @ residual
        size = np.sqrt(np.diag(gram))
        size = np.where(size > 0, size, 1.0)
        gram, slope = gram / np.outer(size, size), slope / size
        step = -np.linalg.solve(gram + damping * np.eye(len(free)), slope)
        promised = -float(step @ (2 * slope + gram @ step))
        settled = promised <= close**2 * cost / residual.size
        if settled:
            break
        trial = {**values, **{name: values[name] + float(d) for name, d in zip(free, step / size)}}
        ahead, derivatives = problem.residuals(trial, free)
        gain = (cost - float(ahead @ ahead)) / promised
        if gain > 0:
            values, residual, jacobian = trial, ahead, derivatives
            cost = float(residual @ residual)
            damping, growth = max(damping * max(0.01, 1 - (2 * gain - 1) ** 3), _LEAST_DAMPING), 2.0
        else:
            damping, growth = max(damping, _FIRST_DAMPING) * growth, growth * 2
            if damping > 1e8:
                break
    seen = problem.series.theta_rad - residual[: len(problem.series)] * problem.sigma
    return Solved(values, seen, cost, settled)


def _gram(jacobian: np.ndarray, rows: int = 4096) -> np.ndarray:
    """JᵀJ in pieces so small that the matrix library does not wake its threads, which costs more than it brings."""
    pieces = (jacobian[i : i + rows] for i in range(0, jacobian.shape[0], rows))
    return np.asarray(sum(piece.T @ piece for piece in pieces))


def polish(problem: Problem, begin: Mapping[str, float], free: tuple[str, ...]) -> Solved | None:
    """lmfit's minimum from `begin`. None where the equation cannot be solved there."""
    import lmfit

    if not all(math.isfinite(begin[name]) for name in free):
        return None
    held = {name: value for name, value in begin.items() if name not in free}
    last: dict[tuple[float, ...], tuple[np.ndarray, np.ndarray]] = {}

    def evaluate(parameters: Any) -> tuple[np.ndarray, np.ndarray]:
        point = tuple(parameters[name].value for name in free)
        if point not in last:
            while len(last) > 2:
                del last[next(iter(last))]
            last[point] = problem.residuals({**held, **dict(zip(free, point))}, free)
        return last[point]

    parameters = lmfit.Parameters()
    for name in free:
        parameters.add(name, value=begin[name])
    minimizer = lmfit.Minimizer(
        lambda p: evaluate(p)[0], parameters, scale_covar=False, max_nfev=100, nan_policy="propagate"
    )
    with np.errstate(all="ignore"):
        try:
            if problem.loss == "linear":
                outcome = minimizer.minimize(
                    method="leastsq",
                    Dfun=lambda p: evaluate(p)[1].T,
                    col_deriv=1,
                    ftol=1e-7,
                    xtol=1e-9,
                    gtol=_SETTLED / math.sqrt(len(problem.series)),  # the next step promises so many standard errors
                    factor=1.0,
                )
            else:
                sizes = np.linalg.norm(evaluate(parameters)[1], axis=0)
                outcome = minimizer.minimize(
                    method="least_squares",
                    jac=lambda p: evaluate(p)[1],
                    loss=problem.loss,
                    f_scale=_loss_scale(problem),
                    x_scale=1 / np.where(sizes > 0, sizes, 1.0),
                )
        except (ValueError, TypeError, FloatingPointError, np.linalg.LinAlgError, ArithmeticError):
            return None
        residual, _ = evaluate(outcome.params)
    if not np.all(np.isfinite(residual)) or residual[0] >= IMPOSSIBLE:
        return None
    values = {**held, **{name: float(outcome.params[name].value) for name in free}}
    seen = problem.series.theta_rad - residual[: len(problem.series)] * problem.sigma
    return Solved(values, seen, float(residual @ residual), bool(outcome.success), outcome)


def _loss_scale(problem: Problem) -> float:
    if problem.sigma_known:
        return 1.345
    return 1.345 * problem.point_noise_rad / float(np.median(problem.sigma))


def held_at_zero(problem: Problem, values: Mapping[str, float]) -> tuple[str, ...]:
    """The drags that start at zero wait there until the fit asks for them, all but the first of a drag-free start."""
    drags = [name for name in problem.free if name in DRAGS]
    zero = [name for name in drags if not values[name] > 0]
    return tuple(zero[1:] if len(zero) == len(drags) else zero)


_Minimise = Callable[["Problem", Mapping[str, float], tuple[str, ...]], Solved | None]


def _bounded(problem: Problem, begin: Mapping[str, float], minimise: _Minimise) -> Solved | None:
    """The least cost with every drag ≥ 0, by Lawson and Hanson's active set: drags that come out negative are held at
    zero, and of those held the one is freed that promises most, until none promises anything."""
    zero = held_at_zero(problem, begin)
    values = {n: max(v, 0.0) if n in DRAGS and n in problem.free else v for n, v in begin.items()}
    best: Solved | None = None
    for _ in range(12):
        found = minimise(problem, values, tuple(name for name in problem.free if name not in zero))
        if found is None:
            return best
        negative = tuple(n for n in problem.free if n in DRAGS and n not in zero and found.values[n] < 0)
        zero += negative
        if negative:
            values = _moved_to_zero(problem, found.values, negative, zero)
            continue
        values = found.values
        if best is not None and found.cost >= best.cost:
            return best
        best = replace(found, at_zero=zero)
        wanted = _wanted(problem, found, zero)
        if wanted is None:
            return best
        zero = tuple(name for name in zero if name != wanted)
    return best


def _moved_to_zero(
    problem: Problem, values: Mapping[str, float], drags: tuple[str, ...], zero: tuple[str, ...]
) -> dict[str, float]:
    """`drags` at zero and the free parameters moved along, to first order, so that the motion stays as near as can be."""
    nothing = dict.fromkeys(drags, 0.0)
    residual, jacobian = problem.residuals(values, problem.free)
    rest = [i for i, name in enumerate(problem.free) if name not in zero]
    if not residual[0] < IMPOSSIBLE:
        return {**values, **nothing}
    own = jacobian[:, rest]
    size = np.linalg.norm(own, axis=0)
    size = np.where(size > 0, size, 1.0)
    taken = sum(jacobian[:, problem.free.index(name)] * values[name] for name in drags)
    change = np.linalg.lstsq(own / size, taken, rcond=1e-10)[0] / size
    return {**values, **nothing, **{problem.free[i]: values[problem.free[i]] + float(d) for i, d in zip(rest, change)}}


def _wanted(problem: Problem, found: Solved, zero: tuple[str, ...]) -> str | None:
    """Which of the drags held at zero would lower the cost most if it grew, to first order; None where none would."""
    if not zero:
        return None
    residual, jacobian = problem.residuals(found.values, problem.free)
    if not residual[0] < IMPOSSIBLE:
        return None
    own = jacobian[:, [i for i, name in enumerate(problem.free) if name not in zero]]
    size = np.linalg.norm(own, axis=0)
    basis, _ = np.linalg.qr(own / np.where(size > 0, size, 1.0))
    gains = {}
    for name in zero:
        column = jacobian[:, problem.free.index(name)]
        column = column - basis @ (basis.T @ column)
        slope, length2 = float(column @ residual), float(column @ column)
        gains[name] = slope**2 / length2 if slope < 0 and length2 > 0 else 0.0
    wanted = max(gains, key=lambda name: gains[name])
    return wanted if gains[wanted] > 1e-3 * found.cost / residual.size else None
