"""Work and precision: our routes beside SciPy's integrators, against a truth that neither made."""

from __future__ import annotations

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.cost._peers import Solve, peer, peers_for
from toolkit.cost._work_precision import COLUMNS, OURS, Measured, Run, cell, describe, draw, ratios
from toolkit.cost.problems import Problem, problems, true_angles
from toolkit.progress import Progress, silent


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
        writer.writerow(["problem", "error_rad", *COLUMNS])
        writer.writerows([[r["problem"], f"{r['error_rad']:.2g}", *(cell(r[c]) for c in COLUMNS)] for r in table])
    text = describe(measured, table, quick)
    (folder / "integrators.txt").write_text(text + "\n", encoding="utf-8")
    draw(measured, folder / "work_precision")
    return text


def measure_integrators(quick: bool = False, progress: Progress = silent) -> Measured:
    """Run every method at every setting on every problem."""
    chosen = tuple(p.shortened() if quick else p for p in problems())
    runs: list[Run] = []
    for i, problem in enumerate(chosen):
        progress(f"{problem.name}: the truth", i / (len(chosen) + 1))
        judged, truth = true_angles(problem)
        methods: list[tuple[str, Solve, list[float]]] = [
            (name, _ours(name, problem), [10.0**-k for k in range(3, 13)]) for name in OURS
        ]
        # close to one another, so that a peer is not charged for accuracy that nobody asked of it
        tolerances = [10.0 ** (-k / 2) for k in range(6, 27, 2 if quick else 1)]
        methods += [(name, peer(name, problem), tolerances) for name in peers_for(problem)]
        for j, (name, solve, settings) in enumerate(methods):
            progress(f"{problem.name}: {name}", (i + j / len(methods)) / (len(chosen) + 1))
            for setting in settings:
                run = _timed(problem.name, name, setting, solve, judged, truth, name in OURS, quick)
                if run is not None:
                    runs.append(run)
                if run is not None and run.cpu_ms > (500 if quick else 1_000):
                    break  # tighter settings of this method would cost more than they tell
    progress("first calls in fresh processes, compiling", len(chosen) / (len(chosen) + 1))
    return Measured(chosen, tuple(runs), first_calls(("P1", "L") if quick else ("P1", "P2", "L")))


def _timed(
    problem: str, method: str, setting: float, solve: Solve,
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
        limit = 0.05 if quick else 0.1
        first, spent, last = time.process_time() - began, 0.0, theta
        best = math.inf if ours else first  # ours prepares itself in the first run
        for _ in range(50 if ours else 5 if first < 0.5 else 0):
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


def _ours(name: str, problem: Problem) -> Solve:
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


_FIRST_CALL = """
import json, sys, time
import numpy as np
from toolkit.cost.problems import problems
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
