"""What a check looks at: the record, the fits, the scene, and a way to fit one more model on the same footing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from toolkit.fit import FitResult, fit, has_full_sine
from toolkit.fitting.noise import Noise, measure_noise
from toolkit.scene import Scene
from toolkit.series import ThetaSeries

FAILS_BELOW_P = 5e-4
"""A verdict `fails` needs a chance below this that the simpler model is right after all."""


@dataclass(frozen=True)
class Evidence:
    """One record and all that is known of it. `extra` caches fits that checks asked for."""

    series: ThetaSeries
    fits: Mapping[str, FitResult]
    scene: Scene
    preferred: str
    extra: dict[str, FitResult] = field(default_factory=dict)

    @property
    def best(self) -> FitResult:
        """The full-sine fit with the lowest χ² (the preferred one where none has the full sine)."""
        full = [r for r in self.fits.values() if r.success and has_full_sine(r)]
        return min(full, key=lambda r: r.chi2) if full else self.fits[self.preferred]

    @property
    def inflation2(self) -> float:
        """Factor by which χ² differences overstate what is known: noise power at the pendulum's frequency over σ²."""
        return float(self.best.noise.get("inflation", 1.0)) ** 2

    @property
    def sigma_rad(self) -> np.ndarray:
        """(n,) σ of the points: the series' own, or the scatter about the best model."""
        if self.series.sigma_theta_rad is not None:
            return self.series.sigma_theta_rad
        return np.full(len(self.series), float(self.best.noise["sigma_rad"]))

    def fit(self, model: str) -> FitResult:
        """The fit of that model: as given, or made now with the same parameters free."""
        if model in self.fits:
            return self.fits[model]
        if model not in self.extra:
            like = self.best
            length = like.parameters.get("length")
            free = ("length",) if length is not None and not length.fixed else ()
            start = (
                {n: p.value for n, p in like.parameters.items() if not p.fixed} if model.startswith("full") else None
            )
            self.extra[model] = fit(self.series, self.scene, model, free=free, start=start, thorough=False)
        return self.extra[model]

    def chi2(self, result: FitResult) -> float:
        """χ² with this evidence's σ, divided by `inflation2`, and of the priors: differences of it are honest."""
        return float(np.sum((result.residuals_rad / self.sigma_rad) ** 2)) / self.inflation2 + result.prior_chi2

    def amplitude(self, t_s: np.ndarray | None = None) -> np.ndarray:
        """(n,) amplitude of the swing against time from the best fit, in rad: what its energy at t reaches."""
        omega_g = omega_g_of(self.best)
        offset = self.best.parameters["theta_offset"].value if "theta_offset" in self.best.parameters else 0.0
        theta, omega = self.best.theta_rad - offset, self.best.omega_rad_per_s
        height = np.sin(theta / 2) ** 2 + (omega / (2 * omega_g)) ** 2
        amplitude = 2 * np.arcsin(np.sqrt(np.clip(height, 0, 1)))
        return amplitude if t_s is None else np.interp(t_s, self.series.t_s, amplitude)

    def added(self, columns: np.ndarray) -> Added:
        """What the best fit would gain from `columns` (n, k) of θ beside its own parameters, all linearised.

        The noise is judged after the columns have taken their part: a real effect leaves white residuals behind, so its
        own correlation does not count against it.
        """
        best = self.best
        own, residual = self._beside_the_fit(columns)
        size = np.linalg.norm(own, axis=0)
        size = np.where(size > 0, size, np.inf)
        gram = (own / size).T @ (own / size)
        inverse = np.linalg.pinv(gram, rcond=1e-10)
        coefficient = inverse @ ((own / size).T @ residual)
        left = residual - (own / size) @ coefficient
        step = float(np.median(np.diff(self.series.t_s)))
        known = self.series.sigma_theta_rad is not None
        count = len(best.free) + columns.shape[1]
        common = best.problem.common_share
        noise = measure_noise(left, self.sigma_rad, known, omega_g_of(best), step, count, common=common)
        inflation2 = max(noise.inflation**2, 1e-30)
        gain = float(residual @ residual - left @ left) / inflation2
        u = np.sqrt(np.diag(inverse) * inflation2) / size
        return Added(gain, coefficient / size, u, noise)

    def scale_gain(self) -> float:
        """χ² that a common factor on all angles would take from the best fit (not corrected for the noise)."""
        best = self.best
        vertical = best.parameters["theta_offset"].value if "theta_offset" in best.parameters else 0.0
        return float(self.step_gain((best.theta_rad - vertical)[:, None])[0])

    def clock_gains(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """χ² that a jump of the clock, or a change of its rate, at each of `places` (k,) would take: (k,) each."""
        t, omega = self.series.t_s[:, None], self.best.omega_rad_per_s[:, None]
        later = t >= places[None, :]
        return self.step_gain(omega * later), self.step_gain(omega * np.where(later, t - places[None, :], 0.0))

    def places(self, count: int) -> np.ndarray:
        """(count,) moments spread over the record, its ends left out."""
        t = self.series.t_s
        return np.linspace(t[0] + 0.06 * (t[-1] - t[0]), t[-1] - 0.06 * (t[-1] - t[0]), count)

    def step_gain(self, columns: np.ndarray) -> np.ndarray:
        """(k,) χ² that each of `columns` (n, k) alone would take from the best fit, not yet corrected for the noise."""
        own, residual = self._beside_the_fit(columns)
        size2 = np.sum(own**2, axis=0)
        good = size2 > 1e-9 * np.sum((columns / self.sigma_rad[:, None]) ** 2, axis=0)
        return np.where(good, (own.T @ residual) ** 2 / np.where(good, size2, 1.0), 0.0)

    def _beside_the_fit(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns (n, k) and residuals (n,) over σ, less what the best fit's own parameters can do."""
        weight = 1 / self.sigma_rad
        basis = self._span
        own, residual = columns * weight[:, None], self.best.residuals_rad * weight
        return own - basis @ (basis.T @ own), residual - basis @ (basis.T @ residual)

    @cached_property
    def _span(self) -> np.ndarray:
        """Orthonormal columns that span what the best fit's parameters can do, over σ."""
        best = self.best
        _, by, _ = best.problem.predict({name: p.value for name, p in best.parameters.items()}, best.free)
        jacobian = by / self.sigma_rad[:, None]
        size = np.linalg.norm(jacobian, axis=0)
        u, s, _ = np.linalg.svd(jacobian[:, size > 0] / size[size > 0], full_matrices=False)
        return np.asarray(u[:, s > 1e-7 * s[0]])


@dataclass(frozen=True)
class Added:
    """A linear addition to the best fit: its honest Δχ², its coefficients with their u, and the noise left."""

    delta_chi2: float
    coefficients: np.ndarray
    sigmas: np.ndarray
    noise: Noise


def omega_g_of(result: FitResult) -> float:
    """ω_g of a fit, whichever way it is parametrised."""
    for table in (result.parameters, result.derived):
        if "omega_g" in table:
            return table["omega_g"].value
    return 2 * math.pi / result.derived["T0"].value


def boundary_p(delta_chi2: float, added: int) -> float:
    """p-value of a χ² gain by `added` (1 or 2) parameters that cannot be negative: the 50:50 (1:2:1) mixture."""
    from scipy.stats import chi2

    gain = max(delta_chi2, 0.0)
    if added == 1:
        return float(0.5 * chi2.sf(gain, 1))
    return float(0.5 * chi2.sf(gain, 1) + 0.25 * chi2.sf(gain, 2))


def sigmas(p_value: float) -> float:
    """A one-sided p-value as a number of standard deviations."""
    from scipy.stats import norm

    return float(min(norm.isf(max(p_value, 1e-300)), 37.0)) if p_value < 1 else 0.0
