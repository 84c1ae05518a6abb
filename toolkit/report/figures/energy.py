"""Energy against time, and what each swing loses, split by the terms of drag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.figures.decay import plain_log
from toolkit.report.material import Material, value
from toolkit.report.style import BEST_MODEL, DATA, INK, PAPER_MODEL, THIRD, dots, draw, legend_above, panels

_PARTS = (
    ("alpha_d", "loss_linear", BEST_MODEL),
    ("beta", "loss_quadratic", PAPER_MODEL),
    ("mu", "loss_friction", THIRD),
)
_GROUPS = 12


def energy(material: Material) -> Figure | None:
    """E(t) with the model's band and each swing's own energy; beside it the loss in one swing against amplitude."""
    if not material.usable or material.cycles is None:
        return None
    words, cycles, best = material.words, material.cycles, material.best
    unit, label = _unit(material)
    t = np.linspace(material.t[0], material.t[-1], 400)
    curve = material.curve(best, t)
    scale = 1 + (value(best, "angle_scale") or 0.0)  # as the camera sees it
    amplitude = cycles.amplitude_rad / scale
    measured = 1 - np.cos(amplitude)
    reduced = material.reduced
    parts = (
        lost_in_a_swing(np.linspace(0.98 * amplitude.min(), 1.02 * amplitude.max(), 60), reduced) if reduced else None
    )
    grouped = _loss_by_group(cycles.t_s, amplitude, cycles.period_s)

    def paint(figure: Any) -> None:
        split = parts is not None and len(parts) > 1
        axes = panels(figure, 1, 2 if split else 1, gap=0.6, left=0.58, top=0.4, squeeze=False)[0]
        left = axes[0]
        dots(left, cycles.t_s, unit * measured, DATA, 2.4 if measured.size > 60 else 4.0, 1.0, words("figure.measured"))
        left.plot(t, unit * curve.energy, color=BEST_MODEL, label=words("figure.model"))
        if curve.energy_u is not None:
            low, high = (unit * (curve.energy + k * curve.energy_u) for k in (-2, 2))
            left.fill_between(t, low, high, color=BEST_MODEL, alpha=0.25, linewidth=0)
        if measured.max() > 1.6 * measured.min():
            left.set_yscale("log")
            plain_log(left)
        left.set_xlabel(words("figure.time_s"))
        left.set_ylabel(words(label))
        legend_above(left, 1 if split else 2)
        if split and parts is not None:
            _paint_loss(axes[1], words, parts, grouped)

    data = {"t_s": t, "energy_model": unit * curve.energy}
    if curve.energy_u is not None:
        data["u_energy_model"] = unit * curve.energy_u
    data |= {"swing_t_s": cycles.t_s, "swing_amplitude_rad": amplitude, "swing_energy": unit * measured}
    if parts is not None:
        data |= {f"loss_{name}" if name != "amplitude_rad" else "loss_amplitude_rad": y for name, y in parts.items()}
    data |= dict(zip(("group_amplitude_rad", "group_loss", "u_group_loss"), grouped))
    key = "caption.energy" if parts is not None and len(parts) > 1 else "caption.energy_only"
    return Figure("energy", words(key), draw("energy", words.lang, 2.4, paint, 4.5), data)


def _unit(material: Material) -> tuple[float, str]:
    """m g ℓ in J where mass and length are known, else 1: the energy is then told in units of m g ℓ."""
    mass = material.analysis.scene.pendulum.mass_kg
    length = value(material.best, "length") or value(material.best, "equivalent_length")
    if mass is None or length is None:
        return 1.0, "figure.energy_mgl"
    return 1e3 * mass * material.analysis.scene.environment.gravity_m_per_s2 * length, "figure.energy_mj"


def lost_in_a_swing(amplitude_rad: np.ndarray, reduced: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Share of the energy that one swing of each amplitude loses, by term: {"amplitude_rad": …, "alpha_d": …, …}.

    ∮ (2α θ̇ + β θ̇² + μ) dθ over a swing of the undamped pendulum, exact in amplitude, with m = sin²(A/2):
    32 α ω (E(m) − (1 − m) K(m)), 8 β ω² (sin A − A cos A) and 4 μ A, over ω² (1 − cos A).
    """
    from scipy.special import ellipe, ellipk

    a, omega = amplitude_rad, reduced["omega_g"]
    m = np.sin(a / 2) ** 2
    stored = omega**2 * (1 - np.cos(a))
    lost = {
        "alpha_d": 32 * omega * (ellipe(m) - (1 - m) * ellipk(m)),
        "beta": 8 * omega**2 * (np.sin(a) - a * np.cos(a)),
        "mu": 4 * a,
    }
    return {"amplitude_rad": a} | {n: reduced[n] * by / stored for n, by in lost.items() if reduced.get(n, 0.0) > 0}


def _loss_by_group(t_s: np.ndarray, a: np.ndarray, period_s: np.ndarray) -> tuple[np.ndarray, ...]:
    """Amplitude, share of the energy lost in one swing, and its σ, for groups of neighbouring swings: the slope of ln E."""
    found = []
    for group in np.array_split(np.arange(t_s.size), min(_GROUPS, t_s.size // 4)) if t_s.size >= 8 else []:
        t = t_s[group] - t_s[group].mean()
        log_energy = np.log(1 - np.cos(a[group]))
        slope, middle = np.polyfit(t, log_energy, 1)
        rest = log_energy - middle - slope * t
        u = np.sqrt(np.sum(rest**2) / (t.size - 2) / np.sum(t**2))
        found.append((float(a[group].mean()), -slope * period_s[group].mean(), u * period_s[group].mean()))
    return tuple(np.array(found).T) if found else (np.empty(0),) * 3


def _paint_loss(axis: Any, words: Any, parts: Mapping[str, np.ndarray], grouped: tuple[np.ndarray, ...]) -> None:
    degrees = np.degrees(parts["amplitude_rad"])
    below = np.zeros_like(degrees)
    for name, word, colour in _PARTS:
        if name in parts:
            above = below + 100 * parts[name]
            axis.fill_between(
                degrees, below, above, color=colour, alpha=0.35, linewidth=0, label=words(f"figure.{word}")
            )
            below = above
    axis.plot(degrees, below, color=INK, linewidth=0.8)
    at, loss, u = grouped
    axis.errorbar(
        np.degrees(at),
        100 * loss,
        100 * u,
        fmt="o",
        color=INK,
        markersize=3.2,
        elinewidth=0.8,
    )
    axis.set_ylim(0, 1.1 * max(float(below.max()), float((100 * (loss + u)).max()) if loss.size else 0.0))
    axis.set_xlabel(words("figure.amplitude_deg"))
    axis.set_ylabel(words("figure.loss_percent"))
    legend_above(axis, 2)
