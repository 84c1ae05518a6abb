"""What a fit costs and what it reaches: ours beside lmfit with SciPy's integrators tuned by hand, on one record in one run."""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import PendulabError
from toolkit.fit import FitResult, fit
from toolkit.models import load_model
from toolkit.progress import Progress, silent
from toolkit.series import ThetaSeries

TRUTH = {"alpha_d": 0.005, "beta": 0.01, "theta0": 1.0, "phi": 1.2, "omega_g": 4.43}
"""The record of the comparison: 60 s at 120 fps (7201 points), 1 mrad of noise."""

START = {"alpha_d": 0.0065, "beta": 0.007, "theta0": 1.02, "phi": 1.25, "omega_g": 4.43 * 1.0005}
"""Where every method starts: drag 30 % off, amplitude 2 %, phase 0.05 rad, ω_g 0.05 % (farther, the peers lose the phase)."""

MODEL = "full_linear_quadratic_drag"


@dataclass(frozen=True)
class Result:
    """One line. distance_sigma : largest distance of a parameter from the best minimum found, in its standard error.
    excess_chi2 : χ² above the lowest of all methods of the group."""

    group: str
    method: str
    points: int
    cpu_ms: float
    evaluations: int
    excess_chi2: float
    distance_sigma: float
    reached: bool


def measure(folder: str | Path, quick: bool = False, progress: Progress = silent) -> str:
    """Fit and compare; write fit.csv, fit.txt and fit.png/.svg into `folder`; return the text."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    results = measure_fits(quick, progress)
    with (folder / "fit.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["group", "method", "points", "cpu_ms", "evaluations", "excess_chi2", "distance_sigma", "reached"]
        )
        for r in results:
            writer.writerow(
                [
                    r.group,
                    r.method,
                    r.points,
                    f"{r.cpu_ms:.4g}",
                    r.evaluations,
                    f"{r.excess_chi2:.3g}",
                    f"{r.distance_sigma:.3g}",
                    r.reached,
                ]
            )
    text = describe(results, quick)
    (folder / "fit.txt").write_text(text + "\n", encoding="utf-8")
    _draw(results, folder / "fit")
    return text


def measure_fits(quick: bool = False, progress: Progress = silent) -> list[Result]:
    """Peers on one record, models and numbers of points, and error methods."""
    found = compare_with_peers(quick, progress)
    found += by_points((100, 1000, 10000) if quick else (100, 1000, 10000, 100000), progress)
    found += error_methods(quick, progress)
    progress("done", 1.0)
    return found


def record(points: int = 7201, duration_s: float = 60.0, seed: int = 0) -> ThetaSeries:
    """The comparison's record: θ(t) of `TRUTH` with 1 mrad of white noise."""
    t = np.linspace(0.0, duration_s, points)
    theta = load_model(MODEL).motion(TRUTH, t).theta
    return ThetaSeries(t, theta + 1e-3 * np.random.default_rng(seed).normal(size=points), np.full(points, 1e-3))


def compare_with_peers(quick: bool = False, progress: Progress = silent) -> list[Result]:
    """The same five parameters, start, record and minimiser (lmfit's leastsq) with different motions and Jacobians."""
    series = record(1801 if quick else 7201, 15.0 if quick else 60.0)
    best = fit(series, model=MODEL, fixed={"theta_offset": 0.0}, start=START)
    runs: list[tuple[str, Callable[[], tuple[dict[str, float], int]], int]] = [
        ("ours: lmfit + analytic sensitivities", lambda: _ours(series), 5),
        ("lmfit, finite differences of our solution", lambda: _peer(series, _our_motion, 1e-10), 3),
        ("lmfit + odeint, step tuned by hand", lambda: _peer(series, _odeint(1e-10), 1e-8), 1),
        ("lmfit + odeint, lmfit's own step", lambda: _peer(series, _odeint(1.49e-8), 1e-10), 1),
    ]
    if not quick:
        runs.append(
            ("lmfit + solve_ivp LSODA, step tuned by hand", lambda: _peer(series, _solve_ivp("LSODA", 1e-9), 1e-8), 1)
        )
    found = []
    for i, (name, run, repeats) in enumerate(runs):
        progress(f"fitting: {name}", 0.6 * i / len(runs))
        if repeats > 1:
            run()
        times = []
        for _ in range(repeats):
            began = time.process_time()
            values, evaluations = run()
            times.append(time.process_time() - began)
        excess = _chi2(series, values) - best.chi2
        distance = max(
            abs(values[n] - best.parameters[n].value) / (best.parameters[n].stderr or math.inf) for n in TRUTH
        )
        found.append(
            Result("peers", name, len(series), 1e3 * min(times), evaluations, excess, distance, distance < 0.1)
        )
    return found


