"""Error bars by other roads: block bootstrap, profile likelihood and (extra) MCMC; bands for θ, θ̇, tension and energy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolkit.errors import UsageError
from toolkit.fit import FitResult
from toolkit.progress import Progress, silent
from toolkit.registry import did_you_mean


@dataclass(frozen=True)
class Sampled:
    """Parameter values (m, k) drawn or refitted, one column a name in `names`; `method` says how."""

    names: tuple[str, ...]
    values: np.ndarray
    method: str

    def stderr(self, name: str) -> float:
        """Standard deviation of one parameter."""
        return float(np.std(self.values[:, self.names.index(name)], ddof=1))

    def interval(self, name: str, level: float = 0.6827) -> tuple[float, float]:
        """Equal-tailed interval of one parameter."""
        low, high = np.quantile(self.values[:, self.names.index(name)], [(1 - level) / 2, (1 + level) / 2])
        return float(low), float(high)


def bootstrap(
    result: FitResult, count: int = 100, block_s: float | None = None, seed: int = 0, progress: Progress = silent
) -> Sampled:
    """Moving-block bootstrap: residuals are drawn in blocks (default two periods: correlation inside a block survives),
    added to the model and fitted again. Raises UsageError where the fit failed or the record is under four blocks."""
    problem = _solved(result)
    t = problem.t_s
    omega = problem.reduce(_values(result))[0]["omega_g"]
    block_s = 2 * 2 * math.pi / omega if block_s is None else block_s
    step = float(np.median(np.diff(t)))
    length = max(1, round(block_s / step))
    n = t.size
    if n < 4 * length:
        raise UsageError(f"a block of {block_s:.3g} s is over a quarter of the record; give a shorter block_s")
    generator = np.random.default_rng(seed)
    sigma = np.asarray(problem.sigma)
    normalised = result.residuals_rad / sigma
    normalised = normalised * math.sqrt(n / max(result.dof, 1))
    start = _values(result)
    rows = []
    for i in range(count):
        progress("bootstrap", i / count)
        first = generator.integers(0, n - length + 1, size=-(-n // length))
        drawn = (first[:, None] + np.arange(length)[None, :]).ravel()[:n]
        drawn = np.minimum(drawn, n - 1)
        again = _refit(problem, result.theta_rad + normalised[drawn] * sigma, start)
        if again is not None:
            rows.append([again[name] for name in result.free])
    progress("bootstrap", 1.0)
    if len(rows) < max(3, count // 2):
        raise UsageError("most bootstrap fits failed; use the plain error bars")
    return Sampled(result.free, np.array(rows), f"moving blocks of {block_s:.3g} s")


def profile(result: FitResult, name: str, level: float = 0.6827) -> tuple[float, float]:
    """Interval of one parameter by profile likelihood: all others are fitted again at each value, and Δχ² (over the
    noise's inflation) reaches the level's quantile. At a bound the interval ends there. Raises UsageError for a name
    that is not free."""
    from scipy.optimize import brentq
    from scipy.stats import chi2

    problem = _solved(result)
    if name not in result.free:
        raise UsageError(f"{name!r} is not a free parameter of this fit{did_you_mean(name, result.free)}")
    limit = float(chi2.ppf(level, 1)) * float(result.noise["inflation"]) ** 2 * _weight(result)
    start = _values(result)
    best = start[name]
    u = result.parameters[name].stderr or abs(best) * 0.01 or 1e-6
    least = problem.cost_at(start, ())

    def excess(value: float) -> float:
        found = problem.cost_at({**start, name: value}, tuple(n for n in result.free if n != name))
        return found - least - limit

    ends = []
    lowest = result.parameters[name].minimum
    for sign in (-1, 1):
        reach = u
        edge = best
        while True:
            edge = best + sign * reach
            if sign < 0 and lowest is not None and edge <= lowest:
                edge = lowest
                break
            if excess(edge) > 0 or reach > 64 * u:
                break
            reach *= 1.7
        ends.append(edge if excess(edge) <= 0 else float(brentq(excess, best, edge, xtol=1e-3 * u)))
    return ends[0], ends[1]


def sample_posterior(result: FitResult, steps: int = 500, walkers: int = 32, seed: int = 0) -> Sampled:
    """MCMC over the free parameters with emcee (the extra `mcmc`), flat priors within the bounds beside those of the fit;
    the likelihood is tempered by the noise's inflation. The first half is thrown away. Raises UsageError without emcee."""
    try:
        import emcee
    except ImportError as error:
        raise UsageError("emcee is not installed; install pendulab[mcmc]") from error
    problem = _solved(result)
    names = result.free
    centre = np.array([result.parameters[n].value for n in names])
    scale = np.sqrt(np.maximum(np.diag(result.covariance), 1e-300))
    temper = float(result.noise["inflation"]) ** 2 * _weight(result)
    start = _values(result)
    drags = [i for i, n in enumerate(names) if result.parameters[n].minimum == 0.0]

    def log_probability(x: np.ndarray) -> float:
        point = centre + x * scale
        if any(point[i] < 0 for i in drags):
            return -math.inf
        return -0.5 * problem.cost_at({**start, **dict(zip(names, point))}, ()) / temper

    generator = np.random.default_rng(seed)
    correlation = result.covariance / np.outer(scale, scale)
    begin = generator.multivariate_normal(
        np.zeros(len(names)), correlation, size=max(walkers, 2 * len(names) + 2), method="eigh"
    )
    for i in drags:
        begin[:, i] = np.abs(centre[i] / scale[i] + begin[:, i]) - centre[i] / scale[i]
    sampler = emcee.EnsembleSampler(begin.shape[0], len(names), log_probability)
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(begin, steps)
    chain = sampler.get_chain(discard=steps // 2, flat=True)
    return Sampled(names, centre + chain * scale, f"emcee, {begin.shape[0]} walkers, {steps} steps")


@dataclass(frozen=True)
class Bands:
    """The fitted motion with its standard uncertainty at times t_s, (n,) each. sigma_* hold what the parameters' covariance
    brings, not the scatter of the points.

    theta_rad is as the camera sees it. tension is over the weight and energy over m g ℓ, both 1-D and always there;
    tension_n and energy_j need the mass and are None without.
    """

    theta_rad: np.ndarray
    sigma_theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    sigma_omega_rad_per_s: np.ndarray
    tension: np.ndarray
    sigma_tension: np.ndarray
    energy: np.ndarray
    sigma_energy: np.ndarray
    tension_n: np.ndarray | None = None
    sigma_tension_n: np.ndarray | None = None
    energy_j: np.ndarray | None = None
    sigma_energy_j: np.ndarray | None = None


def bands(result: FitResult, t_s: np.ndarray | None = None) -> Bands:
    """θ(t), θ̇(t), T/(m g) = cos θ + θ̇²/ω_g² and E/(m g ℓ) = θ̇²/(2ω_g²) + 1 − cos θ of a fit (θ from the vertical), with u
    from the covariance through the analytic derivatives, at `t_s` (default: the series' times). `small_angle` models too."""
    problem, values, names = _solved(result), _values(result), result.free
    motion = problem.motion(values, None if t_s is None else t_s - problem.shift_s, names)
    omega_g = problem.reduce(values)[0]["omega_g"]
    g = problem.scene.environment.gravity_m_per_s2
    by_omega_g = np.zeros(len(names))
    if "omega_g" in names:
        by_omega_g[names.index("omega_g")] = 1.0
    elif "length" in names:
        by_omega_g[names.index("length")] = -omega_g / (2 * values["length"])

    def spread(by: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", by, result.covariance, by), 0.0))

    scale = 1 + values.get("angle_scale", 0.0)
    d_seen = scale * motion.d_theta
    for name, by in (("theta_offset", 1.0), ("angle_scale", motion.theta)):
        if name in names:
            d_seen[:, names.index(name)] = by
    theta, omega, sine = motion.theta, motion.omega / omega_g, np.sin(motion.theta)[:, None]
    d_omega = motion.d_omega / omega_g - omega[:, None] * by_omega_g / omega_g  # of θ̇/ω_g
    tension, d_tension = np.cos(theta) + omega**2, 2 * omega[:, None] * d_omega - sine * motion.d_theta
    energy, d_energy = omega**2 / 2 + 1 - np.cos(theta), omega[:, None] * d_omega + sine * motion.d_theta
    found = Bands(
        scale * theta + values.get("theta_offset", 0.0),
        spread(d_seen),
        motion.omega,
        spread(motion.d_omega),
        tension,
        spread(d_tension),
        energy,
        spread(d_energy),
    )
    mass = problem.scene.pendulum.mass_kg
    if mass is None:
        return found
    depth = values.get("length", g / omega_g**2)
    return replace(
        found,
        tension_n=mass * g * tension,
        sigma_tension_n=mass * g * found.sigma_tension,
        energy_j=mass * g * depth * energy,
        sigma_energy_j=mass * g * depth * spread(d_energy - 2 * energy[:, None] * by_omega_g / omega_g),
    )


def small_angle_bias(fits: Mapping[str, FitResult], preferred: str) -> dict[str, float]:
    """What the paper's model reports for k_d (or alpha_d) beside the preferred model's equivalent linear value at θ₀.

    Returns value and u of both and `difference_sigma`; empty where either lacks it.
    """
    paper, best = fits.get("small_angle_linear_drag"), fits.get(preferred)
    if paper is None or best is None:
        return {}
    name = "k_d" if "k_d" in paper.parameters else "alpha_d"
    linear = best.derived.get("equivalent_" + name)
    reported = paper.parameters[name]
    if linear is None or linear.stderr is None or reported.stderr is None:
        return {}
    u = math.hypot(linear.stderr, reported.stderr)
    return {
        "paper": reported.value,
        "paper_u": reported.stderr,
        "preferred": linear.value,
        "preferred_u": linear.stderr,
        "difference_sigma": (reported.value - linear.value) / u if u else math.inf,
    }


def _solved(result: FitResult) -> Any:
    if result.problem is None or not np.all(np.isfinite(result.covariance)):
        raise UsageError(f"the fit of {result.model} failed ({result.message}); there is nothing to vary")
    return result.problem


def _values(result: FitResult) -> dict[str, float]:
    return {name: p.value for name, p in result.parameters.items()}


def _weight(result: FitResult) -> float:
    """Factor between the problem's own χ² and the one of the noise: the scatter² where σ came from the residuals."""
    if result.problem.sigma_known:
        return 1.0
    return float(result.noise["sigma_rad"]) ** 2


def _refit(problem: Any, theta: np.ndarray, start: Mapping[str, float]) -> dict[str, float] | None:
    series = replace(problem.series, theta_rad=theta)
    found = replace(problem, series=series).values_at_best(start)
    return None if found is None else dict(found)
