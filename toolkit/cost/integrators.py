"""Work and precision: our routes beside SciPy's integrators on seven problems, against a truth that neither made."""

from __future__ import annotations

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.progress import Progress, silent
from toolkit.scene import Approximations, Environment, Pendulum, Release, Scene

_G = 9.8
OURS = ("solve", "simulate")
PEERS = ("RK45", "DOP853", "LSODA", "Radau", "odeint")


@dataclass(frozen=True)
class Problem:
    """A motion to be solved. stiff: explicit methods of SciPy would need a minute; quick_s: its length in a quick run."""

    name: str
    what: str
    scene: Scene
    duration_s: float
    samples: int
    quick_s: float
    stiff: bool = False

    @property
    def t_s(self) -> np.ndarray:
        """(samples,) times."""
        return np.linspace(0.0, self.duration_s, self.samples)

    def shortened(self) -> Problem:
        """The same motion for a quick run, with the same sampling."""
        share = self.quick_s / self.duration_s
        return replace(self, duration_s=self.quick_s, samples=round((self.samples - 1) * share) + 1)


@dataclass(frozen=True)
class Run:
    """One method at one setting: largest error of θ over the judged samples, CPU of the best repetition, evaluations."""

    problem: str
    method: str
    setting: float
    error_rad: float
    cpu_ms: float
    evaluations: int
    route: str = ""


@dataclass(frozen=True)
class Measured:
    """All runs, and the CPU seconds of a first call in a fresh process: never compiled, and compiled before."""

    problems: tuple[Problem, ...]
    runs: tuple[Run, ...]
    first_call_s: dict[str, float] = field(default_factory=dict)


def problems() -> tuple[Problem, ...]:
    """P1–P5 of the project's measurements, a driven one near resonance (D) and a slack string (S)."""
    bare = Scene(Pendulum(mass_kg=0.25, length_m=0.5), Release(1.0), Environment(g_m_per_s2=_G))
    light, unit = Pendulum(0.05, 0.5), Pendulum(1.0, 1.0)
    omega_g = math.sqrt(_G / 0.5)
    one = Environment(g_m_per_s2=1.0)
    paper = {"linear_drag": {"k_d_kg_per_s": 0.16}, "cosine_drive": {"f0_n": 0.15, "f_hz": 0.15, "phase_rad": 0.0}}
    third = 2 / 3 / (2 * math.pi)
    chaos = {"linear_drag": {"k_d_kg_per_s": 0.5}, "cosine_drive": {"f0_n": 1.5, "f_hz": third, "phase_rad": 0.0}}
    driven = {
        "linear_drag": {"k_d_kg_per_s": 0.02},
        "cosine_drive": {"f0_n": 0.03, "f_hz": 0.96 / (2 * math.pi), "phase_rad": 0.0},
    }
    return (
        Problem("P1", "the paper's: drag and drive, θ₀ = 1", bare.with_(effects=paper), 10.0, 1001, 10.0),
        Problem("P2", "bare, θ₀ = 3.1", bare.with_(release=Release(3.1)), 60.0, 6001, 60.0),
        Problem("P3", "quadratic drag, θ₀ = 1", bare.with_(pendulum=light, effects={"quadratic_drag": {"c_kg_per_m": 3e-4}}), 120.0, 28801, 10.0),
        Problem("P4", "overdamped 1000×", bare.with_(effects={"linear_drag": {"k_d_kg_per_s": 500 * omega_g}}), 100.0, 1001, 5.0, stiff=True),
        Problem("P5", "chaos: q = 2, A = 1.5, ω_D = 2/3", Scene(unit, Release(0.2), one, chaos), 100.0, 1001, 100.0),
        Problem("D", "driven on the bistable branch, Q = 50", Scene(unit, Release(0.0), one, driven), 200.0, 2001, 50.0),
        Problem("S", "slack string: v² = 3gℓ at the bottom", bare.with_(release=Release(0.0, math.sqrt(3 * _G / 0.5)), effects={"slack_string": {}}), 5.0, 501, 5.0),
        Problem("L", "the paper's with small angles", bare.with_(effects=paper, approximations=Approximations(small_angle=True)), 10.0, 1001, 10.0),
    )  # fmt: skip


