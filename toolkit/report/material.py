"""What the report's figures and tables are made of, computed once from an Analysis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import PendulabError
from toolkit.report.words import Words

if TYPE_CHECKING:
    from toolkit.analyse import Analysis
    from toolkit.fit import FitResult, FittedParameter
    from toolkit.fitting.cycles import Cycles

PAPER = "small_angle_linear_drag"
DRAGS = ("k_d", "alpha_d", "c", "beta", "torque", "mu")
"""The parameters that a drag model has, in the order they are told."""


@dataclass(frozen=True)
class Curve:
    """A model on a dense grid: θ, θ̇, tension over weight, energy over m g ℓ, and each one's standard uncertainty."""

    t_s: np.ndarray
    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    tension: np.ndarray
    energy: np.ndarray
    theta_u: np.ndarray | None
    omega_u: np.ndarray | None
    tension_u: np.ndarray | None
    energy_u: np.ndarray | None


@dataclass(frozen=True)
class Material:
    """The analysis with what follows from it; arrays are computed when a figure first asks."""

    analysis: Analysis
    words: Words

    @property
    def t(self) -> np.ndarray:
        """Times of the points, s."""
        return self.analysis.series.t_s

    @property
    def theta(self) -> np.ndarray:
        """Measured angles, rad."""
        return self.analysis.series.theta_rad

    @property
    def best(self) -> FitResult:
        """The preferred model's fit."""
        return self.analysis.fits[self.analysis.preferred]

    @property
    def paper(self) -> FitResult | None:
        """The small-angle, linear-drag fit, where it was made."""
        return self.analysis.fits.get(PAPER)

    @cached_property
    def full_sine(self) -> FitResult:
        """The best fit with the full sine: its small-swing period is not biased by the swing's width."""
        full = [r for r in self.analysis.fits.values() if r.success and r.model.startswith("full")]
        return self.best if any(r is self.best for r in full) or not full else min(full, key=lambda r: r.chi2)

    @property
    def usable(self) -> bool:
        """Whether the preferred fit gave a motion to draw."""
        return bool(
            self.best.success and np.all(np.isfinite(self.best.theta_rad)) and len(self.best.theta_rad) == self.t.size
        )

    @cached_property
    def offset(self) -> float:
        """The fitted zero of the angle, rad."""
        return value(self.best, "theta_offset") or 0.0

    @cached_property
    def omega_g(self) -> float:
        """√(g/ℓ) in rad/s, from the fit; NaN where there is none."""
        for name in ("omega_g",):
            found = value(self.best, name)
            if found:
                return found
        period = value(self.best, "T0")
        if period:
            return 2 * math.pi / period
        length = value(self.best, "length")
        g = self.analysis.scene.environment.gravity_m_per_s2
        return math.sqrt(g / length) if length else math.nan

    @cached_property
    def cycles(self) -> Cycles | None:
        """Amplitude and period of each swing, None where there are fewer than three."""
        from toolkit.fitting.cycles import cycles

        found = cycles(self.analysis.series, self.best if self.best.success else None)
        return found if found.t_s.size >= 3 else None

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Amplitude at the record's start and end, rad: the model's, else that of the first and last swing."""
        from toolkit.fitting.cycles import amplitude_of

        if self.usable and np.all(np.isfinite(envelope := amplitude_of(self.best))):
            scale = 1 + (value(self.best, "angle_scale") or 0.0)  # as the camera sees it
            return scale * float(envelope[0]), scale * float(envelope[-1])
        assert self.cycles is not None
        return float(self.cycles.amplitude_rad[0]), float(self.cycles.amplitude_rad[-1])

    @cached_property
    def explained(self) -> float:
        """Share of the angle's variance that the preferred model explains; 0 where it is not usable."""
        if not self.usable:
            return 0.0
        return max(0.0, 1 - float(np.var(self.best.residuals_rad)) / (float(np.var(self.theta)) or 1.0))

    @cached_property
    def sigma(self) -> float:
        """Scatter of a point about the preferred model, rad."""
        sigma = self.best.noise.get("sigma_rad")
        if sigma:
            return float(sigma)
        return float(np.std(self.best.residuals_rad)) if self.usable else math.nan

    def problem(self, result: FitResult) -> Any | None:
        """What was solved for `result`, to evaluate its motion at other times; None where that is not possible."""
        from toolkit.fitting.problem import pose

        if result.problem is not None:
            return result.problem
        try:
            return pose(self.analysis.series, self.analysis.scene, result.model)
        except PendulabError:  # a fit made otherwise: its figures are drawn at the measured times
            return None

    def curve(self, result: FitResult, t_s: np.ndarray) -> Curve:
        """The model of `result` at `t_s` with the band that its covariance gives."""
        from toolkit.fitting.uncertainty import bands

        problem = self.problem(result)
        if problem is None:
            at = np.clip(np.searchsorted(self.t, t_s), 0, self.t.size - 1)
            theta, omega = result.theta_rad[at], result.omega_rad_per_s[at]
            tension = np.cos(theta - self.offset) + (omega / self.omega_g) ** 2
            energy = (omega / self.omega_g) ** 2 / 2 + 1 - np.cos(theta - self.offset)
            return Curve(self.t[at], theta, omega, tension, energy, None, None, None, None)
        covariance, k = np.asarray(result.covariance, dtype=float), len(result.free)
        known = covariance.shape == (k, k) and bool(np.all(np.isfinite(covariance)))
        found = bands(replace(result, problem=problem, covariance=covariance if known else np.zeros((k, k))), t_s)
        values = found.theta_rad, found.omega_rad_per_s, found.tension, found.energy
        if not known:
            return Curve(t_s, *values, None, None, None, None)
        sigmas = found.sigma_theta_rad, found.sigma_omega_rad_per_s, found.sigma_tension, found.sigma_energy
        return Curve(t_s, *values, *sigmas)

    @cached_property
    def reduced(self) -> dict[str, float]:
        """α_d, β, μ and ω_g of the preferred model; empty where it was fitted otherwise."""
        problem = self.problem(self.best)
        if problem is None:
            return {}
        return dict(problem.reduce({name: p.value for name, p in self.best.parameters.items()})[0])

    @cached_property
    def measured_omega(self) -> np.ndarray:
        """θ̇ from the measured angles by central differences, rad/s (for pictures)."""
        return np.gradient(self.theta, self.t) if self.t.size > 2 else np.zeros_like(self.t)

    @cached_property
    def phase(self) -> np.ndarray:
        """Phase of the swing at each point, rad, 0 at the right turning point."""
        theta = self.best.theta_rad - self.offset
        return np.mod(np.arctan2(-self.best.omega_rad_per_s / self.omega_g, theta), 2 * np.pi)