def by_points(counts: tuple[int, ...], progress: Progress = silent) -> list[Result]:
    """Each standard model on records of different length, from the data alone (guess included)."""
    from toolkit.models import STANDARD

    found = []
    for i, points in enumerate(counts):
        series = record(points, max(60.0, points / 250.0) if points > 1000 else 20.0)
        for name in STANDARD:
            progress(f"{name}, {points} points", 0.6 + 0.25 * i / len(counts))
            options: dict[str, Any] = {"model": name, "thorough": False}
            fit(series, **options)
            began = time.process_time()
            result = fit(series, **options)
            cpu = time.process_time() - began
            found.append(_line("points", name, result, cpu))
    return found


def error_methods(quick: bool = False, progress: Progress = silent) -> list[Result]:
    """CPU of each road to an error bar on one record; excess_chi2 holds u(β) over the covariance's own."""
    from toolkit.fitting.uncertainty import bootstrap, profile, sample_posterior

    series = record(1201, 20.0)
    result = fit(series, model=MODEL)
    own = result.parameters["beta"].stderr or math.nan
    count = 20 if quick else 100

    def by_profile() -> float:
        low, high = profile(result, "beta")
        return (high - low) / 2

    roads: list[tuple[str, Callable[[], float]]] = [
        ("covariance", lambda: fit(series, model=MODEL).parameters["beta"].stderr or math.nan),
        (f"block bootstrap ({count})", lambda: bootstrap(result, count).stderr("beta")),
        ("profile likelihood", by_profile),
    ]
    try:
        import emcee  # noqa: F401

        roads.append(("MCMC (emcee)", lambda: sample_posterior(result, 40 if quick else 300).stderr("beta")))
    except ImportError:
        pass
    found = []
    for i, (name, road) in enumerate(roads):
        progress(f"error bars: {name}", 0.85 + 0.15 * i / len(roads))
        began = time.process_time()
        u = road()
        cpu = time.process_time() - began
        found.append(Result("errors", name, len(series), 1e3 * cpu, 0, u / own, 0.0, True))
    return found


def describe(results: list[Result], quick: bool = False) -> str:
    """The tables as text."""
    lines = ["Fits: what they cost and reach (CPU times of this run; compare ratios)" + (", quick" if quick else "")]
    peers = [r for r in results if r.group == "peers"]
    ours = peers[0].cpu_ms
    lines += ["", f"Same record ({peers[0].points} points, 5 parameters), same start, lmfit's leastsq in all:"]
    lines += [f"  {'method':46s}{'ms':>9s}{'× ours':>9s}{'Δχ²':>11s}{'off by':>9s}  same minimum"]
    for r in peers:
        lines.append(
            f"  {r.method:46s}{r.cpu_ms:9.1f}{r.cpu_ms / ours:9.1f}{r.excess_chi2:11.2g}{r.distance_sigma:8.2g}σ  {'yes' if r.reached else 'NO'}"
        )
    lines += [
        "",
        "From the data alone, first guess included:",
        f"  {'model':36s}{'points':>8s}{'ms':>9s}{'lmfit calls':>13s}",
    ]
    lines += [
        f"  {r.method:36s}{r.points:8d}{r.cpu_ms:9.1f}{r.evaluations:13d}" for r in results if r.group == "points"
    ]
    lines += ["", "Roads to an error bar (u of β beside the covariance's):"]
    lines += [
        f"  {r.method:36s}{r.cpu_ms:9.1f} ms   u ratio {r.excess_chi2:.2f}" for r in results if r.group == "errors"
    ]
    return "\n".join(lines)


def _line(group: str, name: str, result: FitResult, cpu_s: float) -> Result:
    evaluations = int(result.lmfit.nfev) if result.lmfit is not None else 0
    return Result(group, name, result.residuals_rad.size, 1e3 * cpu_s, evaluations, 0.0, 0.0, result.success)


