"""The figures of the fits: are error bars true, are verdicts right, what does it cost.

    python benchmarks/fits.py coverage [--count 1000]   pulls and intervals on synthetic records: white, AR(1), angle scale
    python benchmarks/fits.py verdicts [--count 400]    small_angle and linear_drag on random scenes
    python benchmarks/fits.py worked                    the worked failures: small-angle fits of a real swing, row by row
    python benchmarks/fits.py starts [--count 100]      random starts within a factor of 2 in every parameter
    python benchmarks/fits.py timing [--quick]          the same as `pendulab cost fit`
    python benchmarks/fits.py published FOLDER          real recordings beside published values (FOLDER holds yyz/, jlefebvre/ …)

Times are CPU times; compare ratios within one run. Seeds are fixed: a run can be repeated.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import tempfile
import time
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from toolkit.diagnose import diagnose
from toolkit.fit import FitResult, choose_model, fit, fit_models
from toolkit.fitting.cycles import amplitude_of, cycles, period_of
from toolkit.models import load_model
from toolkit.scene import Pendulum, Scene
from toolkit.series import ThetaSeries
from toolkit.series_io import read_series

NAMES = ("alpha_d", "theta0", "phi", "omega_g")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["coverage", "verdicts", "worked", "starts", "timing", "published"])
    parser.add_argument("folder", nargs="?", type=Path, help="of the real recordings (published)")
    parser.add_argument("--count", type=int, default=0)
    parser.add_argument("--quick", action="store_true")
    chosen = parser.parse_args()
    if chosen.what == "coverage":
        coverage(chosen.count or 1000)
    elif chosen.what == "verdicts":
        verdicts(chosen.count or 400)
    elif chosen.what == "worked":
        worked()
    elif chosen.what == "starts":
        starts(chosen.count or 100)
    elif chosen.what == "timing":
        from toolkit.cost.fit import measure

        with tempfile.TemporaryDirectory() as folder:
            print(measure(folder, chosen.quick))
    else:
        published(chosen.folder or Path("../shared/data"))


def independent(truth: dict[str, float], t: np.ndarray) -> np.ndarray:
    """θ(t) by SciPy's DOP853 at 1e-12: a truth that none of our own solvers made."""
    from scipy.integrate import solve_ivp

    w2, alpha, beta = truth["omega_g"] ** 2, truth["alpha_d"], truth.get("beta", 0.0)
    kappa, sine, cosine = math.sin(truth["theta0"] / 2), math.sin(truth["phi"]), math.cos(truth["phi"])

    def slope(_: float, y: Any) -> tuple[float, float]:
        theta, omega = y
        return omega, -w2 * math.sin(theta) - (2 * alpha + beta * abs(omega)) * omega

    begin = [2 * math.asin(kappa * sine), 2 * kappa * truth["omega_g"] * cosine]
    solved = solve_ivp(slope, (0.0, float(t[-1])), begin, "DOP853", t, rtol=1e-12, atol=1e-13)
    return np.asarray(solved.y[0])


def truth_of(rng: np.random.Generator) -> dict[str, float]:
    """A random scene with linear drag."""
    return {
        "theta0": float(np.exp(rng.uniform(math.log(0.1), math.log(1.2)))),
        "phi": rng.uniform(-math.pi, math.pi),
        "omega_g": rng.uniform(3.0, 6.0),
        "alpha_d": float(np.exp(rng.uniform(math.log(0.005), math.log(0.15)))),
        "beta": 0.0,
    }


def noise_of(rng: np.random.Generator, n: int, sigma: float, rho: float) -> np.ndarray:
    """AR(1) noise of standard deviation σ."""
    from scipy.signal import lfilter

    white = rng.normal(size=n + 400) * sigma * math.sqrt(1 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], white)[400:])


