"""Cycle by cycle: periods and turning points with error bars, and the laws that they should follow; residual spectrum."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from toolkit.fitting.guess import crossing_times, frequency_ratio, point_noise
from toolkit.fitting.noise import autocorrelation

if TYPE_CHECKING:
    from toolkit.fit import FitResult
    from toolkit.series import ThetaSeries


@dataclass(frozen=True)
class Cycles:
    """What each swing did. Angles are from the fitted vertical, SI units, 1-D arrays.

    t_s, period_s, sigma_period_s, amplitude_rad, sigma_amplitude_rad : one entry a full cycle (crossing to the next
        crossing the same way; amplitude from the two turning points inside).
    turning_t_s, turning_theta_rad, sigma_turning_rad : one entry a turning point, signed.
    """

    t_s: np.ndarray
    period_s: np.ndarray
    sigma_period_s: np.ndarray
    amplitude_rad: np.ndarray
    sigma_amplitude_rad: np.ndarray
    turning_t_s: np.ndarray
    turning_theta_rad: np.ndarray
    sigma_turning_rad: np.ndarray


def cycles(series: ThetaSeries, result: FitResult | None = None) -> Cycles:
    """Periods and turning points measured on the record itself, without the model: local cubics at the crossings, local
    parabolas at the turning points. `result` gives the vertical and, where the series has none, σ.

    A cycle with fewer than 4 points at a crossing or at a turning point, or with a gap, is left out.
    """
    vertical = 0.0
    if result is not None and "theta_offset" in result.parameters:
        vertical = result.parameters["theta_offset"].value
    else:
        low, high = np.percentile(series.theta_rad, [2, 98])
        vertical = 0.5 * (low + high)
    x = series.theta_rad - vertical
    sigma = series.sigma_theta_rad
    if sigma is None:
        scatter = point_noise(series.theta_rad) if result is None else float(result.noise["sigma_rad"])
        sigma = np.full(len(series), max(scatter, 1e-12))
    rough = crossing_times(series.t_s, x, point_noise(x))
    if rough.size < 2:
        return Cycles(*(np.empty(0) for _ in range(8)))
    half = float(np.median(np.diff(rough)))
    crossing, sigma_crossing = np.array([_crossing(series.t_s, x, sigma, t, half) for t in rough]).T
    turns = np.array([_turning(series.t_s, x, sigma, a, b, half) for a, b in itertools.pairwise(rough)])
    turning = turns[np.all(np.isfinite(turns), axis=1)]
    period = crossing[2:] - crossing[:-2]
    sigma_period = np.hypot(sigma_crossing[2:], sigma_crossing[:-2])
    middle = 0.5 * (crossing[2:] + crossing[:-2])
    peak = 0.5 * (np.abs(turns[1:, 1]) + np.abs(turns[:-1, 1]))
    sigma_peak = 0.5 * np.hypot(turns[1:, 2], turns[:-1, 2])
    gaps = np.diff(rough)
    whole = np.maximum(gaps[1:], gaps[:-1]) < 1.6 * np.minimum(gaps[1:], gaps[:-1])
    keep = np.isfinite(period + sigma_period + peak + sigma_peak) & whole
    return Cycles(
        middle[keep],
        period[keep],
        sigma_period[keep],
        peak[keep],
        sigma_peak[keep],
        turning[:, 0],
        turning[:, 1],
        turning[:, 2],
    )


def period_of(amplitude_rad: np.ndarray, t0_s: float) -> np.ndarray:
    """T(A) = T₀ (2/π) K(sin A/2) in s, exact for a free swing."""
    return np.asarray(t0_s / frequency_ratio(np.asarray(amplitude_rad)))


def amplitude_of(result: FitResult) -> np.ndarray:
    """(n,) amplitude in rad that the fitted motion's energy reaches at each point: the model's smooth envelope."""
    table = {**result.derived, **result.parameters}
    omega_g = table["omega_g"].value if "omega_g" in table else 2 * math.pi / table["T0"].value
    offset = result.parameters["theta_offset"].value if "theta_offset" in result.parameters else 0.0
    scale = 1 + (result.parameters["angle_scale"].value if "angle_scale" in result.parameters else 0.0)
    theta = (result.theta_rad - offset) / scale
    swing = result.omega_rad_per_s / (2 * omega_g)
    if result.model.startswith("small_angle"):
        return np.asarray(np.hypot(theta, 2 * swing))
    return np.asarray(2 * np.arcsin(np.sqrt(np.clip(np.sin(theta / 2) ** 2 + swing**2, 0, 1))))


def residual_autocorrelation(result: FitResult, lags: int = 100) -> tuple[np.ndarray, float]:
    """Autocorrelation (lags,) of the residuals at 1 … `lags` steps, and the bound |ρ| < 1.96/√n that white ones keep."""
    residual = result.residuals_rad
    n = residual.size
    return autocorrelation(residual, min(lags, n - 1)), 1.96 / math.sqrt(n)


def residual_spectrum(series: ThetaSeries, result: FitResult) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies in Hz (k,) and one-sided power density of the residuals in rad²/Hz (k,), Welch's average over four
    stretches; uneven times are first put on an even grid by linear interpolation."""
    step = float(np.median(np.diff(series.t_s)))
    count = max(8, min(len(series), int(series.duration_s / step) + 1))
    even = np.interp(np.linspace(series.t_s[0], series.t_s[-1], count), series.t_s, result.residuals_rad)
    size = max(8, count // 4)
    window = np.hanning(size + 1)[:-1]
    pieces = np.lib.stride_tricks.sliding_window_view(even, size)[:: max(size // 2, 1)]
    rate = (count - 1) / max(series.duration_s, 1e-12)
    power = np.mean(np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2, axis=0) / (rate * np.sum(window**2))
    power[1 : -1 if size % 2 == 0 else None] *= 2
    return np.fft.rfftfreq(size, 1 / rate), power


def _crossing(t_s: np.ndarray, x: np.ndarray, sigma: np.ndarray, rough: float, half: float) -> tuple[float, float]:
    """Time of a crossing and its σ, from a cubic through the points within a fifth of a period."""
    low, high = np.searchsorted(t_s, [rough - 0.4 * half, rough + 0.4 * half])
    t = t_s[low:high] - rough
    if t.size < 4 or not (t[0] < -0.02 * half and t[-1] > 0.02 * half):
        return math.nan, math.nan
    degree = 3 if t.size >= 6 else 1
    columns = np.stack([(t / half) ** k for k in range(degree + 1)], axis=1) / sigma[low:high, None]
    gram = np.linalg.pinv(columns.T @ columns)
    a = gram @ (columns.T @ (x[low:high] / sigma[low:high]))
    root = 0.0
    for _ in range(20):
        value = sum(a[k] * root**k for k in range(degree + 1))
        slope = sum(k * a[k] * root ** (k - 1) for k in range(1, degree + 1))
        if slope == 0:
            return math.nan, math.nan
        root -= value / slope
        if not abs(root) < 0.4:
            return math.nan, math.nan
    powers = np.array([root**k for k in range(degree + 1)])
    return rough + root * half, half * math.sqrt(float(powers @ gram @ powers)) / abs(slope)


def _turning(
    t_s: np.ndarray, x: np.ndarray, sigma: np.ndarray, start: float, stop: float, half: float
) -> tuple[float, float, float]:
    """Time, angle and σ of the turning point between two crossings, from a parabola through the middle third (a quartic
    where there are points enough)."""
    if stop - start > 1.6 * half:
        return math.nan, math.nan, math.nan
    centre, reach = 0.5 * (start + stop), 0.28 * (stop - start)
    low, high = np.searchsorted(t_s, [centre - reach, centre + reach])
    t = (t_s[low:high] - centre) / half
    if t.size < 4:
        return math.nan, math.nan, math.nan
    degree = 4 if t.size >= 8 else 2
    columns = np.stack([t**k for k in range(degree + 1)], axis=1) / sigma[low:high, None]
    gram = np.linalg.pinv(columns.T @ columns)
    a = gram @ (columns.T @ (x[low:high] / sigma[low:high]))
    fine = np.linspace(-0.25, 0.25, 201)
    curve = np.polynomial.polynomial.polyval(fine, a)
    best = int(np.argmax(np.abs(curve)))
    powers = fine[best] ** np.arange(degree + 1)
    return centre + fine[best] * half, float(curve[best]), math.sqrt(float(powers @ gram @ powers))
