"""Are the residuals of the best model white? If not, either the model lacks something or the noise is correlated."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import Evidence, omega_g_of
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding
from toolkit.fitting.cycles import residual_spectrum

_FEWEST = 40


def check(evidence: Evidence) -> Finding | None:
    """`fails` where Ljung and Box's test finds autocorrelation (p < 0.001) that a plot would show (|ρ| > 0.1 or a line)."""
    best = evidence.best
    if not best.success:
        return None
    noise = best.noise
    rho, p_value, inflation = float(noise["rho1"]), float(noise["ljung_box_p"]), float(noise["inflation"])
    if len(evidence.series) < _FEWEST:
        return Finding(
            "white_residuals",
            NOT_DISTINGUISHABLE,
            sentence=f"{len(evidence.series)} points are too few to say whether the residuals are random.",
            words_key="white_residuals.too_few",
            words_values={"points": len(evidence.series)},
        )
    frequency, power = residual_spectrum(evidence.series, best)
    swing = omega_g_of(best) / (2 * math.pi)
    peak = float(frequency[1:][np.argmax(power[1:])]) if frequency.size > 2 else 0.0
    numbers = {
        "rho1": rho,
        "durbin_watson": float(noise["durbin_watson"]),
        "runs_z": float(noise["runs_z"]),
        "p_value": p_value,
        "inflation": inflation,
        "strongest_frequency_hz": peak,
        "strongest_over_swing": peak / swing,
    }
    if bool(noise["white"]):
        return Finding(
            "white_residuals",
            HOLDS,
            evidence=numbers,
            sentence="What the best model leaves over is random: no pattern in time is seen.",
            words_key="white_residuals.holds",
            words_values={"rho1": rho},
        )
    harmonic = peak / swing
    if abs(harmonic - 1) < 0.2:
        hint = "at the swing's own frequency: the amplitude or phase does not follow the model"
    elif abs(harmonic - 3) < 0.3:
        hint = "at three times the swing's frequency: the angle scale or the calibration is off"
    elif harmonic < 0.5:
        hint = "slower than the swing: the camera or the support moved"
    else:
        hint = f"at {peak:.3g} Hz"
    return Finding(
        "white_residuals",
        FAILS,
        where={"frequency_hz": peak},
        evidence=numbers,
        sentence=(
            f"Neighbouring residuals of the best model are alike (correlation {rho:.2f}), strongest {hint}. The error bars allow "
            f"for it: they are {inflation:.2g} times those of random noise."
        ),
        remedy="look at the residual plots; a pattern in time or phase means that something is missing in the model or the video",
        words_key="white_residuals.fails",
        words_values={"rho1": rho, "inflation": inflation, "frequency_hz": peak, "strongest_over_swing": harmonic},
    )