def coverage(count: int) -> None:
    """Pulls of the full linear model on records that SciPy solved."""
    for kind in ("white", "AR(1), rho up to 0.95", "angle scale, u = 1 %"):
        rng = np.random.default_rng(11)
        pulls: dict[str, list[float]] = {name: [] for name in NAMES}
        failed, began = 0, time.process_time()
        for _ in range(count):
            truth = truth_of(rng)
            t = np.arange(0, rng.uniform(8, 25), 1 / 30)
            sigma = float(np.exp(rng.uniform(math.log(3e-4), math.log(3e-3))))
            rho = rng.uniform(0.2, 0.95) if kind.startswith("AR") else 0.0
            scale = 1 + (0.01 * rng.normal() if kind.startswith("angle") else 0.0)
            theta = independent(truth, t) * scale
            meta = {"angle_scale_relative_u": 0.01} if kind.startswith("angle") else {}
            series = ThetaSeries(t, theta + noise_of(rng, t.size, sigma, rho), np.full(t.size, sigma), meta)
            result = fit(series, model="full_linear_drag")
            if not result.success:
                failed += 1
                continue
            for name in NAMES:
                p = result.parameters[name]
                error = p.value - truth[name]
                if name == "phi":
                    error = math.remainder(error, 2 * math.pi)
                pulls[name].append(error / (p.stderr or math.inf))
        print(
            f"\n{kind}: {count} records, {failed} failed, {1e3 * (time.process_time() - began) / count:.0f} ms a record"
        )
        print(f"  {'':8s}{'mean':>8s}{'sd':>8s}{'in 68.3 %':>12s}{'in 95.4 %':>12s}")
        for name in NAMES:
            z = np.array(pulls[name])
            print(
                f"  {name:8s}{z.mean():8.3f}{z.std():8.3f}{np.mean(np.abs(z) < 1):12.3f}{np.mean(np.abs(z) < 2):12.3f}"
            )


def verdicts(count: int) -> None:
    """Definite verdicts that are right, clear cases that get one, and false alarms of the other checks.

    The truth is judged without noise: λ is χ² of the wrong model fitted to the exact record. small_angle should fail where
    λ > 4 of the small-angle model with the true kind of drag, and hold elsewhere. linear_drag should hold for linear, fail for
    quadratic and mixed drag (30–70 % of the loss), and be left open where there is no drag to speak of. A case is clear
    where λ > 25 (for linear drag: of quadratic drag in its place). Every record keeps to the other assumptions, so that a
    `fails` there is a false alarm.
    """
    rng = np.random.default_rng(5)
    right, clear = ({"small_angle": [0, 0], "linear_drag": [0, 0]} for _ in range(2))
    alarms: dict[str, list[int]] = {}
    began = time.process_time()
    for i in range(count):
        scene = random_scene(rng, i)
        t, sigma, drag = scene["t"], scene["sigma"], scene["drag"]
        theta = load_model("full_linear_quadratic_drag").motion(scene["truth"], t).theta
        series = ThetaSeries(t, theta + sigma * rng.normal(size=t.size), np.full(t.size, sigma))
        exact = ThetaSeries(t, theta, np.full(t.size, sigma))
        fits = fit_models(series)
        findings = {f.assumption: f for f in diagnose(series, fits)}
        kind = {"linear": "linear", "negligible": "linear"}.get(drag, "linear_quadratic")
        seen = {"small_angle": lost(exact, f"small_angle_{kind}_drag", scene["truth"])}
        expected = {"small_angle": "fails" if seen["small_angle"] > 4 else "holds"}
        rival = "full_quadratic_drag" if drag == "linear" else "full_linear_drag"
        seen["linear_drag"] = 0.0 if drag == "negligible" else lost(exact, rival, scene["truth"])
        expected["linear_drag"] = {"linear": "holds", "negligible": "not_distinguishable"}.get(drag, "fails")
        for name in right:
            verdict = findings[name].verdict
            definite = verdict != "not_distinguishable"
            right[name][1] += definite
            right[name][0] += definite and verdict == expected[name]
            clear[name][1] += seen[name] > 25
            clear[name][0] += definite and seen[name] > 25
            if (definite and verdict != expected[name]) or (not definite and seen[name] > 25):
                shown = ", ".join(f"{k} {v:.3g}" for k, v in findings[name].evidence.items() if math.isfinite(v))
                print(
                    f"  scene {i}: {name} {verdict}, truth {expected[name]}: {drag}, A = {scene['truth']['theta0']:.3f}, "
                    f"λ = {seen[name]:.1f} [{shown}]",
                    flush=True,
                )
        for name, finding in findings.items():
            if name not in right:
                counts = alarms.setdefault(name, [0, 0, 0])
                counts[0] += finding.verdict == "fails"
                counts[1] += finding.verdict == "not_distinguishable"
                counts[2] += 1
                if finding.verdict == "fails":
                    print(f"  scene {i}: {name} fails on a good record: {finding.sentence}", flush=True)
        if (i + 1) % 20 == 0 or i + 1 == count:
            print(f"{i + 1} scenes, {1e3 * (time.process_time() - began) / (i + 1):.0f} ms of CPU each", flush=True)
            for name in right:
                (g, n), (c, m) = right[name], clear[name]
                print(
                    f"  {name:12s} definite verdicts right {g}/{n} = {g / max(n, 1):.3f}; "
                    f"clear cases with one {c}/{m} = {c / max(m, 1):.3f}",
                    flush=True,
                )
    print("false alarms of the other checks (fails, not distinguishable, records):")
    for name, (fails, open_, records) in sorted(alarms.items()):
        print(f"  {name:20s}{fails:5d}{open_:5d}{records:6d}")


