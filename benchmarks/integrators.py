"""The figures of the motion engine: what accuracy costs, whether it is reached, and how good the derivatives are.

    python benchmarks/integrators.py                 all of the below, into benchmarks/results/integrators
    python benchmarks/integrators.py cost [--quick]  work and precision beside SciPy (the same as `pendulab cost integrators`)
    python benchmarks/integrators.py accuracy [--count 200] [--seed 7] [--stiff]
                                                     random scenes: accuracy asked for, 1e-3 … 1e-11, against accuracy reached
    python benchmarks/integrators.py sensitivities   derivatives against differences of whole-number solutions
    python benchmarks/integrators.py samples         20 000 samples against 1000
    python benchmarks/integrators.py long            1e5 periods at θ₀ = 1

Times are CPU times; compare ratios within one run.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from toolkit.cost._reference import ExactPendulum, solve_to_many_digits
from toolkit.cost.integrators import measure
from toolkit.cost.problems import Problem, problems, random_problem, random_stiff_problem, true_angles
from toolkit.simulate import scene_equation, scene_parameters, simulate

ASKED = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", default="all", choices=["all", "cost", *_PARTS])
    parser.add_argument("--quick", action="store_true", help="shorter problems and fewer tolerances")
    parser.add_argument("--count", type=int, default=200, help="random scenes")
    parser.add_argument("--seed", type=int, default=7, help="of the random scenes")
    parser.add_argument("--stiff", action="store_true", help="random scenes that are overdamped 20 to 500 times")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results" / "integrators")
    chosen = parser.parse_args()
    if chosen.what in ("all", "cost"):
        chosen.out.mkdir(parents=True, exist_ok=True)
        print(measure(chosen.out, chosen.quick, lambda stage, share: print(f"  {share:4.0%} {stage}", file=sys.stderr)))
    for name, part in _PARTS.items():
        if chosen.what in ("all", name):
            print(f"\n{name}")
            part(chosen)


def report_accuracy(chosen: argparse.Namespace) -> None:
    """How often the accuracy asked for is missed, and what it costs beside the cheapest setting that reaches it."""
    print(f"{chosen.count} random scenes, seed {chosen.seed}; error reached / error asked for")
    reached: dict[float, list[float]] = {a: [] for a in ASKED}
    over: dict[float, list[float]] = {a: [] for a in ASKED}
    missed, warned = [], 0
    for i in range(chosen.count):
        problem = (random_stiff_problem if chosen.stiff else random_problem)(chosen.seed, i)
        judged, truth = true_angles(problem, 100)
        runs = []
        for asked in (1e-2, *ASKED):
            trajectory = simulate(problem.scene, problem.t_s, asked)
            error = float(np.max(np.abs(trajectory.theta_rad[judged] - truth)))
            runs.append((asked, error, _best(lambda a=asked, p=problem: simulate(p.scene, p.t_s, a))))
            if asked not in reached:
                continue
            reached[asked].append(error / asked)
            if error > asked:
                if any("asked for" in w for w in trajectory.warnings):
                    warned += 1
                else:
                    missed.append(
                        f"scene {i} asked {asked:.0e} reached {error:.1e}: {trajectory.method}, {problem.what}"
                    )
        for asked, _, cost in runs[1:]:
            over[asked].append(cost / min(c for _, e, c in runs if e <= asked or c == cost))
    for asked in ASKED:
        ratios, costs = np.array(reached[asked]), np.array(over[asked])
        print(
            f"  {asked:.0e}: median {np.median(ratios):.2g}, worst {ratios.max():.2g}, over 1 in {np.sum(ratios > 1)};"
            f" cost / cheapest that reaches it: median {np.median(costs):.2f}, worst {costs.max():.2f}"
        )
    print(f"  missed with the warning that rounding forbids it: {warned}; missed without: {len(missed)}")
    print("\n".join(f"    {line}" for line in missed))


def report_sensitivities(chosen: argparse.Namespace) -> None:
    """Derivatives of θ against differences of whole-number solutions, largest error relative to the largest derivative."""
    for problem in problems():
        if problem.name not in ("P1", "P3", "P4", "P5", "D"):
            continue
        duration, samples = (2.0, 21) if problem.stiff else (20.0, 201)
        duration = min(problem.duration_s, duration)
        short = replace(problem, duration_s=duration, samples=samples)
        equation = scene_equation(short.scene)
        values = scene_parameters(short.scene, equation)
        names = [n for n in equation.parameters if n != "cosine_drive.phase_rad"] + ["theta0_rad", "omega0_rad_per_s"]
        release = short.scene.release
        solved = equation.solve(values, release.theta0_rad, release.omega0_rad_per_s, short.t_s, 1e-11, names)
        errors = {}
        for i, name in enumerate(names):
            exact = _difference(short, values, name)
            errors[name] = float(np.max(np.abs(solved.d_theta[:, i] - exact)) / np.max(np.abs(exact)))
        worst = max(errors, key=lambda n: errors[n])
        print(
            f"  {problem.name}, {duration:g} s, {len(names)} derivatives: worst {errors[worst]:.1e} relative ({worst})"
        )


def _difference(problem: Problem, values: dict[str, float], name: str) -> np.ndarray:
    """∂θ/∂name by a central difference of two solutions that are good to 30 digits, step 1e-9: error about 1e-16."""
    release = problem.scene.release
    start = {"theta0_rad": release.theta0_rad, "omega0_rad_per_s": release.omega0_rad_per_s}
    at = Fraction(start.get(name, values.get(name, 0.0)))
    step = Fraction(1, 10**9) * max(abs(at), Fraction(1, 100))
    paths = []
    for side in (1, -1):
        moved = {n: Fraction(v) for n, v in {**values, **start}.items()}
        moved[name] = at + side * step
        mass, length = moved.get("mass_kg", Fraction(1)), moved["length_m"]
        exact = ExactPendulum(
            gravity=moved["g_m_per_s2"] / length,
            two_alpha=moved.get("linear_drag.k_d_kg_per_s", Fraction(0)) / mass,
            beta=moved.get("quadratic_drag.c_kg_per_m", Fraction(0)) * length / mass,
            drive=moved.get("cosine_drive.f0_n", Fraction(0)) / (mass * length),
            f_hz=moved.get("cosine_drive.f_hz", Fraction(0)),
        )
        paths.append(solve_to_many_digits(exact, moved["theta0_rad"], moved["omega0_rad_per_s"], list(problem.t_s)))
    return np.array([float((up - down) / (2 * step)) for up, down in zip(*(p[0] for p in paths))])


def report_samples(chosen: argparse.Namespace) -> None:
    """The cost of 20 000 samples against 1000."""
    for problem in problems():
        if problem.name not in ("P1", "P2", "P3", "P5"):
            continue
        equation = scene_equation(problem.scene)
        values, release = scene_parameters(problem.scene, equation), problem.scene.release
        few, many = (np.linspace(0, problem.duration_s, n) for n in (1000, 20_000))

        def run(t: np.ndarray, e=equation, v=values, r=release) -> Callable[[], object]:  # type: ignore[no-untyped-def]
            solver = e.prepare(t, 1e-9)
            return lambda: solver.solve(v, r.theta0_rad, r.omega0_rad_per_s)

        costs = _best(run(few)), _best(run(many))
        print(f"  {problem.name}: {1e3 * costs[0]:.3g} ms, {1e3 * costs[1]:.3g} ms, ratio {costs[1] / costs[0]:.2f}")


def report_long(chosen: argparse.Namespace) -> None:
    """1e5 periods at θ₀ = 1: the exact route, and the integrator made to run by a drive of no strength."""
    import mpmath as mp

    scene = problems()[1].scene
    scene = scene.with_(release=replace(scene.release, theta0_rad=1.0))
    with mp.workdps(40):
        rate = mp.sqrt(mp.mpf(scene.environment.gravity_m_per_s2) / mp.mpf(scene.pendulum.length_m))
        m = mp.sin(mp.mpf(1) / 2) ** 2
        quarter = mp.ellipk(m)
        t = np.array([float(1e5 * 4 * quarter / rate)]) + np.array([0.0, 0.1, 0.3])
        phases = [mp.fmod(rate * mp.mpf(float(s)) + quarter, 4 * quarter) for s in t]
        truth = [float(2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", p, m=m))) for p in phases]
    for label, effects in (
        ("exact route", {}),
        ("integrator", {"cosine_drive": {"f0_n": 0.0, "f_hz": 0.15, "phase_rad": 0.0}}),
    ):
        began = time.process_time()
        trajectory = simulate(scene.with_(effects=effects), t, 1e-10)
        spent = time.process_time() - began
        error = float(np.max(np.abs(trajectory.theta_rad - truth)))
        print(f"  {label}: error {error:.1e} rad, {spent:.3g} s of CPU; {trajectory.method}")


def _best(run: Callable[[], object], seconds: float = 0.05) -> float:
    run()
    best, spent = math.inf, 0.0
    for _ in range(30):
        began = time.process_time()
        run()
        took = time.process_time() - began
        best, spent = min(best, took), spent + took
        if spent > seconds:
            break
    return best


_PARTS = {
    "accuracy": report_accuracy,
    "sensitivities": report_sensitivities,
    "samples": report_samples,
    "long": report_long,
}

if __name__ == "__main__":
    main()