def random_problem(seed: int, number: int) -> Problem:
    """A random scene, the same for the same numbers: drags and a drive of any strength, swings, turns and near-standing starts.

    Its motion is known to many digits (see `true_angles`); it spans 1 to 20 natural periods and 5 to 1500 samples.
    """
    random = np.random.default_rng([seed, number])
    mass, length, g = 10 ** random.uniform(-2, 0), 10 ** random.uniform(-1, 0.5), random.uniform(1, 20)
    rate = math.sqrt(g / length)
    effects: dict[str, dict[str, float]] = {}
    if random.random() < 0.5:
        effects["linear_drag"] = {"k_d_kg_per_s": 2 * mass * rate * 10 ** random.uniform(-4, 1)}
    if random.random() < 0.5:
        effects["quadratic_drag"] = {"c_kg_per_m": mass / length * 10 ** random.uniform(-4, 0.5)}
    if random.random() < 0.4:
        f0, f = mass * g * 10 ** random.uniform(-2, 0.5), rate / (2 * math.pi) * 10 ** random.uniform(-1, 0.5)
        effects["cosine_drive"] = {"f0_n": f0, "f_hz": f, "phase_rad": 0.0}
    start = random.uniform(-3.1, 3.1) if random.random() < 0.7 else float(random.choice([0.0, 1e-3, 3.14159, 1e-9]))
    push = 0.0 if random.random() < 0.6 else 2 * rate * random.normal()
    scene = Scene(Pendulum(mass, length), Release(start, push), Environment(g_m_per_s2=g), effects)
    duration, samples = 2 * math.pi / rate * random.uniform(1, 20), int(random.integers(5, 1500))
    return Problem(f"random {seed}/{number}", ", ".join(effects) or "bare", scene, duration, samples, duration)


