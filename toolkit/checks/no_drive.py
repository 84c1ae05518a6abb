"""Does something drive the pendulum? A drive leaves a line in the residuals' spectrum away from the swing's harmonics."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import Evidence, omega_g_of
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding

_FREQUENCIES = 400
_CLEAR = 30.0
_SMALLEST_SHARE = 0.25


def check(evidence: Evidence) -> Finding | None:
    """`fails` where one steady sine in the residuals is beyond chance; None in a scene that names its drive (or where no
    full-sine fit converged)."""
    best = evidence.best
    if "cosine_drive" in evidence.scene.effects or not best.success or len(evidence.series) < 40:
        return None
    t = evidence.series.t_s - evidence.series.t_s[0]
    span = float(t[-1])
    swing = omega_g_of(best) / (2 * math.pi)
    if span * swing < 2:
        return None
    highest = min(5 * swing, 0.45 / float(np.median(np.diff(t))))
    frequency = np.linspace(2 / span, highest, max(_FREQUENCIES, min(int(4 * span * highest), 4000)))
    power = _power(t, best.residuals_rad / evidence.sigma_rad, frequency)
    apart = np.ones(frequency.size, dtype=bool)
    for harmonic in (1, 2, 3, 4, 5):
        apart &= np.abs(frequency - harmonic * swing) > max(4 / span, 0.12 * swing)
    if not apart.any():
        return None
    strongest = float(frequency[apart][np.argmax(power[apart])])
    phase = 2 * math.pi * strongest * t
    found = evidence.added(np.stack([np.cos(phase), np.sin(phase)], axis=1))
    level = found.noise.scale_used**2 if found.noise.scale_used else 1.0
    local = float(np.median(power[apart])) / math.log(2)  # a periodogram of noise is exponential
    height = float(np.max(power[apart])) / max(local, 1e-300)
    amplitude = float(np.hypot(*found.coefficients))
    chance = min(frequency.size * math.exp(-min(height, 700.0)), 1.0)
    numbers = {
        "frequency_hz": strongest,
        "amplitude_rad": amplitude,
        "delta_chi2": found.delta_chi2,
        "line_over_background": height,
        "p_value": chance,
        "noise_scale2": level,
    }
    values = {"frequency_hz": strongest, "amplitude_rad": amplitude, "over_swing": strongest / swing}
    taken = 1 - float(np.mean(_without(evidence, phase) ** 2)) / float(np.mean((best.residuals_rad) ** 2))
    if height > _CLEAR and (taken > _SMALLEST_SHARE or bool(best.noise["white"]) or found.delta_chi2 > _CLEAR):
        if strongest < 0.5 * swing:
            return Finding(
                "no_drive",
                FAILS,
                where={"frequency_hz": strongest},
                evidence=numbers,
                sentence=(
                    f"The zero of the angle moves slowly, {1000 * amplitude:.2g} mrad at {strongest:.3g} Hz: the camera or the support "
                    "moved, or something pushes the bob at that frequency."
                ),
                remedy="fix the camera and the support; shield the pendulum from draught",
                strength_sigma=math.sqrt(max(found.delta_chi2, 0.0)),
                words_key="no_drive.slow",
                words_values=values,
            )
        return Finding(
            "no_drive",
            FAILS,
            where={"frequency_hz": strongest},
            evidence=numbers,
            sentence=(
                f"Something drives the pendulum: besides the free swing at {swing:.3g} Hz the record holds a steady motion at "
                f"{strongest:.3g} Hz of {1000 * amplitude:.2g} mrad."
            ),
            remedy="find what moves at that frequency (a fan, the support, the camera), or name cosine_drive in the scene",
            strength_sigma=math.sqrt(max(found.delta_chi2, 0.0)),
            words_key="no_drive.fails",
            words_values=values,
        )
    if height > 0.5 * _CLEAR:
        return Finding(
            "no_drive",
            NOT_DISTINGUISHABLE,
            evidence=numbers,
            sentence=f"The residuals may hold a steady motion at {strongest:.3g} Hz; it is too weak to be sure.",
            remedy="record for longer",
            words_key="no_drive.not_distinguishable",
            words_values=values,
        )
    return Finding(
        "no_drive",
        HOLDS,
        evidence=numbers,
        sentence=f"Nothing drives the pendulum at another frequency: no steady line above {1000 * amplitude:.2g} mrad.",
        words_key="no_drive.holds",
        words_values=values,
    )


def _power(t: np.ndarray, x: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Periodogram at evenly spaced frequencies and any times, 1 for white noise of unit variance."""
    step = max(1, t.size // 4000) if frequency[-1] * 8 * float(t[-1]) < t.size else 1
    if step > 1:
        count = t.size // step
        t, x = (v[: count * step].reshape(count, step).mean(axis=1) for v in (t, x))
        x = x * math.sqrt(step)
    power = np.empty(frequency.size)
    turn = np.exp(-2j * math.pi * (frequency[1] - frequency[0]) * t)
    for i in range(frequency.size):
        if i % 64 == 0:  # from one frequency to the next it is one turn more; anew before rounding adds up
            wave = np.exp(-2j * math.pi * frequency[i] * t)
        power[i] = abs(wave @ x) ** 2 / t.size
        wave *= turn
    return power


def _without(evidence: Evidence, phase: np.ndarray) -> np.ndarray:
    columns = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    residual = evidence.best.residuals_rad
    return np.asarray(residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0])
