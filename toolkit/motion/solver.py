"""Solving one equation again and again: what does not change from solve to solve is resolved once."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from ctypes import addressof, c_double, c_int64
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.motion import routes
from toolkit.motion.compiled import address
from toolkit.trajectory import Event, SolveCost

if TYPE_CHECKING:
    from toolkit.motion.equation import Equation
    from toolkit.motion.routes import Route

START = ("theta0_rad", "omega0_rad_per_s")
_NAMES_OF_EVENTS = ("stick", "slip", "slack")


class Solution(NamedTuple):
    """θ and θ' at the times asked for; d_theta and d_omega (n, k) are their derivatives by the k sensitivities.

    `error_estimate_rad` is the estimated largest error of θ over the whole run, all steps' errors carried along. `spare` is
    (rows, n) of memory for the caller to fill: what shares one block with the solution is not fetched from the system anew.
    """

    t_s: np.ndarray
    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    d_theta: np.ndarray
    d_omega: np.ndarray
    method: str
    cost: SolveCost
    error_estimate_rad: float
    events: tuple[Event, ...] = ()
    warnings: tuple[str, ...] = ()
    spare: np.ndarray | None = None


class Solver:
    """An equation prepared for given times, accuracy and sensitivities; make it with `Equation.prepare`.

    `solve` takes parameters and start; parameters that are those of the last call are not worked out again. It keeps its
    working memory (so it is not for two threads at once) and, if it is to be called `again`, begins with the tolerance that would have
    done in the last call, and compiles what pays only then.
    """

    def __init__(
        self,
        equation: Equation,
        t_s: Any,
        accuracy_rad: float,
        sensitivities: Sequence[str] = (),
        start_s: float = 0.0,
        again: bool = True,
        spare_rows: int = 0,
        until_slack: bool = False,
    ):
        t = np.ascontiguousarray(t_s, dtype=float)
        if t.ndim != 1 or (t.size and not (t[0] >= start_s and t[-1] < math.inf and (t[1:] >= t[:-1]).all())):
            raise UsageError(f"times must be one increasing column from {start_s:g} s on; sort them")
        if not accuracy_rad > 0:
            raise UsageError(f"accuracy_rad must be positive, got {accuracy_rad}")
        self.equation, self.t_s, self.accuracy_rad = equation, t, accuracy_rad
        self.sensitivities, self.start_s, self.again = tuple(sensitivities), start_s, again
        self.spare_rows, self.until_slack = spare_rows, until_slack
        self._none = np.empty((t.size, 0))
        self._parameters: tuple[float, ...] = ()
        self._scale = 0.0  # seconds in a unit of the integrators' time: a power of two, so that scaling rounds nothing
        self._coefficients: tuple[float, ...] = ()
        self._by_route: dict[str, _Work] = {}

    def solve(self, parameters: Mapping[str, float], theta0_rad: float, omega0_rad_per_s: float) -> Solution:
        """θ(t) from the state at the start. Raises as `Equation.solve` does."""
        equation = self.equation
        p = equation.values(parameters)
        if not self.t_s.size:
            return Solution(self.t_s, self.t_s, self.t_s, self._none, self._none, "nothing to do", SolveCost(), 0.0)
        if equation.may_be_exact:
            from toolkit.motion.exact import solve_exactly

            exact = solve_exactly(
                equation, p, theta0_rad, omega0_rad_per_s, self.t_s, self.sensitivities, self.start_s, self.again
            )
            if exact is not None:
                return exact
        return self.integrate(p, theta0_rad, omega0_rad_per_s)

    def integrate(self, p: tuple[float, ...], theta0: float, omega0: float) -> Solution:
        """The same by an integrator, whether or not there is an exact route."""
        if p != self._parameters:
            self._resolve(p)
        start = (float(theta0), float(omega0) * self._scale)
        run = None
        if self._may_be_stiff and (self._is_stiff or self._stiff_from(start)):
            run = self._run(routes.rodas(), start)
            run = run if run is not None and run[1] <= self.accuracy_rad else None
        if run is None and self.equation.code.ANALYTIC:
            run = self._run(routes.taylor(), start)
        if run is None:
            run = self._run(routes.dop853(), start)
        if run is None:
            raise JobError("the motion grows without bound or meets a singularity; check the effects' parameters")
        out, error, method, cost, events = run
        d_theta = d_omega = self._none
        solved = len(out) - self.spare_rows
        if self.sensitivities:
            d_theta, d_omega = out[2:solved:2].T, out[3:solved:2].T
        warnings: tuple[str, ...] = ()
        if not error <= self.accuracy_rad:
            text = f"asked for {self.accuracy_rad:.1e} rad, the estimated error is {error:.1e} rad: the motion amplifies rounding"
            warnings = (text,)
        spare = out[solved:] if self.spare_rows else None
        return Solution(self.t_s, out[0], out[1], d_theta, d_omega, method, cost, error, events, warnings, spare)

    def _resolve(self, p: tuple[float, ...]) -> None:
        """What follows from the parameters alone."""
        code = self.equation.code
        scale = 2.0 ** round(0.5 * math.log2(p[0] / p[1]))  # p: length_m, g_m_per_s2, …
        if scale != self._scale:
            self._scale, self._by_route = scale, {}
        self._coefficients = code.coefficients(p, scale)
        followed = self.sensitivities or self.until_slack  # what the stiff route cannot do
        self._may_be_stiff = bool(not followed and code.ROWS[2] and not code.HOLDS)
        self._is_stiff = False
        if self._may_be_stiff and code.JACOBIAN_LENGTHS[1] == 1:  # the same for every start
            self._may_be_stiff = self._is_stiff = self._stiff_from((0.0, 1.0))
        self._parameters = p
        for work in self._by_route.values():
            work.resolve(p, self._coefficients)

    def _run(self, route: Route, start: tuple[float, float]) -> Any:
        work = self._by_route.get(route.kernel)
        if work is None:
            work = _Work(self, route, self._scale, len(self._coefficients))
            work.resolve(self._parameters, self._coefficients)
            self._by_route[route.kernel] = work
        return work.run(start)

    def _stiff_from(self, start: tuple[float, float]) -> bool:
        """Does the velocity decay so much faster than the motion that an explicit method would crawl?"""
        code, coefficients = self.equation.code, self._coefficients
        basis, begin = [0.0] * code.N_BASIS, self.start_s / self._scale
        try:
            code.terms(coefficients, (begin, start[0], max(abs(start[1]), 1.0), 1.0), basis)
        except ArithmeticError:  # a singularity at the start: the integrators deal with it
            return False
        first = code.N_INNER + len(code.ROWS[0]) + len(code.ROWS[1])
        decay = -sum([coefficients[first + i] * basis[column] for i, column in enumerate(code.ROWS[2])])
        return decay > 30 and decay * (float(self.t_s[-1]) / self._scale - begin) > 3000


def _wholes(*numbers: int) -> Any:
    return (c_int64 * len(numbers))(*numbers)


_OUT_OF_KERNEL = 11  # the place after the eleven arrays: where a kernel's empty result goes


class _Work:
    """The memory of one route, laid out as `routes` says, and the addresses of it."""

    def __init__(self, solver: Solver, route: Route, scale: float, n_coefficients: int):
        from toolkit.motion import compiled

        began = time.process_time()
        code, names = solver.equation.code, solver.sensitivities
        k, is_series = len(names), route.kernel == "taylor"
        self.integrate = compiled.kernel(route.kernel)
        address = compiled.series(code, "jet") if is_series else compiled.terms(code)
        further = compiled.series(code, "more") if is_series and k else 0
        watched = (compiled.terms(code, "tension"), compiled.slack_search()) if solver.until_slack else (0, 0)
        self.compile_s = time.process_time() - began
        self.code, self.route, self.scale = code, route, scale
        self.accuracy, self.again = solver.accuracy_rad, solver.again
        layout, columns, self.take = solver.equation.layout(names)
        rows = code.N_WORK if is_series else code.N_BASIS
        count = solver.t_s.size
        tau = solver.t_s / scale
        self.sizes = _wholes(
            rows, *code.JACOBIAN_LENGTHS, code.SWITCHES, code.HOLDS, code.TIMED, k, count, 0,
            route.most_steps, address, further, *watched,
        )  # fmt: skip
        self.q = (c_double * (n_coefficients + len(self.take)))()
        self.numbers = (c_double * (6 + 2 * k))(0.0, 0.0, 0.0, solver.start_s / scale, 0.0, 1.0 / scale)
        for i, name in enumerate(names):
            self.numbers[6 + 2 * i] = float(name == START[0])
            self.numbers[7 + 2 * i] = scale if name == START[1] else 0.0
        self.shape = (2 + 2 * k + solver.spare_rows, count)
        self.report = (c_double * (4 + 4 * routes.MOST_EVENTS))()
        self.loosest = route.loosest * self.accuracy
        span = 1.0 + 0.3 * float(tau[count - 1] - self.numbers[3]) if is_series or route.stages > 6 else 1.0
        self.first, self.settled = max(route.first * self.accuracy / span, route.floor), False
        self.tolerance = 0.0
        arrays = (layout, columns, tau, np.empty(route.work_size(rows, k)), route.table)
        self.kept = arrays  # in memory, while their addresses are used
        at_layout, at_columns, at_tau, at_memory, at_table = (array.ctypes.data for array in arrays)
        at_q = addressof(self.q)
        self.places = _wholes(
            addressof(self.sizes), at_q, at_layout, at_columns, at_q + 8 * code.N_INNER, addressof(self.numbers), at_tau, 0,
            addressof(self.report), at_memory, at_table, 0,
        )  # fmt: skip
        self.at = addressof(self.places)
        self.scratch = self.at + 8 * _OUT_OF_KERNEL

    def resolve(self, p: tuple[float, ...], coefficients: tuple[float, ...]) -> None:
        self.q[: len(coefficients)] = list(coefficients)
        if self.take:
            partials = self.code.partials(p, self.scale)
            self.q[len(coefficients) :] = [partials[i] for i in self.take]
        self.numbers[0] = self.code.fastest_rate(p, self.scale)

    def _aim(self, tolerance: float) -> None:
        """The tolerance of the steps to come, and the order of the series that suits it."""
        self.tolerance = self.numbers[4] = tolerance
        self.stages, self.method = self.route.stages, self.route.method
        if not self.stages:
            self.stages = min(max(int(4.0 - 0.8 * math.log(tolerance)), routes.MIN_ORDER), routes.MAX_ORDER)
            self.method += f" {self.stages}"
        self.sizes[8] = self.stages

    def run(self, start: tuple[float, float]) -> tuple[np.ndarray, float, str, SolveCost, tuple[Event, ...]] | None:
        """(out, error, method, cost, events); None where the route cannot hold the accuracy, or a term has no series."""
        began = time.process_time()
        route, accuracy = self.route, self.accuracy
        self.numbers[1], self.numbers[2] = start
        out = np.empty(self.shape)
        self.places[7] = address(out)
        evaluations = total = 0
        tolerance = began_with = self.first
        for _attempt in range(6):
            if tolerance != self.tolerance:
                self._aim(tolerance)
            self.integrate(self.scratch, None, self.at)
            status, steps, found, error = self.report[:4]
            total += int(steps)
            evaluations += int(steps) * self.stages
            if status != routes.DONE or error <= accuracy or tolerance <= route.floor:
                break
            tolerance = max(tolerance * 0.1 * accuracy / error, route.floor)
        if self.again:
            self.first = tolerance
            if tolerance != began_with:
                self.settled = True  # a looser one has failed
            elif 0.0 < error < 0.1 * accuracy and not self.settled:
                self.first = max(min(tolerance * 0.3 * accuracy / error, self.loosest), route.floor)
        if status == routes.TOO_MANY_STEPS and route.kernel != "rodas":
            raise JobError(
                f"the equation needs more than {route.most_steps} steps; shorten the time or soften the stiffest effect"
            )
        if status != routes.DONE:
            return None
        events: tuple[Event, ...] = ()
        if found:
            each = zip(*[iter(self.report[4 : 4 + 4 * int(found)])] * 4)
            events = tuple(
                Event(_NAMES_OF_EVENTS[int(k)], t * self.scale, angle, w / self.scale) for k, t, angle, w in each
            )
        cost = SolveCost(time.process_time() - began, self.compile_s, evaluations, total)
        self.compile_s = 0.0
        return out, error, self.method, cost, events
