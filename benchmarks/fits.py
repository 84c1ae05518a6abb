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
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from toolkit.diagnose import diagnose
from toolkit.fit import choose_model, fit, fit_models
from toolkit.models import load_model
from toolkit.scene import Pendulum, Scene
from toolkit.series import ThetaSeries

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
    """Pulls of the full linear model on its own records."""
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
            theta = load_model("full_linear_drag").motion(truth, t).theta * scale
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
            if definite and verdict != expected[name] or not definite and seen[name] > 25:
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


def worked() -> None:
    """Linear small-angle fits, ℓ and g held, of a 0.25 kg bob on 0.5 m with b = 6e-5, c = 3.3e-4 (20 s, 60 fps, 1 mrad)."""
    m, length = 0.25, 0.5
    scene = Scene(pendulum=Pendulum(m, length))
    omega = math.sqrt(9.80665 / length)
    truth = {"omega_g": omega, "alpha_d": 6e-5 / (2 * m), "beta": 3.3e-4 * length / m, "phi": math.pi / 2}
    t = np.arange(1201) / 60
    table = {0.05: 1.01, 0.1: 2.25, 0.2: 80, 0.3: 889, 0.5: 17914}
    print(
        f"{'A':>6s}{'k_d fit':>12s}{'±':>10s}{'phi − 90°':>11s}{'χ²/dof':>10s}{'(table)':>10s}{'DW':>8s}{'runs z':>8s}"
    )
    for amplitude, printed in table.items():
        theta = load_model("full_linear_quadratic_drag").motion({**truth, "theta0": amplitude}, t).theta
        series = ThetaSeries(t, theta + 1e-3 * np.random.default_rng(3).normal(size=t.size), np.full(t.size, 1e-3))
        r = fit(series, scene, "small_angle_linear_drag", fixed={"theta_offset": 0.0})
        k_d = r.parameters["k_d"]
        plain = (k_d.stderr or 0.0) / r.noise["inflation"]
        print(
            f"{amplitude:6.2f}{k_d.value:12.3g}{plain:10.1g}{r.parameters['phi'].value - math.pi / 2:11.3f}{r.reduced_chi2:10.2f}"
            f"{printed:10.5g}{r.noise['durbin_watson']:8.3f}{r.noise['runs_z']:8.1f}"
        )
    t = np.arange(1801) / 30
    theta = load_model("full_linear_quadratic_drag").motion({**truth, "theta0": 0.3}, t).theta
    series = ThetaSeries(t, theta + 2e-3 * np.random.default_rng(3).normal(size=t.size), np.full(t.size, 2e-3))
    fits = {n: fit(series, scene, n) for n in ("full_linear_drag", "full_quadratic_drag", "full_linear_quadratic_drag")}
    both = fits["full_linear_quadratic_drag"]
    i, j = both.free.index("k_d"), both.free.index("c")
    correlation = both.covariance[i, j] / math.sqrt(both.covariance[i, i] * both.covariance[j, j])
    print(
        "full sine, A = 0.3, 60 s, 30 fps, 2 mrad: χ²/dof", *(f"{r.reduced_chi2:.3f}" for r in fits.values()), end="; "
    )
    print(
        f"ΔAIC(lin − quad) = {fits['full_linear_drag'].aic - fits['full_quadratic_drag'].aic:.1f}; corr(b, c) = {correlation:.3f}"
    )
    free = fit(series, model="small_angle_linear_drag")
    low = 1 - free.parameters["omega_g"].value ** 2 / omega**2
    print(
        f"small angle with ω_g free: ω_g² lower by {100 * low:.2f} %, χ²/dof {free.reduced_chi2:.2f}, DW {free.noise['durbin_watson']:.2f}"
    )


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
    """T₀, Q and τ beside what the recordings' makers published."""
    if not folder.is_dir():
        sys.exit(f"{folder} is not there; give the folder that holds yyz/ and jlefebvre/")
    for name, degrees, t0, u in (
        ("yyz/lab1_tracker.txt", True, 1.1026, 0.0004),
        ("jlefebvre/q2_data.txt", False, 2.1577, 0.0002),
    ):
        table = np.loadtxt(folder / name, skiprows=1, usecols=(0, 1))
        series = ThetaSeries(table[:, 0], np.radians(table[:, 1]) if degrees else table[:, 1])
        fits = fit_models(series)
        best = fits[choose_model(fits)]
        found = best.derived["T0"]
        difference = (found.value - t0) / math.hypot(found.stderr or 0.0, u)
        print(
            f"{name}: {best.model}; T0 = {found.value:.5f} ± {found.stderr:.5f} s, published {t0} ± {u}: {difference:.1f} σ"
        )
        for one in ("Q", "decay_time", "equivalent_length"):
            if one in best.derived:
                p = best.derived[one]
                print(f"    {one} = {p.value:.5g} ± {p.stderr:.2g} {p.unit}")


if __name__ == "__main__":
    main()
