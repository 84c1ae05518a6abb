"""The equation of motion of the active effects, and its solution by the route that suits it."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import ModuleType
from typing import Any

import numpy as np

from toolkit.effects import load_effect
from toolkit.effects.effect import Effect, Term
from toolkit.effects.formula import formula_needs, formula_parameters
from toolkit.errors import JobError, UsageError
from toolkit.motion.blocks import blocks
from toolkit.motion.symbols import (
    SCENE_SYMBOLS,
    Latex,
    Symbols,
    latex_functions,
    number_functions,
    symbols,
    sympy_functions,
)
from toolkit.registry import did_you_mean
from toolkit.trajectory import Event, SolveCost

START = ("theta0_rad", "omega0_rad_per_s")
_VERSION = 5  # of the generated code: a change here makes old caches unused


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


@dataclass(frozen=True)
class Equation:
    """One equation of motion, made of the active effects and of nothing else. Make it with `build_equation`."""

    effects: tuple[Effect, ...]
    small_angle: bool = False
    formula_text: str = ""
    _memory: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Full names of all parameters: the scene's first, then "effect.parameter"."""
        names = ["length_m", "g_m_per_s2"]
        for effect in self.effects:
            needs = (*effect.needs, *formula_needs(self.formula_text)) if effect.name == "formula" else effect.needs
            names += [name for name in needs if name not in names]
        for effect in self.effects:
            own = (
                formula_parameters(self.formula_text)
                if effect.name == "formula"
                else [p.name for p in effect.parameters]
            )
            names += [f"{effect.name}.{name}" for name in own]
        return tuple(names)

    @cached_property
    def is_linear(self) -> bool:
        """Linear in θ and θ' with constant coefficients and at most one cosine drive: there is a closed form."""
        drives = sum(e.name == "cosine_drive" for e in self.effects)
        return self.small_angle and all(e.linear for e in self.effects) and drives <= 1

    @cached_property
    def is_bare(self) -> bool:
        """The pendulum alone, with nothing acting on it: the exact solution is known."""
        return not self.small_angle and all(e.name == "slack_string" for e in self.effects)

    @cached_property
    def latex(self) -> str:
        """The equation of motion as LaTeX, printed by the same terms that are compiled."""
        names = dict(SCENE_SYMBOLS)
        for effect in self.effects:
            names |= {f"{effect.name}.{p.name}": p.symbol or rf"\mathrm{{{p.name}}}" for p in effect.parameters}
        for name in self.parameters:
            if name.startswith("formula."):
                plain = name.removeprefix("formula.")
                names[name] = plain if len(plain) == 1 else rf"\mathrm{{{plain}}}".replace("_", r"\_")
        values = {name: Latex(text) for name, text in names.items()}
        state = {"t": Latex("t"), "theta": Latex(r"\theta"), "omega": Latex(r"\dot\theta")}
        torque, inertia, _, harmonics = self._sum(
            symbols(latex_functions(), state, values, self.effects, self.small_angle, self.formula_text)
        )
        for h in harmonics:
            torque = torque + h.amplitude * latex_functions()["cos"](
                2 * Latex(r"\pi") * h.f_hz * Latex("t") + h.phase_rad
            )
        return rf"{inertia.at(1)}\,\ddot\theta = {torque.text}"

    def terms_at(self, parameters: Mapping[str, float], t_s: Any, theta_rad: Any, omega_rad_per_s: Any) -> Motion:
        """Torque, inertia, tension and energy at states, as numbers or arrays. Raises UsageError for a missing parameter."""
        values = dict(zip(self.parameters, self._values(parameters)))
        values.setdefault("mass_kg", parameters.get("mass_kg", 1.0))
        state = {"t": t_s, "theta": theta_rad, "omega": omega_rad_per_s}
        return self._motion(
            symbols(number_functions(), state, values, self.effects, self.small_angle, self.formula_text)
        )

    def tension_and_energy(
        self, parameters: Mapping[str, float], t_s: np.ndarray, theta_rad: np.ndarray, omega_rad_per_s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tension (N) and energy (J) along a motion: as `terms_at`, without evaluating what does not enter them."""
        values = dict(zip(self.parameters, self._values(parameters)))
        values["mass_kg"] = mass = parameters["mass_kg"]
        length, g = values["length_m"], values["g_m_per_s2"]
        tension, energy = np.empty(t_s.size), np.empty(t_s.size)
        for part in blocks(t_s.size):
            t, theta, omega = t_s[part], theta_rad[part], omega_rad_per_s[part]
            square = omega * omega
            rise = theta * theta / 2 if self.small_angle else 1.0 - np.cos(theta)
            inertia, pull, stored = mass * length**2, (mass * length) * square + (mass * g) * (1.0 - rise), 0.0
            if self._observed:
                functions, state = number_functions(), {"t": t, "theta": theta, "omega": omega}
                seen = symbols(functions, state, values, self.effects, self.small_angle, self.formula_text)
                for effect in self._observed:
                    term = effect.term(seen[effect.name])
                    inertia, pull, stored = inertia + term.inertia, pull + term.radial_force, stored + term.energy
            tension[part], energy[part] = pull, (mass * g * length) * rise + stored + (inertia / 2) * square
        return tension, energy

    @cached_property
    def _sampled(self) -> list[tuple[Effect, Term]]:
        """The effects (but `formula`, a torque and nothing else) with their terms for a motion of ones."""
        values = dict.fromkeys((*self.parameters, "mass_kg"), 1.0)
        state = {"t": 0.1, "theta": 0.2, "omega": 0.3}
        seen = symbols(number_functions(), state, values, self.effects, self.small_angle, self.formula_text)
        return [(effect, effect.term(seen[effect.name])) for effect in self.effects if effect.name != "formula"]

    @cached_property
    def _observed(self) -> tuple[Effect, ...]:
        """The effects that enter tension or energy."""
        nothing = Term()
        return tuple(e for e, t in self._sampled if (t.inertia, t.radial_force, t.energy) != (nothing.inertia, 0, 0))

    def _motion(self, seen: dict[str, Symbols]) -> Motion:
        s = seen[""]
        torque, inertia, terms, harmonics = self._sum(seen)
        for h in harmonics:
            torque = torque + h.amplitude * s.cos(2 * s.pi * h.f_hz * s.t + h.phase_rad)
        swing = s.mass_kg * s.length_m * s.omega**2
        tension = swing + s.mass_kg * s.g_m_per_s2 * (1 - s.rise)
        energy = inertia * s.omega**2 / 2 + s.mass_kg * s.g_m_per_s2 * s.length_m * s.rise
        for term in terms:
            tension, energy = tension + term.radial_force, energy + term.energy
        return Motion(torque, inertia, tension, energy)

    def flight(self, parameters: Mapping[str, float]) -> Flight:
        """What moves the bob while the string is slack: gravity less buoyancy, drag, and the shaking of the frame."""
        values = dict(zip(self.parameters, self._values(parameters)))
        mass, g, length = (values[n] for n in ("mass_kg", "g_m_per_s2", "length_m"))
        drags = [effect for effect, term in self._sampled if not isinstance(term.drag, int)]
        names = {e.name for e in self.effects}
        moving = [e for e in self.effects if e.pivot is not None]
        displaced = carried = 0.0
        if names & {"buoyancy", "added_mass"}:
            displaced = 4 / 3 * math.pi * values["bob_radius_m"] ** 3 * values["fluid_density_kg_per_m3"]
        functions = number_functions()
        state = {"t": 0.0, "theta": 0.0, "omega": 0.0}
        if "added_mass" in names:
            at_rest = symbols(functions, state, values, self.effects, False, self.formula_text)
            carried = float(load_effect("added_mass").term(at_rest["added_mass"]).inertia) / length**2
        inertia = mass + carried
        weight = (mass - (displaced if "buoyancy" in names else 0.0)) / inertia
        if not drags and not moving:
            return Flight(g * weight, None)

        def acceleration(t: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
            seen = symbols(functions, {**state, "t": t}, values, self.effects, False, self.formula_text)
            pivot = seen[""].pivot
            against = velocity + np.array(pivot.velocity) if pivot is not None else velocity
            speed = float(np.hypot(*against))
            drag = sum(float(e.term(seen[e.name].of({"speed": speed, "velocity": speed})).drag) for e in drags)
            total = np.array([0.0, -g * weight]) - drag / inertia * against
            return total - np.array(pivot.acceleration) if pivot is not None else total

        return Flight(g * weight, acceleration)

    def fastest_rad_per_s(self, parameters: Mapping[str, float]) -> float:
        """The highest angular frequency with which time itself enters the equation, 0 where it does not."""
        values = dict(parameters)
        return max([2 * math.pi * values[n] for n in self.parameters if n.endswith(".f_hz")], default=0.0)

    def _sum(self, seen: dict[str, Symbols]) -> tuple[Any, Any, list[Term], list[Any]]:
        s = seen[""]
        torque = -(s.mass_kg * s.g_m_per_s2 * s.length_m * s.sin_theta)
        inertia = s.mass_kg * s.length_m**2
        terms = [effect.term(seen[effect.name]) for effect in self.effects]
        for term in terms:
            torque, inertia = torque + term.torque - term.drag * (s.length_m * s.velocity), inertia + term.inertia
        return torque, inertia, terms, [term.harmonic for term in terms if term.harmonic is not None]

    def _values(self, parameters: Mapping[str, float]) -> tuple[float, ...]:
        try:
            return tuple([float(parameters[name]) for name in self.parameters])
        except KeyError as error:
            name = error.args[0]
            raise UsageError(
                f"the equation needs {name}; give it a value{did_you_mean(name, list(parameters))}"
            ) from None

    # -- the generated module ------------------------------------------------------------------------------------

    @cached_property
    def code(self) -> ModuleType:
        """The generated module: from the disk if it was written before, else derived now."""
        from toolkit.motion import compiled

        def fingerprint(effect: Effect) -> tuple[str, str]:
            import inspect

            return effect.name, inspect.getsource(inspect.getmodule(effect.term))  # type: ignore[arg-type]

        name = "equation_" + compiled.key_of(
            _VERSION, [fingerprint(e) for e in self.effects], self.small_angle, self.formula_text
        )
        module = compiled.load(name)
        if module is None:
            compiled.listener("compiling the equation of motion (once; later runs find it ready)")
            compiled.place(name, self._derive())
            module = compiled.load(name)
        if module is None:
            raise JobError(
                f"cannot keep compiled equations in {compiled.cache_folder()}; set PENDULAB_CACHE to a folder"
            )
        return module

    @property
    def source(self) -> str:
        """The generated source code."""
        from pathlib import Path

        return Path(str(self.code.__file__)).read_text(encoding="utf-8")

    def _derive(self) -> str:
        import sympy as sp

        from toolkit.motion.generate import write_source

        signed = {
            f"{e.name}.{p.name}" for e in self.effects for p in e.parameters if p.minimum is None or p.minimum < 0
        }
        signed |= {n for n in self.parameters if n.startswith("formula.")}
        known = {
            n: sp.Symbol(n, real=True) if n in signed else sp.Symbol(n, positive=True)
            for n in (*self.parameters, "mass_kg")
        }
        theta, w, tau = sp.symbols("theta w tau", real=True)
        scale = sp.Symbol("scale", positive=True)
        state = {"t": scale * tau, "theta": theta, "omega": w / scale}
        motion = self._motion(
            symbols(sympy_functions(), state, known, self.effects, self.small_angle, self.formula_text)
        )
        names = {"theta": theta, "w": w, "tau": tau, "scale": scale, "parameters": known}
        return write_source(self.parameters, motion.torque, motion.inertia, names, self.latex)

    @cached_property
    def _jet(self) -> tuple[int, float]:
        from toolkit.motion import compiled

        began = time.process_time()
        address = compiled.jet_address(self.code)
        return address, time.process_time() - began

    # -- solving -------------------------------------------------------------------------------------------------

    def solve(
        self,
        parameters: Mapping[str, float],
        theta0_rad: float,
        omega0_rad_per_s: float,
        t_s: Any,
        accuracy_rad: float = 1e-9,
        sensitivities: Sequence[str] = (),
        start_s: float = 0.0,
    ) -> Solution:
        """θ(t) from the state at `start_s`, to within `accuracy_rad`.

        parameters : values by full name (see `parameters`; more may be given).    t_s : (n,) increasing times in s,
        not before start_s.    sensitivities : names of parameters, "theta0_rad" or "omega0_rad_per_s".
        Raises UsageError for a missing parameter or an unknown sensitivity, JobError where the motion leaves all bounds.
        """
        t = np.ascontiguousarray(t_s, dtype=float)
        if t.ndim != 1 or (t.size and not (t[0] >= start_s and t[-1] < math.inf and (t[1:] >= t[:-1]).all())):
            raise UsageError(f"times must be one increasing column from {start_s:g} s on; sort them")
        if not accuracy_rad > 0:
            raise UsageError(f"accuracy_rad must be positive, got {accuracy_rad}")
        p = self._values(parameters)
        names = tuple(sensitivities)
        if t.size == 0:
            return Solution(
                t, t, t, np.empty((0, len(names))), np.empty((0, len(names))), "nothing to do", SolveCost(), 0.0
            )
        exact = self._solve_exactly(p, theta0_rad, omega0_rad_per_s, t, accuracy_rad, names, start_s)
        if exact is not None:
            return exact
        return self._integrate(p, theta0_rad, omega0_rad_per_s, t, accuracy_rad, names, start_s)

    def _layout(self, sensitivities: tuple[str, ...]) -> tuple[Any, ...]:
        """Where the rows of the coefficient matrix lie for these sensitivities; made once."""
        known = self._memory.get(sensitivities)
        if known is not None:
            return known
        code = self.code
        rows, start = [list(row) for row in code.ROWS], [0]
        take: list[int] = []
        offsets = np.concatenate([[0], np.cumsum([len(row) for row in code.PARTIAL_ROWS])])
        for name in sensitivities:
            if name in START:
                rows.append([])
            elif name in self.parameters:
                i = self.parameters.index(name)
                rows.append(list(code.PARTIAL_ROWS[i]))
                take += range(offsets[i], offsets[i + 1])
            elif name in SCENE_SYMBOLS:
                rows.append([])  # it cancels from this equation
            else:
                raise UsageError(
                    f"no parameter {name!r} in this equation{did_you_mean(name, [*self.parameters, *START])}"
                )
        rows.append([])  # of the error, which nothing forces
        for row in rows:
            start.append(start[-1] + len(row))
        columns = np.array([len(rows[0]), *[c for row in rows for c in row]], dtype=np.int64)
        made = (np.array(start, dtype=np.int64), columns, take)
        self._memory[sensitivities] = made
        return made

    def _reduced(self, p: Sequence[complex]) -> tuple[complex, ...]:
        """(restoring, damping, drive, f, phase) of  θ'' = −restoring·sin θ − damping·θ' + drive·cos(2πft + phase).

        Only for effects declared linear; p may be complex (for derivatives).
        """
        values = dict(zip(self.parameters, p))
        values.setdefault("mass_kg", 1.0)

        def torque(theta: float, omega: float) -> tuple[complex, complex, list[Any]]:
            state = {"t": 0.0, "theta": theta, "omega": omega}
            seen = symbols(number_functions(), state, values, self.effects, self.small_angle, self.formula_text)
            total, inertia, _, harmonics = self._sum(seen)
            return total, inertia, harmonics

        deflected, inertia, harmonics = torque(1.0, 0.0)
        restoring = -deflected / inertia / (1.0 if self.small_angle else math.sin(1.0))
        damping = -torque(0.0, 1.0)[0] / inertia
        if not harmonics:
            return restoring, damping, 0.0, 0.0, 0.0
        return restoring, damping, harmonics[0].amplitude / inertia, harmonics[0].f_hz, harmonics[0].phase_rad

    def _solve_exactly(
        self, p: tuple[float, ...], theta0: float, omega0: float, t: np.ndarray, accuracy: float,
        sensitivities: tuple[str, ...], start_s: float,
    ) -> Solution | None:  # fmt: skip
        """The closed form of the linear equation, or the elliptic solution of the bare pendulum; None where neither fits."""
        if not self._may_be_exact:
            return None
        began = time.process_time()
        restoring, damping, drive, f_hz, phase = (float(v.real) for v in self._reduced(p))
        if not restoring > 0:
            return None
        rate = math.sqrt(restoring)
        if not self.small_angle:
            if damping != 0 or drive != 0 or sensitivities:
                return None
            from toolkit.motion.elliptic import solve_pendulum

            exact = solve_pendulum(t - start_s, theta0, omega0, rate)
            none = np.empty((t.size, 0))
            cost = SolveCost(time.process_time() - began)
            error = 4e-16 * (abs(theta0) + math.pi + abs(float(exact.theta_rad[-1])))
            return Solution(
                t, exact.theta_rad, exact.omega_rad_per_s, none, none, "exact: elliptic functions", cost, error
            )
        from toolkit.motion.closed_form import solve_linear

        turn = 2 * math.pi * f_hz
        inputs = ("alpha_per_s", "omega_g_rad_per_s", "drive_rad_per_s2", "omega_f_rad_per_s", "phase_rad")
        wanted = (*START, *inputs) if sensitivities else ()
        solved = solve_linear(
            t - start_s, theta0, omega0, damping / 2, rate, drive, turn, phase + turn * start_s, derivatives=wanted
        )
        chain = np.zeros((len(wanted), len(sensitivities)))
        for column, name in enumerate(sensitivities):
            if name in START:
                chain[START.index(name), column] = 1.0
            elif name in self.parameters:
                step = 1e-30  # complex step: the derivative to the last digit
                moved = [v + 1j * step if n == name else v for n, v in zip(self.parameters, p)]
                k, d, a, f, ph = (complex(v).imag / step for v in self._reduced(moved))
                by_turn = 2 * math.pi * f
                chain[2:, column] = d / 2, k / (2 * rate), a, by_turn, ph + by_turn * start_s
            elif name not in SCENE_SYMBOLS:
                raise UsageError(
                    f"no parameter {name!r} in this equation{did_you_mean(name, [*self.parameters, *START])}"
                )
        cost = SolveCost(time.process_time() - began)
        error = 1e-15 * (1 + float(np.abs(solved.theta_rad).max()))
        shape = (t.size, len(sensitivities))
        by_theta = solved.d_theta @ chain if sensitivities else np.empty(shape)
        by_omega = solved.d_omega @ chain if sensitivities else np.empty(shape)
        method = "exact: closed form of the linear equation"
        return Solution(t, solved.theta_rad, solved.omega_rad_per_s, by_theta, by_omega, method, cost, error)

    @cached_property
    def _may_be_exact(self) -> bool:
        kinds = [e for e in self.effects if e.name != "slack_string"]
        if self.is_linear:
            return True
        return not self.small_angle and all(e.linear and e.name not in ("linear_drag", "cosine_drive") for e in kinds)

    @cached_property
    def _terms(self) -> tuple[int, float]:
        from toolkit.motion import compiled

        began = time.process_time()
        address = compiled.terms_address(self.code)
        return address, time.process_time() - began

    def _integrate(
        self, p: tuple[float, ...], theta0: float, omega0: float, t: np.ndarray, accuracy: float,
        sensitivities: tuple[str, ...], start_s: float,
    ) -> Solution:  # fmt: skip
        code = self.code
        scale = 2.0 ** round(0.5 * math.log2(p[0] / p[1]))  # p: length_m, g_m_per_s2, …
        layout, columns, take = self._layout(sensitivities)
        coefficients = code.coefficients(p, scale)
        entries = coefficients[code.N_INNER :]
        if take:
            partials = code.partials(p, scale)
            entries += tuple([partials[i] for i in take])
        k = len(sensitivities)
        numbers = [code.fastest_rate(p, scale), float(theta0), float(omega0) * scale, start_s / scale, 0.0]
        for name in sensitivities:
            numbers += [float(name == START[0]), scale if name == START[1] else 0.0]
        task = _Task(
            np.array(coefficients or (0.0,)), layout, columns, np.array(entries or (0.0,)), np.array(numbers),
            t if scale == 1.0 else t / scale, np.empty((2 + 2 * k, t.size)),
        )  # fmt: skip
        result = None
        if not k and self._is_stiff(task, coefficients):
            from toolkit.motion import rodas

            result = self._run(rodas, task, accuracy)
            result = None if result is None or result.error > accuracy else result
        if result is None and code.ANALYTIC:
            from toolkit.motion import taylor

            result = self._run(taylor, task, accuracy)
        if result is None:
            from toolkit.motion import dop853

            result = self._run(dop853, task, accuracy)
        if result is None:
            raise JobError("the motion grows without bound or meets a singularity; check the effects' parameters")
        out = task.out
        if scale != 1.0:
            out[1] /= scale
            out[3::2] /= scale
        events = tuple(Event(("stick", "slip")[int(e[0])], float(e[1] * scale), float(e[2])) for e in result.events)
        warnings: tuple[str, ...] = ()
        if result.error > accuracy:
            text = f"asked for {accuracy:.1e} rad, the estimated error is {result.error:.1e} rad: the motion amplifies rounding"
            warnings = (text,)
        return Solution(
            t, out[0], out[1], out[2::2].T, out[3::2].T, result.method, result.cost,
            result.error, events, warnings,
        )  # fmt: skip

    def _run(self, route: ModuleType, task: _Task, accuracy: float) -> _Result | None:
        """By one route; None where that cannot hold the accuracy, or where a term has no series."""
        from toolkit.motion import compiled, taylor

        code, is_taylor = self.code, route is taylor
        address, compile_s = self._jet if is_taylor else self._terms
        began = time.process_time()
        integrate = compiled.integrator(route)
        compile_s += time.process_time() - began
        began = time.process_time()
        k, rows = (task.numbers.size - 5) // 2, code.N_WORK if is_taylor else code.N_BASIS
        sizes = np.array(
            [rows, *code.JACOBIAN_LENGTHS, code.SWITCHES, code.HOLDS, code.TIMED, k, task.tau.size, 0, route.MOST_STEPS]
        )
        report, work = np.empty(4 + 3 * taylor.MOST_EVENTS), np.empty(route.work_size(rows, k))
        arrays = (
            task.q, sizes, task.layout, task.columns, task.values, task.numbers, task.tau, task.out, report, work,
            route.TABLE,
        )  # fmt: skip
        places = [array.ctypes.data for array in arrays]
        tolerance = max(route.FIRST * accuracy / (1.0 + 0.3 * float(task.tau[-1] - task.numbers[3])), route.FLOOR)
        evaluations = total = 0
        for _attempt in range(6):
            order = min(max(int(1.5 - 0.7 * math.log(tolerance)), 6), taylor.MAX_ORDER)
            sizes[8], task.numbers[4] = order, tolerance
            integrate(address, *places)
            status, steps, found, error = report[:4].tolist()
            total += int(steps)
            evaluations += int(steps) * (order if is_taylor else route.STAGES)
            if status != taylor.DONE or error <= accuracy or tolerance <= route.FLOOR:
                break
            tolerance = max(tolerance * 0.3 * accuracy / error, route.FLOOR)
        if status == taylor.TOO_MANY_STEPS and route.MOST_STEPS == taylor.MOST_STEPS:
            raise JobError(
                f"the equation needs more than {route.MOST_STEPS} steps; shorten the time or soften the stiffest effect"
            )
        if status != taylor.DONE:
            return None
        cost = SolveCost(time.process_time() - began, compile_s, evaluations, total)
        method = f"Taylor series of order {order}" if is_taylor else route.METHOD
        return _Result(error, method, cost, report[4 : 4 + 3 * int(found)].reshape(-1, 3))

    def _is_stiff(self, task: _Task, entries: tuple[float, ...]) -> bool:
        """Does the velocity decay so much faster than the motion that an explicit method would crawl?"""
        code = self.code
        if code.HOLDS or not code.ROWS[2]:
            return False
        basis = [0.0] * code.N_BASIS
        try:
            code.terms(entries, (task.numbers[3], task.numbers[1], max(abs(task.numbers[2]), 1.0), 1.0), basis)
        except ArithmeticError:  # a singularity at the start: the integrators deal with it
            return False
        first = code.N_INNER + len(code.ROWS[0]) + len(code.ROWS[1])
        decay = -sum([entries[first + i] * basis[column] for i, column in enumerate(code.ROWS[2])])
        return decay > 30 and decay * (float(task.tau[-1]) - task.numbers[3]) > 3000


@dataclass(frozen=True)
class _Task:
    """What an integrator is given, in scaled time; `out` and `events` are filled by it."""

    q: np.ndarray
    layout: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    numbers: np.ndarray  # rate, θ, w, start, tolerance, and δθ, δw of each sensitivity at the start
    tau: np.ndarray
    out: np.ndarray


@dataclass(frozen=True)
class _Result:
    error: float
    method: str
    cost: SolveCost
    events: np.ndarray  # (m, 3): kind, τ, θ


@dataclass(frozen=True)
class Flight:
    """Free flight: the downward pull in m/s², and the whole acceleration (t, position, velocity) where there is more."""

    g_m_per_s2: float
    acceleration: Any


@dataclass(frozen=True)
class Motion:
    """Torque (N·m), inertia (kg·m²), string tension (N) and energy (J, zero at rest at the bottom) of states."""

    torque: Any
    inertia: Any
    tension: Any
    energy: Any


@lru_cache(maxsize=128)
def _equation(names: tuple[str, ...], small_angle: bool, formula_text: str) -> Equation:
    return Equation(tuple(load_effect(name) for name in names), small_angle, formula_text)


def build_equation(
    effects: Sequence[str] = (), small_angle: bool = False, formulas: Mapping[str, str] | None = None
) -> Equation:
    """The equation of motion of the named effects, in any order; the same call gives the same equation.

    formulas : {"formula": "-a * theta**3"}, the torque of the effect `formula` where that is named.
    Raises UsageError for an unknown effect or a formula that is not allowed.
    """
    text = (formulas or {}).get("formula", "")
    if "formula" in effects:
        from toolkit.effects.formula import formula_parameters

        if not text:
            raise UsageError('the effect "formula" needs its text: formulas={"formula": "-a*theta**3"}')
        formula_parameters(text)
    return _equation(tuple(sorted(set(effects))), bool(small_angle), text)
