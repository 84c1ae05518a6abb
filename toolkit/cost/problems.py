"""The motions that integrators are measured on, each with its truth in 36-digit arithmetic."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from toolkit.scene import Approximations, Environment, Pendulum, Release, Scene

_G = 9.8


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


def problems() -> tuple[Problem, ...]:
    """P1–P5 of the project's measurements, a driven one near resonance (D), a slack string (S) and the linear one (L)."""
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


def random_stiff_problem(seed: int, number: int) -> Problem:
    """A random scene, overdamped 20 to 500 times, at rest or pushed, with and without a drive: for the stiff route."""
    random = np.random.default_rng([seed, number, 1])
    mass, length, g = 10 ** random.uniform(-2, 0), 10 ** random.uniform(-1, 0.5), random.uniform(1, 20)
    rate, strength = math.sqrt(g / length), 10 ** random.uniform(1.3, 2.7)
    effects = {"linear_drag": {"k_d_kg_per_s": 2 * mass * rate * strength}}
    if random.random() < 0.5:
        f0, f = mass * g * 10 ** random.uniform(-2, 0.5), rate / (2 * math.pi) * 10 ** random.uniform(-1, 0.5)
        effects["cosine_drive"] = {"f0_n": f0, "f_hz": f, "phase_rad": 0.0}
    start, push = random.uniform(-3.1, 3.1), 0.0 if random.random() < 0.5 else 5 * rate * random.normal()
    scene = Scene(Pendulum(mass, length), Release(start, push), Environment(g_m_per_s2=g), effects)
    duration, samples = random.uniform(4000, 8000) / (2 * strength * rate), int(random.integers(5, 300))
    return Problem(f"stiff {seed}/{number}", ", ".join(effects), scene, duration, samples, duration, stiff=True)


def exact_coefficients(scene: Scene) -> tuple[Fraction, Fraction, Fraction, Fraction, Fraction]:
    """2α, β, g/ℓ, f₀/(mℓ), f of the scene's own floats, as ratios of whole numbers."""
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


def true_angles(problem: Problem, most: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Indices of up to `most` samples, and θ there, in 36-digit arithmetic that no method under test uses."""
    judged = np.unique(np.linspace(0, problem.samples - 1, min(most, problem.samples)).round().astype(int))
    t = problem.t_s[judged]
    if "slack_string" in problem.scene.effects:
        return judged, _true_slack(problem.scene, t)
    if problem.scene.approximations.small_angle:
        return judged, _true_linear(problem.scene, t)
    from toolkit.cost._reference import ExactPendulum, solve_exactly

    two_alpha, beta, gravity, drive, f_hz = exact_coefficients(problem.scene)
    exact = ExactPendulum(gravity, two_alpha, beta, drive, f_hz=f_hz)
    release = problem.scene.release
    return judged, np.array(solve_exactly(exact, release.theta0_rad, release.omega0_rad_per_s, list(t))[0])


def _true_linear(scene: Scene, t_s: np.ndarray) -> np.ndarray:
    """The linear equation by the textbook's complex exponentials, in mpmath at 40 digits."""
    import mpmath as mp

    with mp.workdps(40):
        two_alpha, _, square, drive, f_hz = (mp.mpf(v.numerator) / v.denominator for v in exact_coefficients(scene))
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