def _ours(series: ThetaSeries) -> tuple[dict[str, float], int]:
    result = fit(series, model=MODEL, fixed={"theta_offset": 0.0}, start=START)
    return {n: result.parameters[n].value for n in TRUTH}, int(result.lmfit.nfev)


def _our_motion(values: dict[str, float], t: np.ndarray) -> np.ndarray:
    try:
        return np.asarray(load_model(MODEL).motion(values, t).theta)
    except PendulabError:  # a step of the minimiser that no pendulum can follow
        return np.full(t.size, 1e3)


def _chi2(series: ThetaSeries, values: dict[str, float]) -> float:
    return float(np.sum(((series.theta_rad - _our_motion(values, series.t_s)) / 1e-3) ** 2))


def _start_of(values: dict[str, float]) -> tuple[float, float]:
    kappa = math.sin(values["theta0"] / 2)
    inside = min(max(kappa * math.sin(values["phi"]), -1.0), 1.0)
    return 2 * math.asin(inside), 2 * kappa * values["omega_g"] * math.cos(values["phi"])


def _odeint(tolerance: float) -> Callable[[dict[str, float], np.ndarray], np.ndarray]:
    def motion(values: dict[str, float], t: np.ndarray) -> np.ndarray:
        from scipy.integrate import odeint

        w2, a, b = values["omega_g"] ** 2, 2 * values["alpha_d"], values["beta"]

        def slope(y: np.ndarray, _: float) -> tuple[float, float]:
            return y[1], -w2 * math.sin(y[0]) - (a + b * abs(y[1])) * y[1]

        return np.asarray(odeint(slope, _start_of(values), t, rtol=tolerance, atol=tolerance, mxstep=100000)[:, 0])

    return motion


def _solve_ivp(method: str, tolerance: float) -> Callable[[dict[str, float], np.ndarray], np.ndarray]:
    def motion(values: dict[str, float], t: np.ndarray) -> np.ndarray:
        from scipy.integrate import solve_ivp

        w2, a, b = values["omega_g"] ** 2, 2 * values["alpha_d"], values["beta"]

        def slope(_: float, y: np.ndarray) -> tuple[float, float]:
            return y[1], -w2 * math.sin(y[0]) - (a + b * abs(y[1])) * y[1]

        solved = solve_ivp(slope, (t[0], t[-1]), _start_of(values), method, t, rtol=tolerance, atol=tolerance)
        return np.asarray(solved.y[0])

    return motion


def _peer(
    series: ThetaSeries, motion: Callable[[dict[str, float], np.ndarray], np.ndarray], epsfcn: float
) -> tuple[dict[str, float], int]:
    import lmfit

    parameters = lmfit.Parameters()
    for name, value in START.items():
        parameters.add(name, value=value)

    def residual(p: Any) -> np.ndarray:
        return np.asarray((series.theta_rad - motion(p.valuesdict(), series.t_s)) / 1e-3)

    outcome = lmfit.minimize(residual, parameters, method="leastsq", epsfcn=epsfcn, scale_covar=False)
    return {name: float(outcome.params[name].value) for name in TRUTH}, int(outcome.nfev)


def _draw(results: list[Result], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    peers = [r for r in results if r.group == "peers"][::-1]
    colours = ["tab:green" if r.reached else "tab:red" for r in peers]
    left.barh([r.method for r in peers], [r.cpu_ms for r in peers], color=colours)
    left.set_xscale("log")
    left.set_xlabel("CPU time of one fit / ms  (red: another minimum)")
    left.tick_params(axis="y", labelsize=7)
    for name in dict.fromkeys(r.method for r in results if r.group == "points"):
        rows = [r for r in results if r.group == "points" and r.method == name]
        right.loglog([r.points for r in rows], [r.cpu_ms for r in rows], "o-", label=name, markersize=3)
    right.set_xlabel("points")
    right.set_ylabel("CPU time of one fit, guess included / ms")
    right.yaxis.set_major_formatter("{x:g}")
    right.yaxis.set_minor_formatter("{x:g}")
    right.legend(fontsize=6)
    figure.savefig(path.with_suffix(".png"), dpi=160)
    figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