def value(result: FitResult, name: str) -> float | None:
    """A fitted or derived number, None where the model has none."""
    found = parameter(result, name)
    return None if found is None or not math.isfinite(found.value) else float(found.value)


def parameter(result: FitResult, name: str) -> FittedParameter | None:
    """A fitted or derived parameter by name."""
    return result.parameters.get(name) or result.derived.get(name)


def thinned(n: int, limit: int) -> np.ndarray:
    """Indices of at most `limit` of `n` points, spread evenly but not in step with the swing (golden ratio)."""
    if n <= limit:
        return np.arange(n)
    steps = np.arange(limit)
    jitter = np.mod(steps * 0.618033988749895, 1.0)
    return np.unique(np.minimum(((steps + jitter) * n / limit).astype(int), n - 1))


def binned(x: np.ndarray, y: np.ndarray, bins: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean of y in equal bins of x with the standard error of each mean: (centre, mean, error)."""
    if x.size < 2 or np.ptp(x) == 0:
        return np.array([]), np.array([]), np.array([])
    edges = np.linspace(x.min(), x.max(), bins + 1)
    k = np.clip(np.digitize(x, edges) - 1, 0, bins - 1)
    count = np.bincount(k, minlength=bins)
    total, squares = np.bincount(k, y, bins), np.bincount(k, y * y, bins)
    full = count >= 3
    mean = total[full] / count[full]
    spread = np.sqrt(np.maximum(squares[full] / count[full] - mean**2, 0) / (count[full] - 1))
    return 0.5 * (edges[1:] + edges[:-1])[full], mean, spread