def random_scene(rng: np.random.Generator, i: int) -> dict[str, Any]:
    """Truth, times and noise of the i-th scene of `verdicts`."""
    amplitude = rng.uniform(0.4, 1.4) if rng.integers(2) else rng.uniform(0.02, 0.08)
    drag = ("linear", "quadratic", "mixed", "negligible")[i % 4]
    rate = 1e-6 if drag == "negligible" else float(np.exp(rng.uniform(math.log(0.005), math.log(0.08))))
    omega = rng.uniform(3.5, 5.5)
    share = {"quadratic": 1.0, "mixed": rng.uniform(0.3, 0.7)}.get(drag, 0.0)
    truth = {
        "theta0": amplitude,
        "phi": rng.uniform(-3, 3),
        "omega_g": omega,
        "alpha_d": (1 - share) * rate,
        "beta": share * rate * 3 * math.pi / (4 * omega * amplitude),
    }
    t = np.arange(0, rng.uniform(12, 30), 1 / 20)
    return {"truth": truth, "t": t, "drag": drag, "sigma": (3e-4, 1e-3, 3e-3)[int(rng.integers(3))]}


def lost(exact: ThetaSeries, model: str, truth: dict[str, float]) -> float:
    """χ² of a model fitted to an exact record: what the noise has to hide."""
    return fit(exact, model=model, thorough=False, start={"theta0": truth["theta0"]}).chi2


WORKED = {  # amplitude: k_d, its standard error, φ − 90°, χ²/dof, Durbin–Watson, runs z
    0.05: "7.9e-5 7e-5 -0.009 1.01 2.04 0.2",
    0.1: "1.14e-4 3.5e-5 -0.027 2.25 0.87 -12",
    0.2: "1.51e-4 1.8e-5 -0.110 80 0.031 -29",
    0.3: "2.29e-4 1.2e-5 -0.246 889 0.008 -32",
    0.5: "5.61e-4 0.8e-5 -0.685 17914 0.005 -33",
}
"""Small-angle fits of a real swing as they were worked out once, by other code and with other noise."""


