"""Residual spectrum and autocorrelation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.figures.decay import plain_log
from toolkit.report.material import Material
from toolkit.report.style import BEST_MODEL, DATA, INK, PAPER_MODEL, draw, legend_above, panels

_LINES = 600


def spectrum(material: Material) -> Figure | None:
    """Amplitude spectrum of the residuals with the pendulum's frequency and its third harmonic; autocorrelation."""
    if not material.usable or material.t.size < 32:
        return None
    words, t = material.words, material.t
    step = float(np.median(np.diff(t)))
    grid = np.arange(t[0], t[-1] + step / 2, step)
    rows = [(material.best, BEST_MODEL, words("figure.preferred_model"))]
    if (
        material.paper is not None
        and material.paper is not material.best
        and len(material.paper.residuals_rad) == t.size
    ):
        rows.insert(0, (material.paper, PAPER_MODEL, words("figure.paper_model")))
    frequency = np.fft.rfftfreq(grid.size, step)
    swing = material.omega_g / (2 * math.pi)
    spectra, correlations = [], []
    for result, _, _ in rows:
        rest = np.interp(grid, t, result.residuals_rad)
        rest = rest - rest.mean()
        window = np.hanning(grid.size)
        spectra.append(np.abs(np.fft.rfft(rest * window)) * 2 / window.sum())
        power = np.abs(np.fft.rfft(rest, 2 * grid.size)) ** 2
        covariance = np.fft.irfft(power)[: grid.size // 2]
        correlations.append(covariance / covariance[0] if covariance[0] > 0 else covariance)
    last = min(correlations[0].size, max(40, int(3 / swing / step) if math.isfinite(swing) else 40))
    shown = (frequency > 0) & (frequency <= min(0.5 / step, 8 * swing if math.isfinite(swing) else np.inf))

    def paint(figure: Any) -> None:
        left, right = panels(figure, 1, 2, gap=0.62, top=0.24)
        for (_, colour, name), amplitude, correlation in zip(rows, spectra, correlations):
            f, a = _peaks(frequency[shown], 1e3 * amplitude[shown])
            left.semilogy(f, np.maximum(a, 1e-6), color=colour, linewidth=0.7)
            right.plot(step * np.arange(last), correlation[:last], color=colour, linewidth=0.9, label=name)
        for harmonic in (1, 3):
            if math.isfinite(swing) and harmonic * swing < frequency[shown][-1]:
                left.axvline(harmonic * swing, color=DATA, linewidth=0.6, linestyle=":")
                left.annotate(
                    f"{harmonic}f" if harmonic > 1 else "f",
                    (harmonic * swing, 1),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, 2),
                    textcoords="offset points",
                    ha="center",
                    color=INK,
                    fontsize=7.5,
                )
        left.set_xlabel(words("figure.frequency_hz"))
        left.set_ylabel(words("figure.residual_amplitude_mrad"))
        low = float(np.percentile(1e3 * spectra[-1][shown], 5))
        left.set_ylim(bottom=max(low / 3, 1e-6))
        plain_log(left, (1,))
        legend_above(right, 2)
        bound = 1.96 / math.sqrt(t.size)
        right.axhspan(-bound, bound, color=DATA, alpha=0.2, linewidth=0)
        right.set_xlabel(words("figure.lag_s"))
        right.set_ylabel(words("figure.autocorrelation"))

    data = {"frequency_hz": frequency}
    data |= {f"amplitude_{result.model}_rad": a for (result, _, _), a in zip(rows, spectra)}
    return Figure("spectrum", words("caption.spectrum"), draw("spectrum", words.lang, 2.2, paint), data)


def _peaks(f: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most 600 lines: the largest of each group, so that no peak is lost."""
    if f.size <= _LINES:
        return f, a
    group = math.ceil(f.size / _LINES)
    n = f.size // group * group
    blocks = a[:n].reshape(-1, group)
    best = blocks.argmax(axis=1)
    rows = np.arange(blocks.shape[0])
    return f[:n].reshape(-1, group)[rows, best], blocks[rows, best]
