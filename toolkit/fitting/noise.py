"""What the residuals of a fit say about the noise, and what that does to the error bars.

White noise needs nothing. Correlated residuals leave the fitted values nearly unbiased but make the usual errors too
small, by √(S(ω)/σ²) with S the noise spectrum at the pendulum's own frequency. The residuals are described by an
autoregression; the covariance of the parameters is then A⁻¹ (Jᵀ R J) A⁻¹ with R the correlation that it implies,
which gives each parameter the noise of the frequencies that it listens to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

_LARGEST_ORDER = 8
_WHITE_P = 1e-3
_LAGS = 20
_GRID = 1 << 14
_MOST_TAKEN = 0.5


@dataclass(frozen=True)
class Noise:
    """The noise of one fit.

    sigma_rad : rms scatter of a point.    source : "series" (σ given) or "residuals" (σ estimated).
    scale : residual scatter over the σ that weighted the fit (1 where σ came from the residuals).
    scale_used : the factor on error bars: 1 where the given σ agrees with the scatter, or holds what scatter cannot show.
    rho1 : residual autocorrelation at one step.    durbin_watson, ljung_box_p, runs_z : tests of whiteness.
    white : True where they find nothing.    coefficients : of the autoregression that describes the residuals.
    inflation : √(S(ω)/σ²) at the pendulum's frequency: error bars over those for white noise of the σ used.
    effective_points : n / inflation².
    """

    sigma_rad: float
    source: str
    scale: float
    scale_used: float
    rho1: float
    durbin_watson: float
    ljung_box_p: float
    runs_z: float
    white: bool
    coefficients: tuple[float, ...]
    inflation: float
    effective_points: float

    def as_dict(self) -> dict[str, float | str | bool | list[float]]:
        """Plain numbers for FitResult.noise and fit.json."""
        return {
            "sigma_rad": self.sigma_rad,
            "source": self.source,
            "scale": self.scale,
            "scale_used": self.scale_used,
            "rho1": self.rho1,
            "durbin_watson": self.durbin_watson,
            "ljung_box_p": self.ljung_box_p,
            "runs_z": self.runs_z,
            "white": self.white,
            "autoregression": list(self.coefficients),
            "inflation": self.inflation,
            "effective_points": self.effective_points,
        }


def measure_noise(
    normalised: np.ndarray,
    sigma_rad: np.ndarray | float,
    known: bool,
    omega: float,
    step_s: float,
    free: int,
    jacobian: np.ndarray | None = None,
    common: float = 0.0,
) -> Noise:
    """The noise from residuals divided by the σ used (`normalised`, (n,)).

    known : whether σ came with the series.    omega : the pendulum's, rad/s.    step_s : typical time between points.
    free : number of fitted parameters.    jacobian : (n, k) derivatives over σ; with it what the fit took out of correlated
    noise is put back. The residuals of a fit are poorest where the fit listens, at the pendulum's frequency, and short
    records of slow noise would else get error bars too small by a tenth.    common : what share of a given σ (rms) is of errors
    that return with the angle: the motion that is fitted follows them, so that scatter below σ is no sign that they are small.
    """
    n = normalised.size
    dof = max(n - free, 1)
    scale = math.sqrt(float(normalised @ normalised) / dof)
    sigma = float(np.sqrt(np.mean(np.square(sigma_rad)))) * scale
    if n < 8 or not scale > 0 or not math.isfinite(scale):
        return Noise(sigma, "series" if known else "residuals", scale, 1.0, 0.0, 2.0, 1.0, 0.0, True, (), 1.0, float(n))
    r = normalised / scale
    rho = autocorrelation(r, min(_LAGS, n // 4))
    durbin = float(np.sum(np.diff(r) ** 2) / (r @ r))
    p = ljung_box(rho, n)
    white = p > _WHITE_P
    coefficients, put_back, alike = np.empty(0), 0.0, 1.0
    if not white:
        coefficients = autoregression(r)
        if jacobian is not None and coefficients.size:
            coefficients, put_back = _with_what_the_fit_took(r, coefficients, jacobian)
            scale *= math.sqrt((1 - free / n) / (1 - put_back))
            sigma *= math.sqrt((1 - free / n) / (1 - put_back))
        power = _power(coefficients, _GRID)
        alike = float(np.mean(power**2) / np.mean(power) ** 2)  # Σ ρ²: so many points tell the variance as one
    agrees = abs(scale**2 - 1) < 4 * math.sqrt(2 * alike / dof)
    used = 1.0 if known and agrees else scale
    if known and used < 1:
        used = min(math.hypot(used, common), 1.0)
    inflation = used * math.sqrt(spectrum(coefficients, omega * step_s))
    return Noise(
        sigma_rad=sigma,
        source="series" if known else "residuals",
        scale=scale,
        scale_used=used,
        rho1=float(rho[0]) if rho.size else 0.0,
        durbin_watson=durbin,
        ljung_box_p=p,
        runs_z=runs_z(r),
        white=white,
        coefficients=tuple(float(c) for c in coefficients),
        inflation=inflation,
        effective_points=n / max(inflation / used, 1e-3) ** 2,
    )


def autocorrelation(x: np.ndarray, lags: int) -> np.ndarray:
    """Autocorrelation of x at lags 1 … `lags` (biased estimate, mean not removed: residuals have none)."""
    return np.array([x[k:] @ x[:-k] for k in range(1, lags + 1)]) / (x @ x)


def ljung_box(rho: np.ndarray, n: int) -> float:
    """p-value of Ljung and Box's Q = n(n+2) Σ ρ_k²/(n−k) against χ² with one degree of freedom a lag."""
    from scipy.special import chdtrc

    lag = np.arange(1, rho.size + 1)
    return float(chdtrc(rho.size, n * (n + 2) * np.sum(rho**2 / (n - lag))))