def worked(seeds: int = 20) -> None:
    """Linear small-angle fits, ℓ and g held, of a 0.25 kg bob on 0.5 m with b = 6e-5, c = 3.3e-4 (20 s, 60 fps, 1 mrad).

    Each number is the mean over `seeds` draws of noise ± their scatter, beside the worked one and how many scatters it is
    away, what its last digit leaves open granted. The motion is SciPy's.
    """
    m, length = 0.25, 0.5
    scene = Scene(pendulum=Pendulum(m, length))
    omega = math.sqrt(9.80665 / length)
    truth = {"omega_g": omega, "alpha_d": 6e-5 / (2 * m), "beta": 3.3e-4 * length / m, "phi": math.pi / 2}

    def noisy(amplitude: float, t: np.ndarray, sigma: float, seed: int) -> ThetaSeries:
        theta = exact.setdefault((amplitude, t.size), independent({**truth, "theta0": amplitude}, t))
        noise = sigma * np.random.default_rng(seed).normal(size=t.size)
        return ThetaSeries(t, theta + noise, np.full(t.size, sigma))

    exact: dict[tuple[float, int], np.ndarray] = {}
    held = {"theta_offset": 0.0}
    print(f"mean of {seeds} draws of noise ± scatter | worked (scatters away)")
    t = np.arange(1200) / 60
    for amplitude, row in WORKED.items():
        runs = []
        for seed in range(seeds):
            r = fit(noisy(amplitude, t, 1e-3, seed), scene, "small_angle_linear_drag", fixed=held)
            i = r.free.index("k_d")
            plain = math.sqrt(r.problem.normal_inverse(r)[i, i])  # as for white noise
            phi = r.parameters["phi"].value - math.pi / 2
            runs.append(
                (r.parameters["k_d"].value, plain, phi, r.reduced_chi2, r.noise["durbin_watson"], r.noise["runs_z"])
            )
        print(f"A = {amplitude}")
        _beside(("k_d", "its u", "phi − 90°", "χ²/dof", "Durbin–Watson", "runs z"), runs, row)
    t = np.arange(1800) / 30
    names = ("full_linear_drag", "full_quadratic_drag", "full_linear_quadratic_drag")
    runs, free = [], []
    for seed in range(seeds):
        series = noisy(0.3, t, 2e-3, seed)
        lin, quad, both = (fit(series, scene, n) for n in names)
        i, j = both.free.index("k_d"), both.free.index("c")
        correlation = both.covariance[i, j] / math.sqrt(both.covariance[i, i] * both.covariance[j, j])
        runs.append((lin.reduced_chi2, quad.reduced_chi2, both.reduced_chi2, lin.aic - quad.aic, correlation))
        row = []
        for phase in ({}, {"phi": math.pi / 2}):
            r = fit(series, model="small_angle_linear_drag", fixed={**held, **phase})
            row += [100 * (1 - r.parameters["omega_g"].value ** 2 / omega**2), r.reduced_chi2, r.noise["durbin_watson"]]
        free.append(row)
    print("full sine, A = 0.3, 60 s, 30 fps, 2 mrad")
    _beside(("χ²/dof linear", "quadratic", "both", "ΔAIC", "corr(k_d, c)"), runs, "0.978 0.978 0.978 0.3 -1.000")
    columns = ("ω_g² lower by %", "χ²/dof", "Durbin–Watson")
    print("small angle with ω_g free and φ held at the release from rest (the worked row)")
    _beside(columns, [row[3:] for row in free], "1.10 1.22 1.56")
    print("small angle with ω_g and φ free: more is hidden")
    _beside(columns, [row[:3] for row in free])


def _beside(names: Sequence[str], runs: list[Any], worked: str = "") -> None:
    mean, scatter = np.mean(runs, axis=0), np.std(runs, axis=0, ddof=1)
    told = worked.split() or [""] * len(names)
    for name, at, width, text in zip(names, mean, scatter, told):
        line = f"    {name:16s}{at:12.4g} ± {width:<8.1g}"
        if text:
            rounded = 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)  # what its last digit leaves open
            away = max(abs(float(text) - at) - rounded, 0.0) / max(width, 1e-12)
            line += f" | {text:>10s} ({away:.1f})"
        print(line)


def starts(count: int) -> None:
    """Random starts of 5 parameters on the 7201-point record."""
    from toolkit.cost.fit import MODEL, TRUTH, record

    series = record()
    best = fit(series, model=MODEL, fixed={"theta_offset": 0.0})
    rng = np.random.default_rng(2)
    reached, times = 0, []
    for _ in range(count):
        start = {name: value * 2 ** rng.uniform(-1, 1) for name, value in TRUTH.items()}
        began = time.process_time()
        result = fit(series, model=MODEL, fixed={"theta_offset": 0.0}, start=start)
        times.append(time.process_time() - began)
        reached += abs(result.chi2 - best.chi2) < 1e-3
    print(f"{reached} of {count} random starts reach the minimum; {1e3 * np.median(times):.0f} ms of CPU each (median)")


def published(folder: Path) -> None:
    """Periods, their dependence on amplitude and damping beside what the recordings' makers published, with the reason for
    each difference above 2 σ put to the test: their own procedure is repeated on their own numbers."""
    if not folder.is_dir():
        sys.exit(f"{folder} is not there; give the folder that holds yyz/ and jlefebvre/")
    _yyz(folder / "yyz")
    _yyz2(folder / "yyz")
    _jlefebvre(folder / "jlefebvre")
    _jensen(folder / "jensen")


def _line(name: str, ours: float, u: float, theirs: float, their_u: float, unit: str = "") -> None:
    print(
        f"  {name:24s}ours {ours:9.5g} ± {u:<8.2g} published {theirs:9.5g} ± {their_u:<8.2g}{unit:4s}"
        f"{(ours - theirs) / math.hypot(u, their_u):+8.1f} σ"
    )


