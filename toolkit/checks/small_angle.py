"""Is sin θ ≈ θ good enough? The same drag is fitted with and without the small-angle approximation."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import FAILS_BELOW_P, Evidence, omega_g_of, sigmas
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding
from toolkit.fit import FitResult, fit
from toolkit.fitting.cycles import cycles
from toolkit.scene import Scene
from toolkit.series import ThetaSeries

_HARMLESS_SHIFT = 1e-3
_CLEAR = 25.0
_CONTRADICTED = 16.0
_POINTS = 1200


def check(evidence: Evidence) -> Finding:
    """`fails` where the full sine fits better beyond chance; `holds` where it does not, could not, and the period shift
    that a free ω_g would hide is below 0.1 % or below its error bar."""
    small = evidence.fit("small_angle_linear_drag")
    full = evidence.fit("full_linear_drag")
    if not full.success:
        return Finding(
            "small_angle",
            NOT_DISTINGUISHABLE,
            sentence="The fit with the full sine did not converge, so nothing is said about small angles.",
            remedy=full.message,
            words_key="small_angle.no_fit",
        )
    drag = "linear drag"
    if small.success and evidence.chi2(full) - evidence.chi2(evidence.best) > 9:  # linear drag itself is not enough
        better = evidence.fit("full_linear_quadratic_drag")
        if better.success:
            small, full, drag = evidence.fit("small_angle_linear_quadratic_drag"), better, "the same drag"
    gain = evidence.chi2(small) - evidence.chi2(full) if small.success else math.inf
    p_value = _p_value(gain)
    amplitude = evidence.amplitude()
    largest = float(np.max(amplitude))
    omega, u_omega = omega_g_of(full), _u_omega(full)
    shift = 2 / math.pi * _elliptic(largest) - 1
    gap = float(np.max(np.abs(small.theta_rad - full.theta_rad))) if small.success else math.inf
    threshold, expected = _threshold(evidence, full, largest)
    numbers = {
        "delta_chi2": gain,
        "delta_aic": gain,
        "p_value": p_value,
        "expected_delta_chi2": expected,
        "period_shift_relative": shift,
        "largest_difference_rad": gap,
        "amplitude_max_rad": largest,
        "amplitude_visible_rad": threshold,
        "inflation": math.sqrt(evidence.inflation2),
    }
    if small.success:
        numbers["omega_g_bias_sigma"] = (omega_g_of(small) - omega) / u_omega if u_omega else 0.0
    over = (
        gain * evidence.inflation2 / float(small.noise["inflation"]) ** 2 if small.success else 0.0
    )  # by its own noise
    growth, u_growth = _period_growth(evidence, full) if over < -_CONTRADICTED else (None, math.inf)
    if growth is not None:
        numbers |= {"period_growth_per_rad2": growth, "period_growth_u": u_growth}
        return Finding(
            "small_angle",
            NOT_DISTINGUISHABLE,
            evidence=numbers,
            sentence=(
                f"The small-angle model fits better than the exact equation (Δχ² = {over:.0f}), which no pendulum of one length can "
                f"do: measured cycle by cycle the period grows by {growth:.3f} ± {u_growth:.3f} a rad² of amplitude, not by 1/16. The "
                "clock or the length changes along the record, or the angles are out of scale."
            ),
            remedy="look at the checks of clock and geometry, and at a string that slips or rubs at its support",
            strength_sigma=math.sqrt(-over),
            words_key="small_angle.contradicted",
            words_values={"delta_chi2": over, "growth": growth, "growth_u": u_growth, "amplitude_max_rad": largest},
        )
    strength = sigmas(p_value)
    if p_value < FAILS_BELOW_P:
        above = min(threshold, largest)
        inside = amplitude >= above
        t = evidence.series.t_s
        where = {"amplitude_above_rad": above}
        if inside.any():
            where |= {"t_start_s": float(t[inside][0]), "t_stop_s": float(t[inside][-1])}
        values = {
            **where,
            "amplitude_max_rad": largest,
            "period_shift": shift,
            "difference_rad": gap,
            "sigmas": strength,
        }
        return Finding(
            "small_angle",
            FAILS,
            where=where,
            evidence=numbers,
            sentence=(
                f"The small-angle assumption fails ({strength:.0f} sigma): with {drag} the full sine follows the record, θ in its "
                f"place does not. A record like this shows it above {above:.3g} rad ({math.degrees(above):.2g}°); at the largest "
                f"swing, {largest:.3g} rad, the period is {100 * shift:.2g} % longer than at small angles."
            ),
            remedy=f"use a full-sine model, or keep the swing below {above:.2g} rad",
            strength_sigma=strength,
            words_key="small_angle.fails",
            words_values=values,
        )
    hidden = abs(numbers.get("omega_g_bias_sigma", 0.0))
    values = {
        "amplitude_max_rad": largest,
        "period_shift": shift,
        "amplitude_visible_rad": threshold,
        "difference_rad": gap,
    }
    if gain < 4 and expected < 9 and (shift < _HARMLESS_SHIFT or (hidden < 2 and largest < 0.4)):
        return Finding(
            "small_angle",
            HOLDS,
            evidence=numbers,
            sentence=(
                f"Small angles are good enough here: up to {largest:.3g} rad ({math.degrees(largest):.2g}°) the two models differ by at "
                f"most {1000 * gap:.2g} mrad, less than this record can show, and the period by {100 * shift:.2g} %. "
                f"It would show above {threshold:.2g} rad."
            ),
            words_key="small_angle.holds",
            words_values=values,
        )
    return Finding(
        "small_angle",
        NOT_DISTINGUISHABLE,
        evidence=numbers,
        sentence=(
            f"θ(t) alone cannot tell (Δχ² = {gain:.1f}): the small-angle model fits as well because its ω_g absorbs the longer "
            f"period, so its ω_g is off by {100 * shift:.2g} % ({hidden:.0f} error bars)."
        ),
        remedy="use the full-sine model for ω_g, length or g; give the length to test the assumption, or start from a larger angle",
        strength_sigma=strength,
        words_key="small_angle.not_distinguishable",
        words_values={**values, "delta_chi2": gain, "omega_g_bias_sigma": hidden},
    )


def _period_growth(evidence: Evidence, full: FitResult) -> tuple[float | None, float]:
    """C of T = T₀ (1 + C A²) through the measured periods, and its u by their scatter; None with fewer than ten."""
    found = cycles(evidence.series, full)
    if found.t_s.size < 10:
        return None, math.inf
    columns = (
        np.stack([np.ones_like(found.amplitude_rad), found.amplitude_rad**2], axis=1) / found.sigma_period_s[:, None]
    )
    inverse = np.linalg.pinv(columns.T @ columns)
    start, slope = inverse @ (columns.T @ (found.period_s / found.sigma_period_s))
    left = found.period_s / found.sigma_period_s - columns @ [start, slope]
    scatter2 = float(left @ left) / (found.t_s.size - 2)
    return float(slope / start), math.sqrt(float(inverse[1, 1]) * scatter2) / float(start)


def _p_value(gain: float) -> float:
    from scipy.stats import chi2

    return 0.0 if not math.isfinite(gain) else float(0.5 * chi2.sf(max(gain, 0.0), 1))


def _elliptic(amplitude: float) -> float:
    from scipy.special import ellipk

    return float(ellipk(math.sin(amplitude / 2) ** 2))


def _u_omega(result: FitResult) -> float | None:
    p = result.parameters.get("omega_g") or result.derived.get("omega_g")
    return None if p is None else p.stderr


def _threshold(evidence: Evidence, full: FitResult, largest: float) -> tuple[float, float]:
    """Amplitude at which a record of this length and noise shows the failure (expected Δχ² of 25), and the expected
    Δχ² at the record's own amplitude; both with linear drag of the same strength."""
    n = len(evidence.series)
    keep = np.unique(np.linspace(0, n - 1, min(n, _POINTS)).astype(int))
    t = evidence.series.t_s[keep]
    t = t - t[0]  # rows that are read before the frame's middle begin before 0
    sigma = evidence.sigma_rad[keep] * math.sqrt(evidence.inflation2 * keep.size / n)
    omega = omega_g_of(full)
    rate = full.derived["Q"].value if "Q" in full.derived else math.inf
    alpha = omega / (2 * rate) if rate > 0 else 0.0
    start = {"alpha_d": alpha, "phi": full.parameters["phi"].value, "omega_g": omega}
    length = full.parameters.get("length")
    held = {"omega_g": omega} if length is not None and length.fixed else {}

    def expected(peak: float) -> float:
        from toolkit.models import load_model

        motion = load_model("full_linear_drag").motion({**start, "theta0": peak}, t)
        record = ThetaSeries(t, motion.theta, sigma)
        result = fit(record, Scene(), "small_angle_linear_drag", fixed=held, start={**start, "theta0": peak})
        return result.chi2 if math.isfinite(result.chi2) else math.inf

    here = expected(min(largest, 3.1))
    low, high = math.log(1e-3), math.log(3.0)
    if 0 < here < math.inf:  # Δχ² grows about as A⁶: a good first bracket
        near = math.log(min(largest, 3.0)) + math.log(_CLEAR / here) / 6
        low, high = max(low, near - 0.7), min(high, near + 0.7)
        low = min(low, high - 0.1)
    for _ in range(7):
        middle = 0.5 * (low + high)
        if expected(math.exp(middle)) < _CLEAR:
            low = middle
        else:
            high = middle
    return math.exp(0.5 * (low + high)), here
