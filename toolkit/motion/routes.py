"""The integrators as the rest of the house knows them: names, tables, limits, and the layout of the memory they share.

An integrator is given the addresses of eleven arrays, in this order:

    sizes    whole numbers: rows of the equation's memory; lengths of the series of F_θ and F_w (0 absent, 1 constant,
             2 full); switches, holds, timed (0 or 1); sensitivities; samples; order; most steps; addresses of the
             equation's machine code, of its further series, for sensitivities, of its tension, 0 where that is not watched,
             and of the search for the time at which it vanishes
    q        inner constants of the equation, then the coefficients of F
    layout   where each row of the coefficient matrix starts; rows: F, F_θ, F_w, F_τ, sensitivities, error
    columns  the number of F's entries, then which basis function each entry belongs to
    values   the entries
    numbers  fastest rate, θ, w, start, tolerance, units of time in a second, then δθ, δw of each sensitivity at the start
    t        scaled times, increasing, from the start on
    out      to be filled: θ, θ', then δθ, δθ' of each sensitivity, one row of samples each, θ' per second
    report   to be filled: status, steps, events, largest error, then (kind, τ, θ, w) of each event; with the event
             `slack` the run ends
    work     memory to work in
    table    the method's own numbers
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

ROW = 32  # Taylor coefficients kept of each basis function
MIN_ORDER, MAX_ORDER = 8, ROW - 2
SPARE = 24  # numbers of memory for sampling
MOST_EVENTS = 64
DONE, TOO_MANY_STEPS, NOT_FINITE = 0, 1, 2


@dataclass(frozen=True)
class Route:
    """An integrator. first, loosest, floor: tolerances a step: the first per accuracy asked for (the quickest on average over
    random scenes: a looser one must be repeated too often), the loosest per accuracy, and the least.

    work_size : (rows of the equation's memory, sensitivities) -> numbers of working memory.
    stages : evaluations a step, 0 where that is the order of the series.
    """

    kernel: str
    method: str
    table: np.ndarray
    work_size: Callable[[int, int], int]
    stages: int
    first: float
    loosest: float
    floor: float
    most_steps: int = 20_000_000


@cache
def taylor() -> Route:
    """Series of an order chosen by the accuracy."""
    reciprocals = np.array([0.0] + [1.0 / k for k in range(1, ROW + 1)])

    def work_size(rows: int, k: int) -> int:
        return 6 + SPARE + ROW * (4 + 2 * (k + 1) + rows)

    return Route("taylor", "Taylor series of order", reciprocals, work_size, 0, 0.003, 0.025, 1e-17)


@cache
def dop853() -> Route:
    """Runge–Kutta with its interpolant, for terms without a Taylor recurrence."""
    from toolkit.motion.kernels.dop853_table import TABLE

    def work_size(rows: int, k: int) -> int:
        return 4 + rows + 1 + (4 + 2 * k) * (3 + 16 + 7) + 2 * ROW + SPARE

    return Route("dop853", "Runge–Kutta DOP853", TABLE, work_size, 12, 0.1, 0.1, 1e-15)


@cache
def rodas() -> Route:
    """Linearly implicit and L-stable, for strong damping."""
    from toolkit.motion.kernels.rodas_table import TABLE

    return Route(
        "rodas",
        "Rodas4, L-stable",
        TABLE,
        lambda rows, k: 4 + 12 + rows + 1 + 2 * ROW + SPARE,
        6,
        0.1,
        0.1,
        1e-15,
        200_000,
    )