def _best(series: ThetaSeries) -> FitResult:
    fits = fit_models(series)
    best = fits[choose_model(fits)]
    print(f"  {best.model}, error bars × {best.noise['inflation']:.1f} for correlated residuals", end="")
    print(f", residuals {1e3 * best.noise['sigma_rad']:.2g} mrad")
    return best


def _decay(best: FitResult, series: ThetaSeries, level: float) -> float:
    """Time in s until the fitted amplitude has fallen to `level` of its first value; nan where it does not."""
    amplitude = amplitude_of(best)
    below = np.flatnonzero(amplitude < level * amplitude[0])
    return float(series.t_s[below[0]] - series.t_s[0]) if below.size else math.nan


def _exponential(best: FitResult, series: ThetaSeries) -> float:
    """τ of one exponential put through the envelope by least squares, the usual way."""
    from scipy.optimize import curve_fit

    amplitude, t = amplitude_of(best), series.t_s - series.t_s[0]
    (_, tau), _ = curve_fit(lambda x, a, tau: a * np.exp(-x / tau), t, amplitude, p0=(amplitude[0], t[-1] / 2))
    return float(tau)


def _curvature(peak: np.ndarray) -> float:
    """C of T = T₀ (1 + C A²) put through the exact law over these amplitudes."""
    ratio = period_of(peak, 1.0)
    return float(np.linalg.lstsq(np.stack([np.ones_like(peak), peak**2], axis=1), ratio, rcond=None)[0] @ (0, 1))


def _yyz(folder: Path) -> None:
    table = np.loadtxt(folder / "lab1_tracker.txt", skiprows=1, usecols=(0, 1))
    series = ThetaSeries(table[:, 0], np.radians(table[:, 1]))
    print("yyz/lab1_tracker.txt")
    best = _best(series)
    t0 = best.derived["T0"]
    _line("T0", t0.value, t0.stderr or 0.0, 1.1026, 0.0004, "s")
    angle, period, _, _ = np.loadtxt(folder / "lab1_sorted_angle_vs_period.txt", skiprows=1).T
    columns = np.stack([np.ones_like(angle), angle, angle**2], axis=1)
    a, b, c = np.linalg.lstsq(columns, period, rcond=None)[0]
    exact = np.linalg.lstsq(columns, period_of(np.abs(angle), t0.value), rcond=None)[0]
    u = math.hypot(t0.stderr or 0.0, 0.0004)
    print(
        f"    their quadratic T0 (1 + B A + C A²) through their table: T0 = {a:.4f} s, B = {b / a:.4f}, C = {c / a:.4f}; their periods are "
        f"whole frames: one frame more gives {a + 1 / 30:.4f} s, C = {c / (a + 1 / 30):.4f} (0.0700 ± 0.0007)\n"
        f"    the same quadratic through the exact T(A) with our T0 at their angles (up to {np.abs(angle).max():.2f} rad): "
        f"T0 = {exact[0]:.4f} s, C = {exact[2] / exact[0]:.4f}: the shape takes {1e3 * (t0.value - exact[0]):.1f} ms off T0; "
        f"without that {(exact[0] - 1.1026) / u:+.1f} σ are left"
    )
    found = cycles(series, best)
    law = np.stack([np.ones_like(found.amplitude_rad), found.amplitude_rad**2], axis=1)
    (a3, c3), _, _, _ = np.linalg.lstsq(law, found.period_s, rcond=None)
    print(
        f"    periods that we measure on the record, cycle by cycle ({found.t_s.size}): T0 = {a3:.4f} s, C = {c3 / a3:.4f}"
    )
    tau = _exponential(best, series)
    print(
        f"    τ of one exponential through our envelope: {tau:.1f} s (published 194.1 ± 0.8 s); Q = π τ / T0 = {math.pi * tau / t0.value:.0f} (538 ± 4)"
    )
    print(
        f"    but the envelope is no exponential: Q at θ₀ is {best.derived['Q'].value:.0f}, to 1/e it takes {_decay(best, series, math.exp(-1)):.0f} s"
    )


