"""The equation of motion of the active effects, and its solution by the route that suits it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from ctypes import addressof, c_double
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from operator import itemgetter
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from toolkit.effects import load_effect
from toolkit.effects.effect import Effect, Term
from toolkit.effects.formula import formula_needs, formula_parameters
from toolkit.errors import JobError, UsageError
from toolkit.motion.blocks import blocks
from toolkit.motion.compiled import address, call, kernel
from toolkit.motion.solver import START, Solution, Solver
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

_recent = threading.local()  # each thread's last solver: fits ask for the same times again and again


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
        values = dict(zip(self.parameters, self.values(parameters)))
        values.setdefault("mass_kg", parameters.get("mass_kg", 1.0))
        state = {"t": t_s, "theta": theta_rad, "omega": omega_rad_per_s}
        return self._motion(
            symbols(number_functions(), state, values, self.effects, self.small_angle, self.formula_text)
        )

    def tension_and_energy(
        self,
        parameters: Mapping[str, float],
        t_s: np.ndarray,
        theta_rad: np.ndarray,
        omega_rad_per_s: np.ndarray,
        compiled: bool = False,
        into: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tension (N) and energy (J) along a motion: as `terms_at`, without evaluating what does not enter them.

        compiled : by machine code, where no effect but gravity and inertia enters; θ and θ' must be writable.
        into : (2, n) to be filled, rather than new memory.
        """
        mass, length, g = parameters["mass_kg"], parameters["length_m"], parameters["g_m_per_s2"]
        both = np.empty((2, t_s.size)) if into is None else into
        tension, energy = both
        if compiled and t_s.size and not self._observed and not self.small_angle:
            numbers = (c_double * 5)(t_s.size, mass * length, mass * g, mass * g * length, mass * length**2 / 2)
            first, second = address(both), address(both) + both.strides[0]
            call(kernel("observe"), addressof(numbers), address(theta_rad), address(omega_rad_per_s), first, second)
            return tension, energy
        values = dict(zip(self.parameters, self.values(parameters)))
        values["mass_kg"] = mass
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
    def sampled_terms(self) -> list[tuple[Effect, Term]]:
        """The effects (but `formula`, a torque and nothing else) with their terms for a motion of ones."""
        values = dict.fromkeys((*self.parameters, "mass_kg"), 1.0)
        state = {"t": 0.1, "theta": 0.2, "omega": 0.3}
        seen = symbols(number_functions(), state, values, self.effects, self.small_angle, self.formula_text)
        return [(effect, effect.term(seen[effect.name])) for effect in self.effects if effect.name != "formula"]

    @cached_property
    def _observed(self) -> tuple[Effect, ...]:
        """The effects that enter tension or energy."""
        nothing = Term()
        return tuple(
            e for e, t in self.sampled_terms if (t.inertia, t.radial_force, t.energy) != (nothing.inertia, 0, 0)
        )

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

    def values(self, parameters: Mapping[str, float]) -> tuple[float, ...]:
        """The values of `parameters`, in order. Raises UsageError for one that is missing."""
        try:
            return self._take(parameters)
        except KeyError as error:
            name = error.args[0]
            raise UsageError(
                f"the equation needs {name}; give it a value{did_you_mean(name, list(parameters))}"
            ) from None

    @cached_property
    def _take(self) -> Callable[[Mapping[str, float]], tuple[float, ...]]:
        return itemgetter(*self.parameters)  # at least two: length and gravity

    # -- the generated module ------------------------------------------------------------------------------------

    @cached_property
    def code(self) -> ModuleType:
        """The generated module: from the disk if it was written before, else derived now."""
        from toolkit.motion import compiled

        def fingerprint(effect: Effect) -> tuple[str, str]:
            import inspect

            return effect.name, inspect.getsource(inspect.getmodule(effect.term))  # type: ignore[arg-type]

        writers = [(Path(__file__).parent / f"{n}.py").read_bytes() for n in ("equation", "symbols", "generate", "jet")]
        effects = [fingerprint(effect) for effect in self.effects]
        name = "equation_" + compiled.key_of(writers, effects, self.small_angle, self.formula_text)
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
        pull = motion.tension if any(e.name == "slack_string" for e in self.effects) else None
        return write_source(self.parameters, motion.torque, motion.inertia, names, self.latex, pull)

    # -- solving -------------------------------------------------------------------------------------------------

    def prepare(
        self, t_s: Any, accuracy_rad: float = 1e-9, sensitivities: Sequence[str] = (), start_s: float = 0.0
    ) -> Solver:
        """A solver for these times, accuracy and sensitivities (see `solve`), to be called with many parameters and starts."""
        return Solver(self, t_s, accuracy_rad, sensitivities, start_s)

    def solve(
        self,
        parameters: Mapping[str, float],
        theta0_rad: float,
        omega0_rad_per_s: float,
        t_s: Any,
        accuracy_rad: float = 1e-9,
        sensitivities: Sequence[str] = (),
        start_s: float = 0.0,
        spare_rows: int = 0,
    ) -> Solution:
        """θ(t) from the state at `start_s`, to within `accuracy_rad`.

        parameters : values by full name (see `parameters`; more may be given).    t_s : (n,) increasing times in s,
        not before start_s.    sensitivities : names of parameters, "theta0_rad" or "omega0_rad_per_s".    spare_rows : see `Solution`.
        Raises UsageError for a missing parameter or an unknown sensitivity, JobError where the motion leaves all bounds.
        """
        t = np.ascontiguousarray(t_s, dtype=float)
        asked = (self, accuracy_rad, tuple(sensitivities), start_s, spare_rows)
        known = getattr(_recent, "solver", None)
        if known is None or _recent.asked != asked or not np.array_equal(t, known.t_s):
            # t is copied: whoever called may change it
            known = _recent.solver = Solver(
                self, t.copy(), accuracy_rad, asked[2], start_s, again=False, spare_rows=spare_rows
            )
            _recent.asked = asked
        return known.solve(parameters, theta0_rad, omega0_rad_per_s)

    def index_of(self, name: str) -> int | None:
        """The place of a parameter, None for one that cancels from this equation. Raises UsageError for an unknown one."""
        if name in self.parameters:
            return self.parameters.index(name)
        if name in SCENE_SYMBOLS:
            return None
        raise UsageError(f"no parameter {name!r} in this equation{did_you_mean(name, [*self.parameters, *START])}")

    def layout(self, sensitivities: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """Where the rows of the coefficient matrix start, the column of each entry, and which partials it takes; made once."""
        known = self._memory.get(sensitivities)
        if known is not None:
            return known
        code = self.code
        rows, start = [list(row) for row in code.ROWS], [0]
        take: list[int] = []
        offsets = np.concatenate([[0], np.cumsum([len(row) for row in code.PARTIAL_ROWS])])
        for name in sensitivities:
            i = None if name in START else self.index_of(name)
            rows.append([] if i is None else list(code.PARTIAL_ROWS[i]))
            if i is not None:
                take += range(offsets[i], offsets[i + 1])
        rows.append([])  # of the error, which nothing forces
        for row in rows:
            start.append(start[-1] + len(row))
        columns = np.array([len(rows[0]), *[c for row in rows for c in row]], dtype=np.int64)
        made = self._memory[sensitivities] = (np.array(start, dtype=np.int64), columns, take)
        return made

    def reduced(self, p: Sequence[complex]) -> tuple[complex, ...]:
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

    def reduced_numbers(self, p: tuple[float, ...]) -> tuple[float, ...]:
        """`reduced` for real parameters; the last ones are remembered."""
        known = self._memory.get("reduced")
        if known is None or known[0] != p:
            known = self._memory["reduced"] = (p, tuple([float(v.real) for v in self.reduced(p)]))
        return known[1]

    @cached_property
    def may_be_exact(self) -> bool:
        """Linear, or bare but for effects that change inertia and weight alone: see `exact`."""
        kinds = [e for e in self.effects if e.name != "slack_string"]
        if self.is_linear:
            return True
        return not self.small_angle and all(e.linear and e.name not in ("linear_drag", "cosine_drive") for e in kinds)


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