def measure(folder: str | Path, quick: bool = False, progress: Progress = silent) -> str:
    """Measure, write integrators.csv, ratios.csv, integrators.txt and work_precision.png/.svg into `folder`; return the text."""
    folder = Path(folder)
    measured = measure_integrators(quick, progress)
    progress("writing", 0.97)
    with (folder / "integrators.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["problem", "method", "setting", "error_rad", "cpu_ms", "evaluations", "route"])
        for r in measured.runs:
            writer.writerow(
                [r.problem, r.method, f"{r.setting:g}", f"{r.error_rad:.3g}", f"{r.cpu_ms:.4g}", r.evaluations, r.route]
            )
    table = ratios(measured)
    with (folder / "ratios.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["problem", "error_rad", *_RATIO_COLUMNS])
        writer.writerows(
            [[r["problem"], f"{r['error_rad']:.2g}", *(_cell(r[c]) for c in _RATIO_COLUMNS)] for r in table]
        )
    text = _describe(measured, table, quick)
    (folder / "integrators.txt").write_text(text + "\n", encoding="utf-8")
    _draw(measured, folder / "work_precision")
    return text


def measure_integrators(quick: bool = False, progress: Progress = silent) -> Measured:
    """Run every method at every setting on every problem."""
    chosen = tuple(p.shortened() if quick else p for p in problems())
    runs: list[Run] = []
    for i, problem in enumerate(chosen):
        progress(f"{problem.name}: the truth", i / (len(chosen) + 1))
        judged, truth = true_angles(problem)
        methods: list[tuple[str, Callable[[float], tuple[np.ndarray, int, str]], list[float]]] = [
            (name, _ours(name, problem), [10.0**-k for k in range(3, 13)]) for name in OURS
        ]
        # close to one another, so that a peer is not charged for accuracy that nobody asked of it
        tolerances = [10.0 ** (-k / 2) for k in range(6, 27, 2 if quick else 1)]
        methods += [(name, _peer(name, problem), tolerances) for name in _peers_for(problem)]
        for j, (name, solve, settings) in enumerate(methods):
            progress(f"{problem.name}: {name}", (i + j / len(methods)) / (len(chosen) + 1))
            for setting in settings:
                run = _timed(problem.name, name, setting, solve, judged, truth, name in OURS, quick)
                if run is not None:
                    runs.append(run)
                if run is not None and run.cpu_ms > (500 if quick else 2_000):
                    break  # tighter settings of this method would cost more than they tell
    progress("first calls in fresh processes, compiling", len(chosen) / (len(chosen) + 1))
    return Measured(chosen, tuple(runs), first_calls(("P1", "L") if quick else ("P1", "P2", "L")))


def _peers_for(problem: Problem) -> tuple[str, ...]:
    return (
        ("LSODA", "Radau", "odeint")
        if problem.stiff
        else PEERS
        if "slack_string" not in problem.scene.effects
        else PEERS[:4]
    )


def _timed(
    problem: str, method: str, setting: float, solve: Callable[[float], tuple[np.ndarray, int, str]],
    judged: np.ndarray, truth: np.ndarray, ours: bool, quick: bool,
) -> Run | None:  # fmt: skip
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # peers warn of tolerances below rounding: the error tells
        began = time.process_time()
        try:
            theta, evaluations, route = solve(setting)
        except (ValueError, ArithmeticError, RuntimeError, MemoryError):
            return None  # a peer that gives up at this tolerance has no point on the plot
        if theta.size <= judged[-1]:
            return None
        limit = 0.05 if quick else 0.25
        first, spent, last = time.process_time() - began, 0.0, theta
        once = not ours and first > 4 * limit  # so long that it makes no difference to have been the first
        best = first if once else math.inf
        for _ in range(0 if once else 50 if ours else 5):
            began = time.process_time()
            last, evaluations, route = solve(setting)
            took = time.process_time() - began
            best, spent = min(best, took), spent + took
            if spent > limit:
                break
    # a prepared solver may go about a later call otherwise: the worse of the first and the last is judged
    error = max(float(np.max(np.abs(path[judged] - truth))) for path in (theta, last))
    if not math.isfinite(error):
        return None
    return Run(problem, method, setting, error, 1e3 * best, evaluations, route)


# -- what is compared ------------------------------------------------------------------------------------------------


def _ours(name: str, problem: Problem) -> Callable[[float], tuple[np.ndarray, int, str]]:
    from toolkit.simulate import scene_equation, scene_parameters, simulate

    t, scene = problem.t_s, problem.scene
    if name == "simulate" or "slack_string" in scene.effects:

        def run_simulate(accuracy: float) -> tuple[np.ndarray, int, str]:
            trajectory = simulate(scene, t, accuracy_rad=accuracy)
            return trajectory.theta_rad, trajectory.cost.evaluations, trajectory.method

        return run_simulate
    equation = scene_equation(scene)
    parameters, release = scene_parameters(scene, equation), scene.release

    solvers: dict[float, Any] = {}

    def run_solve(accuracy: float) -> tuple[np.ndarray, int, str]:
        if accuracy not in solvers:  # prepared once, in the first run, which is not timed
            solvers[accuracy] = equation.prepare(t, accuracy)
        solution = solvers[accuracy].solve(parameters, release.theta0_rad, release.omega0_rad_per_s)
        return solution.theta_rad, solution.cost.evaluations, solution.method

    return run_solve


def _peer(name: str, problem: Problem) -> Callable[[float], tuple[np.ndarray, int, str]]:
    from scipy.integrate import odeint, solve_ivp

    slope, t = _slope(problem.scene), problem.t_s
    start = [problem.scene.release.theta0_rad, problem.scene.release.omega0_rad_per_s]
    if "slack_string" in problem.scene.effects:
        return lambda tolerance: _peer_with_slack(name, problem, tolerance)
    if name == "odeint":

        def run_odeint(tolerance: float) -> tuple[np.ndarray, int, str]:
            path, info = odeint(
                slope, start, t, tfirst=True, rtol=tolerance, atol=tolerance, mxstep=1_000_000, full_output=True
            )
            return path[:, 0], int(info["nfe"][-1]), name

        return run_odeint

    def run_solve_ivp(tolerance: float) -> tuple[np.ndarray, int, str]:
        solved = solve_ivp(
            slope, (0.0, t[-1]), start, method=name, t_eval=t, rtol=max(tolerance, 3e-14), atol=tolerance
        )
        return solved.y[0], int(solved.nfev), name

    return run_solve_ivp


def _slope(scene: Scene) -> Callable[[float, Any], tuple[float, float]]:
    """The right-hand side as a careful user of SciPy writes it: scalars and `math`, only the terms that act."""
    sin, cos = (math.sin if not scene.approximations.small_angle else float), math.cos
    two_alpha, beta, gravity, drive, rate = _coefficients(scene)
    if drive and two_alpha:
        return lambda t, y: (y[1], drive * cos(rate * t) - gravity * sin(y[0]) - two_alpha * y[1])
    if beta:
        return lambda t, y: (y[1], -gravity * sin(y[0]) - beta * abs(y[1]) * y[1])
    if two_alpha:
        return lambda t, y: (y[1], -gravity * sin(y[0]) - two_alpha * y[1])
    return lambda t, y: (y[1], -gravity * sin(y[0]))


def _coefficients(scene: Scene) -> tuple[float, float, float, float, float]:
    exact = _exact_coefficients(scene)
    two_alpha, beta, gravity, drive, f_hz = (float(v) for v in exact)
    return two_alpha, beta, gravity, drive, 2 * math.pi * f_hz


def _exact_coefficients(scene: Scene) -> tuple[Fraction, Fraction, Fraction, Fraction, Fraction]:
    """2α, β, g/ℓ, f₀/(mℓ), f of the scene's own floats, as ratios."""
    p, e = scene.pendulum, scene.effects
    mass, length = Fraction(p.mass_kg or 1.0), Fraction(p.length_m or 1.0)
    drag = Fraction(e.get("linear_drag", {}).get("k_d_kg_per_s", 0.0))
    quadratic = Fraction(e.get("quadratic_drag", {}).get("c_kg_per_m", 0.0))
    drive = e.get("cosine_drive", {"f0_n": 0.0, "f_hz": 0.0})
    gravity = Fraction(scene.environment.gravity_m_per_s2) / length
    return (
        drag / mass,
        quadratic * length / mass,
        gravity,
        Fraction(drive["f0_n"]) / (mass * length),
        Fraction(drive["f_hz"]),
    )


def _peer_with_slack(name: str, problem: Problem, tolerance: float) -> tuple[np.ndarray, int, str]:
    """Swing and flight joined by terminal events, as a user of solve_ivp writes it."""
    from scipy.integrate import solve_ivp

    scene, t = problem.scene, problem.t_s
    length, g = float(scene.pendulum.length_m or 1.0), scene.environment.gravity_m_per_s2
    options: dict[str, Any] = {"method": name, "rtol": max(tolerance, 3e-14), "atol": tolerance}

    def swing(t: float, y: Any) -> tuple[float, float]:
        return y[1], -g / length * math.sin(y[0])

    def tension(t: float, y: Any) -> float:
        return length * y[1] ** 2 + g * math.cos(y[0])

    def fall(t: float, y: Any) -> tuple[float, float, float, float]:
        return y[2], y[3], 0.0, -g

    def stretched(t: float, y: Any) -> float:
        return y[0] ** 2 + y[1] ** 2 - length**2 * (1 + 1e-12)

    tension.terminal, tension.direction = True, -1.0  # type: ignore[attr-defined]
    stretched.terminal, stretched.direction = True, 1.0  # type: ignore[attr-defined]
    theta, now, state, evaluations = np.empty(0), 0.0, [scene.release.theta0_rad, scene.release.omega0_rad_per_s], 0
    taut = True
    while theta.size < t.size:
        ahead = t[theta.size :]
        solved = solve_ivp(
            swing if taut else fall,
            (now, t[-1] + 1e-9),
            state,
            t_eval=ahead,
            events=tension if taut else stretched,
            **options,
        )
        evaluations += int(solved.nfev)
        y = solved.y
        angle = y[0] if taut else np.unwrap(np.concatenate([theta[-1:], np.arctan2(y[0], -y[1])]))[1:]
        theta = np.concatenate([theta, angle])
        if not solved.t_events[0].size:
            break
        now, end = float(solved.t_events[0][0]), solved.y_events[0][0]
        if taut:
            a, w = end
            state = [length * math.sin(a), -length * math.cos(a), length * w * math.cos(a), length * w * math.sin(a)]
        else:
            raw = math.atan2(end[0], -end[1])
            a = raw + 2 * math.pi * round((theta[-1] - raw) / (2 * math.pi))
            state = [a, (end[2] * math.cos(a) + end[3] * math.sin(a)) / length]
        taut = not taut
    return theta, evaluations, name


# -- the truth -------------------------------------------------------------------------------------------------------


def true_angles(problem: Problem, most: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Indices of up to `most` samples, and θ there, in 36-digit arithmetic that no method under test uses."""
    judged = np.unique(np.linspace(0, problem.samples - 1, min(most, problem.samples)).round().astype(int))
    t = problem.t_s[judged]
    if "slack_string" in problem.scene.effects:
        return judged, _true_slack(problem.scene, t)
    if problem.scene.approximations.small_angle:
        return judged, _true_linear(problem.scene, t)
    from toolkit.cost._reference import ExactPendulum, solve_exactly

    two_alpha, beta, gravity, drive, f_hz = _exact_coefficients(problem.scene)
    exact = ExactPendulum(gravity, two_alpha, beta, drive, f_hz=f_hz)
    release = problem.scene.release
    return judged, np.array(solve_exactly(exact, release.theta0_rad, release.omega0_rad_per_s, list(t))[0])


def _true_linear(scene: Scene, t_s: np.ndarray) -> np.ndarray:
    """The linear equation by the textbook's complex exponentials, in mpmath at 40 digits."""
    import mpmath as mp

    with mp.workdps(40):
        two_alpha, _, square, drive, f_hz = (mp.mpf(v.numerator) / v.denominator for v in _exact_coefficients(scene))
        alpha, w_f = two_alpha / 2, 2 * mp.pi * f_hz
        root = mp.sqrt(mp.mpc(alpha**2 - square))
        steady = drive / (square - w_f**2 + 2j * alpha * w_f)
        start, rate = scene.release.theta0_rad - steady.real, scene.release.omega0_rad_per_s + (w_f * steady).imag
        first, second = -alpha + root, -alpha - root
        a = (rate - second * start) / (first - second)
        b = start - a
        path = [
            (a * mp.exp(first * t) + b * mp.exp(second * t) + steady * mp.expj(w_f * t)).real
            for t in map(mp.mpf, map(float, t_s))
        ]
        return np.array([float(x) for x in path])


def _true_slack(scene: Scene, t_s: np.ndarray) -> np.ndarray:
    """One slack episode from the bottom without drag: elliptic functions and a parabola in mpmath at 40 digits."""
    import mpmath as mp

    with mp.workdps(40):
        length, g = mp.mpf(scene.pendulum.length_m or 1.0), mp.mpf(scene.environment.gravity_m_per_s2)
        w = mp.sqrt(g / length)
        rate = mp.mpf(scene.release.omega0_rad_per_s)
        u = (rate / w) ** 2
        angle = mp.acos((2 - u) / 3)  # cos of the slack angle (from downward)
        m = u / 4
        leaves = mp.ellipf(mp.asin(mp.sin(angle / 2) / mp.sqrt(m)), m) / w
        speed = mp.sqrt(-g * length * mp.cos(angle))
        x, y = length * mp.sin(angle), -length * mp.cos(angle)
        vx, vy = speed * mp.cos(angle), speed * mp.sin(angle)
        flight = 4 * vy / g
        end = x + vx * flight, y + vy * flight - g * flight**2 / 2
        caught = mp.atan2(end[0], -end[1])
        kept = (vx * mp.cos(caught) + (vy - g * flight) * mp.sin(caught)) / length
        m2 = mp.sin(caught / 2) ** 2 + (kept / (2 * w)) ** 2
        phase = mp.ellipf(mp.atan2(mp.sin(caught / 2), kept / (2 * w)), m2)
        path = []
        for t in map(mp.mpf, map(float, t_s)):
            if t <= leaves:
                path.append(2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", w * t, m=m)))
            elif t <= leaves + flight:
                s = t - leaves
                path.append(mp.atan2(x + vx * s, -(y + vy * s - g * s**2 / 2)))
            else:
                path.append(2 * mp.asin(mp.sqrt(m2) * mp.ellipfun("sn", w * (t - leaves - flight) + phase, m=m2)))
        return np.unwrap(np.array([float(a) for a in path]))


# -- the first call --------------------------------------------------------------------------------------------------

_FIRST_CALL = """
import json, sys, time
import numpy as np
from toolkit.cost.integrators import problems
from toolkit.simulate import simulate
problem = next(p for p in problems() if p.name == sys.argv[1])
before = time.process_time()
trajectory = simulate(problem.scene, problem.t_s, 1e-9)
print(json.dumps({"call": time.process_time() - before, "process": time.process_time()}))
"""


def first_calls(names: tuple[str, ...] = ("P1", "P2", "L")) -> dict[str, float]:
    """CPU seconds of the first `simulate` in a fresh process: "P1 cold" (nothing compiled yet), "P1 warm", "P1 process"."""
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as cache:
        here = str(Path(__file__).resolve().parents[2])
        environment = {
            **os.environ, "PENDULAB_CACHE": cache, "NUMBA_CACHE_DIR": cache,
            "PYTHONPATH": os.pathsep.join([here, os.environ.get("PYTHONPATH", "")]),
        }  # fmt: skip
        for name in names:
            for kind in ("cold", "warm"):
                done = subprocess.run(
                    [sys.executable, "-c", _FIRST_CALL, name],
                    env=environment,
                    capture_output=True,
                    text=True,
                    check=False,
                )
                if done.returncode == 0:
                    took = json.loads(done.stdout)
                    found[f"{name} {kind}"] = took["call"]
                    if kind == "warm":
                        found[f"{name} process"] = took["process"]
    return found


# -- what it says ----------------------------------------------------------------------------------------------------

_RATIO_COLUMNS = ("solve", "simulate", "solve_ivp", "odeint", "solve_ivp/solve", "odeint/solve", "solve_ivp/simulate")


def ratios(measured: Measured) -> list[dict[str, Any]]:
    """Least CPU (ms) at equal accuracy: at 1e-5, 1e-7, 1e-9 and at the tightest errors that solve_ivp and odeint reach."""
    rows = []
    for problem in measured.problems:
        runs = [r for r in measured.runs if r.problem == problem.name]
        by_peers = [r.error_rad for r in runs if r.method in PEERS[:4]]
        targets = {1e-5, 1e-7, 1e-9} | ({min(by_peers)} if by_peers else set())
        for target in sorted(targets, reverse=True):
            least = {m: _least(runs, (m,), target) for m in (*OURS, "odeint")}
            least["solve_ivp"] = _least(runs, PEERS[:4], target)
            row: dict[str, Any] = {"problem": problem.name, "error_rad": target, **least}
            for column in _RATIO_COLUMNS[4:]:
                above, below = column.split("/")
                over, under = least[above], least[below]
                row[column] = over / under if over and under else None
            rows.append(row)
    return rows


def _least(runs: list[Run], methods: tuple[str, ...], target: float) -> float | None:
    return min((r.cpu_ms for r in runs if r.method in methods and r.error_rad <= target), default=None)


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _describe(measured: Measured, table: list[dict[str, Any]], quick: bool) -> str:
    lines = ["least CPU time (ms) to a largest error of θ; – where no setting reached it"]
    lines.append("".join(["problem  error ", *(f"{c:>19}" for c in _RATIO_COLUMNS)]))
    for row in table:
        cells = "".join(f"{_cell(row[c]) or '–':>19}" for c in _RATIO_COLUMNS)
        lines.append(f"{row['problem']:7} {row['error_rad']:7.1e}{cells}")
    lines += [
        "",
        "problems:",
        *(f"  {p.name}: {p.what}; {p.duration_s:g} s, {p.samples} samples" for p in measured.problems),
    ]
    lines += ["  P4: RK45 and DOP853 of SciPy would need about a minute a run and are left out"]
    lines += ["", "accuracy asked for and reached by simulate:"]
    for problem in measured.problems:
        ours = [r for r in measured.runs if r.problem == problem.name and r.method == "simulate"]
        missed = [
            f"{r.setting:.0e} → {r.error_rad:.1e}" for r in ours if r.error_rad > r.setting and r.setting >= 0.9e-11
        ]
        routes = _routes([r.route for r in ours])
        lines.append(
            f"  {problem.name}: {'reached 1e-3 … 1e-11' if not missed else 'missed ' + ', '.join(missed)}; {routes}"
        )
    if measured.first_call_s:
        lines += [
            "",
            "first call of simulate in a fresh process, CPU s (cold: nothing compiled; warm: compiled before):",
        ]
        for name in dict.fromkeys(k.split()[0] for k in measured.first_call_s):
            cold, warm = (measured.first_call_s.get(f"{name} {k}", math.nan) for k in ("cold", "warm"))
            whole = measured.first_call_s.get(f"{name} process", math.nan)
            lines.append(f"  {name}: cold {cold:.2f}, warm {warm:.2f}; the whole warm process {whole:.2f}")
    if quick:
        lines += ["", "a quick run: shorter P3, P4 and D, half the tolerances; leave out --quick for the full tables"]
    return "\n".join(lines)


def _routes(names: list[str]) -> str:
    """Routes without repetition; orders of the series as a range."""
    series = "Taylor series of order "
    orders = sorted({int(n.removeprefix(series)) for n in names if n.startswith(series)})
    others = sorted({n for n in names if not n.startswith(series)})
    return ", ".join([*others, *([f"{series}{orders[0]} … {orders[-1]}"] if orders else [])])


_STYLES = {
    "solve": ("#D55E00", "o", "-"),
    "simulate": ("#D55E00", "s", "--"),
    "RK45": ("#56B4E9", "v", "-"),
    "DOP853": ("#0072B2", "^", "-"),
    "LSODA": ("#009E73", "D", "-"),
    "Radau": ("#CC79A7", "P", "-"),
    "odeint": ("#000000", "x", ":"),
}


def _draw(measured: Measured, stem: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 6), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, problem in zip(figure.subplots(2, 4).flat, measured.problems):
        for method, (colour, marker, dash) in _STYLES.items():
            points = [
                (max(r.error_rad, 1e-16), r.cpu_ms)
                for r in measured.runs
                if (r.problem, r.method) == (problem.name, method)
            ]
            if points:
                x, y = zip(*points)
                label = f"pendulab {method}" if method in OURS else method
                axes.loglog(x, y, color=colour, marker=marker, linestyle=dash, markersize=3, linewidth=0.9, label=label)
        axes.invert_xaxis()
        axes.set_title(f"{problem.name}: {problem.what}", fontsize=8, loc="left")
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.25, linewidth=0.4)
        axes.set_xlabel("largest error of θ (rad)", fontsize=7)
        axes.set_ylabel("CPU (ms)", fontsize=7)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=7, fontsize=8, frameon=False)
    figure.savefig(stem.with_suffix(".png"), dpi=200)
    figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
