"""Equations (18) and (19) of the paper as they should read and as they are printed."""

from __future__ import annotations

import math

import numpy as np

from toolkit.paper.table1 import Case, solve_case


def driven_part(case: Case, t_s: np.ndarray, printed: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """θ_i of (18) and its rate of (19) at t_s; with `printed`, with the paper's misprints.

    Printed (18) lacks −α_d E over D₋ and Σ E over D₊, and its last fraction has D₋ and cos Δt for D₊ and cos Σt. Printed
    (19) has in its −α_d sin(ω_u t) bracket sin Σt for sin Δt, D₋ twice under the first fraction, and D₋ for D₊ under the
    second (our reading of a description of the page).
    """
    alpha, w, drive = case.alpha_d_per_s, case.omega_u_rad_per_s, 2 * math.pi * case.f_hz
    minus, plus = w - drive, w + drive
    below, above = alpha**2 + minus**2, alpha**2 + plus**2
    scale = case.f0_n / (2 * case.mass_kg * case.length_m * w)
    fade = np.exp(-alpha * t_s)
    sin, cos = np.sin(w * t_s), np.cos(w * t_s)
    c_minus, s_minus, c_plus, s_plus = np.cos(minus * t_s), np.sin(minus * t_s), np.cos(plus * t_s), np.sin(plus * t_s)

    first = (alpha * c_minus + minus * s_minus - alpha * fade) / below
    second = (alpha * c_plus + plus * s_plus - alpha * fade) / above
    third = (alpha * s_minus - minus * c_minus + minus * fade) / below
    fourth = (alpha * s_plus - plus * c_plus + plus * fade) / above
    theta = scale * (sin * (first + second) - cos * (third + fourth))
    rate = w * scale * (cos * (first + second) + sin * (third + fourth)) - alpha * theta
    if not printed:
        return theta, rate
    first_18 = (alpha * c_minus + minus * s_minus) / below
    fourth_18 = (alpha * s_plus - plus * c_minus) / below
    first_19 = (alpha * c_minus + minus * s_plus - alpha * fade) / below**2
    second_19 = (alpha * c_plus + plus * s_plus - alpha * fade) / below
    theta_printed = scale * (sin * (first_18 + second) - cos * (third + fourth_18))
    return theta_printed, rate - alpha * scale * sin * (first_19 + second_19 - first - second)


def misprint_errors() -> tuple[float, float, float]:
    """Largest errors over 0 … 20 s: of (18) as printed (rad), of (19) as printed (rad/s), and of small angles (rad)."""
    t, case = np.linspace(0, 20, 4001), Case()
    (theta, rate), (theta_printed, rate_printed) = driven_part(case, t), driven_part(case, t, printed=True)
    models = [solve_case(case, model, math.pi / 2, t).theta for model in ("small angle", "full equation")]
    differences = (theta_printed - theta, rate_printed - rate, models[0] - models[1])
    return tuple(float(np.max(np.abs(d))) for d in differences)  # type: ignore[return-value]
