"""Solving one equation again and again: what does not change from solve to solve is resolved once."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.motion import routes
from toolkit.trajectory import Event, SolveCost

if TYPE_CHECKING:
    from toolkit.motion.equation import Equation
    from toolkit.motion.routes import Route

START = ("theta0_rad", "omega0_rad_per_s")
_NAMES_OF_EVENTS = ("stick", "slip")


@dataclass(frozen=True)
class Solution:
    """θ and θ' at the times asked for; d_theta and d_omega (n, k) are their derivatives by the k sensitivities.

    `error_estimate_rad` is the estimated largest error of θ over the whole run, all steps' errors carried along.
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
    ):
        t = np.ascontiguousarray(t_s, dtype=float)
        if t.ndim != 1 or (t.size and not (t[0] >= start_s and t[-1] < math.inf and (t[1:] >= t[:-1]).all())):
            raise UsageError(f"times must be one increasing column from {start_s:g} s on; sort them")
        if not accuracy_rad > 0:
            raise UsageError(f"accuracy_rad must be positive, got {accuracy_rad}")
        self.equation, self.t_s, self.accuracy_rad = equation, t, accuracy_rad
        self.sensitivities, self.start_s, self.again = tuple(sensitivities), start_s, again
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
        code = self.equation.code
        if p != self._parameters:
            self._resolve(p)
        scale, accuracy = self._scale, self.accuracy_rad
        start = (float(theta0), float(omega0) * scale)
        run = None
        if self._may_be_stiff and self._is_stiff(start):
            run = self._run(routes.rodas(), start)
            run = run if run is not None and run[1] <= accuracy else None
        if run is None and code.ANALYTIC:
            run = self._run(routes.taylor(), start)
        if run is None:
            run = self._run(routes.dop853(), start)
        if run is None:
            raise JobError("the motion grows without bound or meets a singularity; check the effects' parameters")
        out, error, method, cost, events = run
        if scale != 1.0:
            out[1] *= 1.0 / scale
        d_theta = d_omega = self._none
        if self.sensitivities:
            out[3::2] *= 1.0 / scale
            d_theta, d_omega = out[2::2].T, out[3::2].T
        warnings: tuple[str, ...] = ()
        if not error <= accuracy:
            text = (
                f"asked for {accuracy:.1e} rad, the estimated error is {error:.1e} rad: the motion amplifies rounding"
            )
            warnings = (text,)
        return Solution(self.t_s, out[0], out[1], d_theta, d_omega, method, cost, error, events, warnings)

    def _resolve(self, p: tuple[float, ...]) -> None:
        """What follows from the parameters alone."""
        code = self.equation.code
        scale = 2.0 ** round(0.5 * math.log2(p[0] / p[1]))  # p: length_m, g_m_per_s2, …
        if scale != self._scale:
            self._scale, self._by_route = scale, {}
        self._coefficients = code.coefficients(p, scale)
        self._may_be_stiff = bool(not self.sensitivities and code.ROWS[2] and not code.HOLDS)
        if self._may_be_stiff and code.JACOBIAN_LENGTHS[1] == 1:  # the same for every start
            self._may_be_stiff = self._is_stiff((0.0, 1.0))
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

    def _is_stiff(self, start: tuple[float, float]) -> bool:
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
        self.compile_s = time.process_time() - began
        self.code, self.route, self.scale = code, route, scale
        self.accuracy, self.again = solver.accuracy_rad, solver.again
        layout, columns, self.take = solver.equation.layout(names)
        rows = code.N_WORK if is_series else code.N_BASIS
        self.sizes = np.array(
            [rows, *code.JACOBIAN_LENGTHS, code.SWITCHES, code.HOLDS, code.TIMED, k, solver.t_s.size, 0,
             route.most_steps, address, further], dtype=np.int64,
        )  # fmt: skip
        tau = solver.t_s / scale
        self.q = np.zeros(n_coefficients + len(self.take) + 1)
        self.numbers = np.array([0.0, 0.0, 0.0, solver.start_s / scale, 0.0] + [0.0] * (2 * k))
        for i, name in enumerate(names):
            self.numbers[5 + 2 * i : 7 + 2 * i] = float(name == START[0]), scale if name == START[1] else 0.0
        self.shape = (2 + 2 * k, tau.size)
        self.report, memory = np.empty(4 + 3 * routes.MOST_EVENTS), np.empty(route.work_size(rows, k))
        self.loosest = route.first * self.accuracy
        self.first = max(self.loosest / (1.0 + 0.3 * float(tau[-1] - self.numbers[3])), route.floor)
        arrays = (
            self.sizes, self.q, layout, columns, self.q[code.N_INNER :], self.numbers, tau, tau, self.report, memory,
            route.table,
        )  # fmt: skip
        self.kept = arrays  # in memory, while their addresses are used
        self.places = np.array([array.ctypes.data for array in arrays] + [0], dtype=np.int64)
        self.at, self.scratch = self.places.ctypes.data, self.places[-1:].ctypes.data

    def resolve(self, p: tuple[float, ...], coefficients: tuple[float, ...]) -> None:
        self.q[: len(coefficients)] = coefficients
        if self.take:
            partials = self.code.partials(p, self.scale)
            self.q[len(coefficients) : -1] = [partials[i] for i in self.take]
        self.numbers[0] = self.code.fastest_rate(p, self.scale)

    def run(self, start: tuple[float, float]) -> tuple[np.ndarray, float, str, SolveCost, tuple[Event, ...]] | None:
        """(out, error, method, cost, events); None where the route cannot hold the accuracy, or a term has no series."""
        began = time.process_time()
        route, numbers, accuracy = self.route, self.numbers, self.accuracy
        numbers[1], numbers[2] = start
        out = np.empty(self.shape)
        self.places[7] = out.__array_interface__["data"][0]
        evaluations = total = 0
        tolerance = self.first
        for _attempt in range(6):
            order = 0 if route.stages else min(max(int(4.0 - 0.75 * math.log(tolerance)), 6), routes.MAX_ORDER)
            self.sizes[8], numbers[4] = order, tolerance
            self.integrate(self.scratch, None, self.at)
            status, steps, found, error = self.report[:4].tolist()
            total += int(steps)
            evaluations += int(steps) * (route.stages or order)
            if status != routes.DONE or error <= accuracy or tolerance <= route.floor:
                break
            tolerance = max(tolerance * 0.3 * accuracy / error, route.floor)
        if self.again:
            self.first = (
                max(min(tolerance * 0.3 * accuracy / error, self.loosest), route.floor) if error > 0.0 else tolerance
            )
        if status == routes.TOO_MANY_STEPS and route.kernel != "rodas":
            raise JobError(
                f"the equation needs more than {route.most_steps} steps; shorten the time or soften the stiffest effect"
            )
        if status != routes.DONE:
            return None
        events: tuple[Event, ...] = ()
        if found:
            triples = self.report[4 : 4 + 3 * int(found)].reshape(-1, 3).tolist()
            events = tuple(Event(_NAMES_OF_EVENTS[int(kind)], t * self.scale, angle) for kind, t, angle in triples)
        cost = SolveCost(time.process_time() - began, self.compile_s, evaluations, total)
        self.compile_s = 0.0
        return out, error, route.method if route.stages else f"{route.method} {order}", cost, events