def runs_z(x: np.ndarray) -> float:
    """Wald and Wolfowitz's runs test of the signs, as a number of standard deviations (negative: too few runs)."""
    above = x > 0
    up, down = int(above.sum()), int((~above).sum())
    n = up + down
    if up == 0 or down == 0:
        return -math.sqrt(n)
    runs = 1 + int(np.count_nonzero(above[1:] != above[:-1]))
    both = 2.0 * up * down
    return (runs - 1 - both / n) / math.sqrt(both * (both - n) / (n**2 * (n - 1.0)))


def autoregression(x: np.ndarray) -> np.ndarray:
    """Coefficients a of x_i = Σ a_k x_{i−k} + white noise; Yule–Walker, the order by BIC up to eight."""
    from scipy.linalg import solve_toeplitz

    n = x.size
    rho = np.concatenate([[1.0], autocorrelation(x, min(_LARGEST_ORDER, n // 4))])
    best, best_bic = np.empty(0), 0.0
    for order in range(1, rho.size):
        a = solve_toeplitz(rho[:order], rho[1 : order + 1])
        left = 1 - float(a @ rho[1 : order + 1])
        if not left > 0:
            break
        bic = n * math.log(left) + order * math.log(n)
        if bic < best_bic:
            best, best_bic = a, bic
    return best


def _with_what_the_fit_took(r: np.ndarray, a: np.ndarray, jacobian: np.ndarray) -> tuple[np.ndarray, float]:
    """The autoregression of the noise from that of residuals, and the share of its variance that the fit took.

    Residuals are M e with M = 1 − Q Qᵀ (Q spans what the parameters can do), so their autocovariance at lag k falls short of
    the noise's by tr D_k (Σ − M Σ M)/n, with D_k the shift by k; that shortfall is computed from the autoregression itself,
    three times over.
    """
    from scipy.linalg import solve_toeplitz

    n, order = r.size, a.size
    size = np.linalg.norm(jacobian, axis=0)
    basis, _ = np.linalg.qr(jacobian[:, size > 0] / size[size > 0])
    seen = np.concatenate([[1.0], autocorrelation(r, order)])
    first, short = a, np.zeros(order + 1)
    for _ in range(3):
        carried = _correlated(basis, first)
        both = basis.T @ carried
        for lag in range(order + 1):
            left, right = basis[lag:], basis[: n - lag]
            single = np.sum(left * carried[: n - lag]) + np.sum(carried[lag:] * right)
            short[lag] = (single - np.sum(both * (left.T @ right))) / n
        if not short[0] < _MOST_TAKEN:
            return a, min(max(float(short[0]), 0.0), _MOST_TAKEN)
        rho = seen * (1 - short[0]) + short
        better = solve_toeplitz(rho[:order] / rho[0], rho[1:] / rho[0])
        if np.max(np.abs(np.roots(np.concatenate([[1.0], -better])))) >= 0.9999:  # would not die away
            break
        first = better
    return first, max(float(short[0]), 0.0)


def _correlated(columns: np.ndarray, a: np.ndarray) -> np.ndarray:
    """(n, k) R columns, R the correlation matrix that the autoregression implies: diagonal in frequency once the columns are
    padded to beyond its reach."""
    from scipy.fft import irfft, next_fast_len, rfft

    size = 2 * next_fast_len(max(columns.shape[0], _GRID // 2))
    power = _power(a, size)
    weight = power[: size // 2 + 1] / np.mean(power)
    return np.asarray(irfft(rfft(columns, size, axis=0) * weight[:, None], size, axis=0)[: columns.shape[0]])


def spectrum(coefficients: tuple[float, ...] | np.ndarray, phase: float) -> float:
    """Power of the autoregression at `phase` = ω Δt, relative to white noise of the same variance."""
    if len(coefficients) == 0:
        return 1.0
    a = np.asarray(coefficients)
    at_phase = abs(1 - np.sum(a * np.exp(-1j * np.arange(1, a.size + 1) * phase))) ** 2
    return float(1 / (at_phase * np.mean(_power(a, _GRID))))


def _power(a: np.ndarray, size: int) -> np.ndarray:
    """Power spectrum of x_i = Σ a_k x_{i−k} + unit white noise at the `size` frequencies of a Fourier transform."""
    return np.asarray(1 / np.abs(np.fft.fft(np.concatenate([[1.0], -a]), size)) ** 2)


def spread(jacobian: np.ndarray, noise: Noise) -> np.ndarray:
    """Jᵀ R J (k, k) for residuals with that noise: J is (n, k), already divided by σ."""
    if len(noise.coefficients) == 0:
        return np.asarray(noise.scale_used**2 * (jacobian.T @ jacobian))
    return np.asarray(noise.scale_used**2 * (jacobian.T @ _correlated(jacobian, np.asarray(noise.coefficients))))