def _yyz2(folder: Path) -> None:
    table = np.loadtxt(folder / "lab2_tracker_one_length.txt", skiprows=1, usecols=(0, 1))
    series = ThetaSeries(table[:, 0], np.radians(table[:, 1]))
    print(
        "yyz/lab2_tracker_one_length.txt (nothing published for it alone): the small-angle fit is the better one, and why"
    )
    fits = fit_models(series)
    for name in ("small_angle_linear_drag", "full_linear_drag", "full_linear_quadratic_coulomb"):
        r = fits[name]
        print(f"    {name:32s}T0 = {r.derived['T0'].value:.5f} s, residuals {1e3 * r.noise['sigma_rad']:.1f} mrad")
    quarters = np.linspace(0.0, series.duration_s, 5)
    print("    the full sine in each quarter alone:")
    for start, stop in itertools.pairwise(quarters):
        r = fit(series.between(start, stop), model="full_linear_drag")
        t0 = r.derived["T0"]
        print(
            f"      {start:5.1f} to {stop:5.1f} s, up to {r.parameters['theta0'].value:.2f} rad: T0 = {t0.value:.5f} ± {t0.stderr:.1g} s, "
            f"residuals {1e3 * r.noise['sigma_rad']:.1f} mrad"
        )
    for finding in diagnose(series, fits):
        if finding.assumption in ("small_angle", "clock", "geometry"):
            print(f"    {finding.assumption}, {finding.verdict}: {finding.sentence}")


def _jlefebvre(folder: Path) -> None:
    table = np.loadtxt(folder / "q2_data.txt", skiprows=1, usecols=(0, 1))
    series = ThetaSeries(table[:, 0], table[:, 1])
    print("jlefebvre/q2_data.txt")
    best = _best(series)
    t0 = best.derived["T0"]
    _line("T0", t0.value, t0.stderr or 0.0, 2.1577, 0.0002, "s")
    found = cycles(series, best)
    for stop in (60.0, 120.0, 180.0, 375.0):
        early = found.t_s < stop
        print(
            f"    mean of the periods measured in the first {stop:3.0f} s ({early.sum():3d} cycles, "
            f"{found.amplitude_rad[early].max():.2f}–{found.amplitude_rad[early].min():.2f} rad): {found.period_s[early].mean():.4f} s"
        )
    at = float(np.interp(-2.1577, -period_of(np.linspace(1.4, 0.1, 400), t0.value), np.linspace(1.4, 0.1, 400)))
    print(f"    2.1577 s is the period at {at:.2f} rad; at 0 it is {t0.value:.4f} s: a mean over a large swing, not T0")
    tau = _exponential(best, series)
    print(
        f"    τ of one exponential through our envelope: {tau:.0f} s (published 240 ± 20 s); Q = {math.pi * tau / 2.1577:.0f} with their T (350 ± 30)"
    )
    lengths = np.loadtxt(folder / "q4a_data.txt", skiprows=1)
    print("jlefebvre/*.trk, five lengths (length by tape; their periods are of half swings, so doubled here)")
    for i in range(1, 6):
        series = read_series(folder / f"pendulum_length{i}.trk")
        result = fit(series, model="full_linear_drag")
        if not result.success:
            print(f"  length{i}: {result.message}")
            continue
        tape, half, _, u_half = lengths[i - 1]
        amplitude = amplitude_of(result)
        mean = float(np.mean(period_of(amplitude, result.derived["T0"].value)))
        u = (result.derived["T0"].stderr or 0.0) * mean / result.derived["T0"].value
        own = result.derived["equivalent_length"]
        _line(f"mean T of length{i}", mean, u, 2 * half, 2 * u_half, "s")
        print(f"      equivalent length {own.value:.4f} ± {own.stderr:.1g} m, tape {tape:.4f} m")


def _jensen(folder: Path) -> None:
    print("jensen (nothing published but the traces): friction at the pivot stops it")
    for path in sorted(folder.glob("*.txt")):
        series = read_series(path)
        fits = fit_models(series.between(0.5, None))
        best = fits[choose_model(fits)]
        t0, mu = best.derived.get("T0"), best.parameters.get("mu")
        print(f"  {path.name}: {best.model}, success {best.success}", end="")
        if t0 is not None:
            print(f", T0 = {t0.value:.4f} ± {t0.stderr:.1g} s", end="")
        if mu is not None:
            print(f", μ = {mu.value:.3g} ± {mu.stderr:.1g} 1/s²", end="")
        print(f", residuals {1e3 * best.noise['sigma_rad']:.2g} mrad")


if __name__ == "__main__":
    main()
