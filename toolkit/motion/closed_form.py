"""The linear pendulum, solved exactly in every regime:  θ̈ + 2α θ̇ + ω_g² θ = a cos(ω_f t + ψ) + b.

With the functions S, S2, P, Q, R of `linear_functions`,

    θ = θ(0) (Ṡ + 2αS) + θ̇(0) S + a Re(e^{iψ} P) + b P(ω_f = 0)

and S2, Q, R are their derivatives by the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolkit.errors import UsageError
from toolkit.motion.blocks import blocks
from toolkit.motion.exact_arithmetic import root_of_difference_of_squares
from toolkit.motion.linear_functions import find_roots, solve_forced, solve_free

PARAMETERS = (
    "theta0_rad",
    "omega0_rad_per_s",
    "alpha_per_s",
    "omega_g_rad_per_s",
    "drive_rad_per_s2",
    "omega_f_rad_per_s",
    "phase_rad",
    "constant_rad_per_s2",
)
PAPER_PARAMETERS = (
    "theta0_rad",
    "phi_rad",
    "alpha_d_per_s",
    "omega_g_rad_per_s",
    "drive_rad_per_s2",
    "omega_f_rad_per_s",
    "phase_rad",
)


@dataclass(frozen=True)
class LinearSolution:
    """θ and θ̇, (n,) each, and their derivatives (n, k) by the k parameters named in `derivatives`."""

    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    d_theta: np.ndarray
    d_omega: np.ndarray
    derivatives: tuple[str, ...] = ()


def solve_linear(
    t_s: np.ndarray,
    theta0_rad: float,
    omega0_rad_per_s: float,
    alpha_per_s: float,
    omega_g_rad_per_s: float,
    drive_rad_per_s2: float = 0.0,
    omega_f_rad_per_s: float = 0.0,
    phase_rad: float = 0.0,
    constant_rad_per_s2: float = 0.0,
    derivatives: Sequence[str] = (),
) -> LinearSolution:
    """Solve θ̈ + 2α θ̇ + ω_g² θ = drive·cos(ω_f t + phase) + constant from θ(0), θ̇(0).

    t_s : (n,) times ≥ 0 in s. alpha_per_s: α = k_d/(2m), any sign; omega_g_rad_per_s ≥ 0. Under-, critically and
    overdamped motion, resonance with and without damping, and ω_f = 0 are all included.
    derivatives : names out of `PARAMETERS` (the argument names); d_theta and d_omega hold one column each.
    Raises UsageError for an unknown derivative, a negative time, ω_g < 0 or a number that is not finite.
    """
    values = (theta0_rad, omega0_rad_per_s, alpha_per_s, omega_g_rad_per_s, drive_rad_per_s2, omega_f_rad_per_s)
    t = _checked_times(t_s, (*values, phase_rad, constant_rad_per_s2), omega_g_rad_per_s)
    _check_names(derivatives, PARAMETERS)
    alpha, omega_g = float(alpha_per_s), float(omega_g_rad_per_s)
    square = omega_g * omega_g
    drive = (float(drive_rad_per_s2), float(omega_f_rad_per_s), float(phase_rad))
    if not derivatives and constant_rad_per_s2 == 0 and t.size:
        plain = _solve_underdamped(t, float(theta0_rad), float(omega0_rad_per_s), alpha, omega_g, *drive)
        if plain is not None:
            return LinearSolution(*plain, np.zeros((t.size, 0)), np.zeros((t.size, 0)))
    by_roots = "alpha_per_s" in derivatives or "omega_g_rad_per_s" in derivatives
    free = solve_free(t, alpha, omega_g, by_roots)
    held = free.velocity + 2 * alpha * free.value if free.held is None else free.held
    theta = theta0_rad * held + omega0_rad_per_s * free.value
    omega = omega0_rad_per_s * free.velocity - theta0_rad * square * free.value
    by_alpha = by_square = by_alpha_dot = by_square_dot = np.zeros_like(t)
    if by_roots:
        s2, s2_dot = free.square, free.square_dot
        s2_dot2 = free.value - 2 * alpha * s2_dot - square * s2
        by_alpha = 2 * square * theta0_rad * s2 - 2 * omega0_rad_per_s * s2_dot
        by_alpha_dot = 2 * square * theta0_rad * s2_dot - 2 * omega0_rad_per_s * s2_dot2
        by_square = -theta0_rad * (s2_dot + 2 * alpha * s2) - omega0_rad_per_s * s2
        by_square_dot = theta0_rad * (square * s2 - free.value) - omega0_rad_per_s * s2_dot
    columns = {
        "theta0_rad": (held, -square * free.value),
        "omega0_rad_per_s": (free.value, free.velocity),
    }
    forces = (
        ("drive_rad_per_s2", drive_rad_per_s2, float(omega_f_rad_per_s), float(phase_rad)),
        ("constant_rad_per_s2", constant_rad_per_s2, 0.0, 0.0),
    )
    for name, strength, frequency, phase in forces:
        if strength == 0 and name not in derivatives:
            continue
        by_frequency = name == "drive_rad_per_s2" and "omega_f_rad_per_s" in derivatives
        forced = solve_forced(t, alpha, frequency, free, by_roots, by_frequency)
        turn = complex(math.cos(phase), math.sin(phase))
        p, p_dot = turn * forced.value, turn * forced.velocity
        theta = theta + strength * p.real
        omega = omega + strength * p_dot.real
        columns[name] = (p.real, p_dot.real)
        if name == "drive_rad_per_s2":
            columns["phase_rad"] = (-strength * p.imag, -strength * p_dot.imag)
        if by_roots:
            q, q_dot, q_dot2 = turn * forced.square, turn * forced.square_dot, turn * forced.square_dot2
            by_alpha = by_alpha - 2 * strength * q_dot.real
            by_alpha_dot = by_alpha_dot - 2 * strength * q_dot2.real
            by_square = by_square - strength * q.real
            by_square_dot = by_square_dot - strength * q_dot.real
        if by_frequency:
            columns["omega_f_rad_per_s"] = (
                -strength * (turn * forced.by_frequency).imag,
                -strength * (turn * forced.by_frequency_dot).imag,
            )
    columns["alpha_per_s"] = (by_alpha, by_alpha_dot)
    columns["omega_g_rad_per_s"] = (2 * omega_g * by_square, 2 * omega_g * by_square_dot)
    d_theta, d_omega = np.zeros((t.size, len(derivatives))), np.zeros((t.size, len(derivatives)))
    for i, name in enumerate(derivatives):
        if name in columns:  # a drive of strength zero does not depend on its frequency and phase
            d_theta[:, i], d_omega[:, i] = columns[name]
    return LinearSolution(theta, omega, d_theta, d_omega, tuple(derivatives))


def paper_model(
    t_s: np.ndarray,
    theta0_rad: float,
    phi_rad: float,
    alpha_d_per_s: float,
    omega_g_rad_per_s: float,
    drive_rad_per_s2: float = 0.0,
    omega_f_rad_per_s: float = 0.0,
    phase_rad: float = 0.0,
    derivatives: Sequence[str] = (),
) -> LinearSolution:
    """The paper's solution (10) + (18): θ = θ₀ e^{−α_d t} sin(ω_u t + φ) + θ_i,  ω_u² = ω_g² − α_d².

    θ_i is the driven part, θ_i(0) = θ̇_i(0) = 0, of a drive drive·cos(ω_f t + phase) with drive = f₀/(mℓ).

    φ is carried through critical damping by its start: in every regime θ(0) = θ₀ sin φ and
    θ̇(0) = θ₀ (|ω_u| cos φ − α_d sin φ). Beyond critical damping that is
    θ₀ e^{−α_d t} (sin φ cosh|ω_u|t + cos φ sinh|ω_u|t): continuous in α_d and ω_g. Its slope is not, as |ω_u| has a
    square root there; at ω_u = 0 itself that infinite slope of |ω_u| is left out of the derivatives.
    derivatives : names out of `PAPER_PARAMETERS`. Raises UsageError as `solve_linear` does.
    """
    _check_names(derivatives, PAPER_PARAMETERS)
    alpha, omega_g = float(alpha_d_per_s), float(omega_g_rad_per_s)
    _require_finite((theta0_rad, phi_rad, alpha, omega_g))
    rate, _, sign = root_of_difference_of_squares(omega_g, abs(alpha))
    sin, cos = math.sin(phi_rad), math.cos(phi_rad)
    inner = [_PAPER_TO_LINEAR.get(name, name) for name in derivatives if name not in ("theta0_rad", "phi_rad")]
    if derivatives:
        inner += ["theta0_rad", "omega0_rad_per_s"]
    start, slope = theta0_rad * sin, theta0_rad * (rate * cos - alpha * sin)
    drive = (drive_rad_per_s2, omega_f_rad_per_s, phase_rad)
    solved = solve_linear(t_s, start, slope, alpha, omega_g, *drive, derivatives=inner)
    if not derivatives:
        return solved
    by_start = np.stack([solved.d_theta[:, -2], solved.d_omega[:, -2]])
    by_slope = np.stack([solved.d_theta[:, -1], solved.d_omega[:, -1]])
    chain = {
        "theta0_rad": sin * by_start + (rate * cos - alpha * sin) * by_slope,
        "phi_rad": theta0_rad * (cos * by_start - (rate * sin + alpha * cos) * by_slope),
        "alpha_d_per_s": -theta0_rad * ((sign * alpha / rate if rate else 0.0) * cos + sin) * by_slope,
        "omega_g_rad_per_s": theta0_rad * (sign * omega_g / rate if rate else 0.0) * cos * by_slope,
    }
    pair = np.zeros((2, solved.theta_rad.size, len(derivatives)))
    for i, name in enumerate(derivatives):
        if name in chain:
            pair[:, :, i] = chain[name]
        if name not in ("theta0_rad", "phi_rad"):
            column = inner.index(_PAPER_TO_LINEAR.get(name, name))
            pair[:, :, i] += np.stack([solved.d_theta[:, column], solved.d_omega[:, column]])
    return LinearSolution(solved.theta_rad, solved.omega_rad_per_s, pair[0], pair[1], tuple(derivatives))


def steady_state(
    alpha_per_s: float, omega_g_rad_per_s: float, drive_rad_per_s2: float, omega_f_rad_per_s: float
) -> complex:
    """Complex amplitude Z of the steady motion θ = Re(Z e^{iω_f t}) in rad; its modulus is the amplitude.

    Raises UsageError where there is no steady state (undamped at resonance).
    """
    roots = find_roots(float(alpha_per_s), float(omega_g_rad_per_s))
    denominator = (roots.first - 1j * omega_f_rad_per_s + 1j * roots.lost) * (
        roots.second - 1j * omega_f_rad_per_s - 1j * roots.lost
    )
    if denominator == 0:
        raise UsageError("an undamped pendulum driven at its own frequency has no steady state; give it drag")
    return drive_rad_per_s2 / denominator


_PLAIN_PHASE = 300.0  # rad; up to here a rounded phase costs less than 4e-14


def _solve_underdamped(
    t: np.ndarray, theta0: float, omega0: float, alpha: float, omega_g: float, a: float, omega_f: float, psi: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """The textbook's sum of a decaying and a steady cosine, where that neither cancels nor needs long phases."""
    roots, end = find_roots(alpha, omega_g), float(t.max())
    rate = roots.rate
    if roots.sign <= 0 or alpha < 0 or rate * end < 1 or max(rate, abs(omega_f)) * end > _PLAIN_PHASE:
        return None
    steady = 0j
    if a:
        shift = 1j * omega_f
        near, far = roots.first - shift + 1j * roots.lost, roots.second - shift - 1j * roots.lost
        if min(abs(near), abs(far)) * end < 1:
            return None
        steady = a * complex(math.cos(psi), math.sin(psi)) / (near * far)
        theta0, omega0 = theta0 - steady.real, omega0 + omega_f * steady.imag
    across = (omega0 + alpha * theta0) / rate
    theta, omega = np.empty(t.size), np.empty(t.size)
    for part in blocks(t.size):
        now = t[part]
        decay, angle = np.exp(-alpha * now), rate * now
        c, s = decay * np.cos(angle), decay * np.sin(angle)
        theta[part] = theta0 * c + across * s
        omega[part] = omega0 * c - (rate * theta0 + alpha * across) * s
        if a:
            angle = omega_f * now
            c, s = np.cos(angle), np.sin(angle)
            theta[part] += steady.real * c - steady.imag * s
            omega[part] -= omega_f * (steady.real * s + steady.imag * c)
    return theta, omega


_PAPER_TO_LINEAR = {"alpha_d_per_s": "alpha_per_s"}


def _checked_times(t_s: np.ndarray, values: tuple[float, ...], omega_g: float) -> np.ndarray:
    _require_finite(values)
    if omega_g < 0:
        raise UsageError(f"omega_g_rad_per_s must not be negative, got {omega_g}")
    t = np.asarray(t_s, dtype=float)
    if t.ndim != 1 or not np.all(np.isfinite(t)) or (t.size and t.min() < 0):
        raise UsageError("t_s must be one column of finite times that are not negative; shift the time axis")
    return t


def _require_finite(values: tuple[float, ...]) -> None:
    for value in values:
        if not math.isfinite(value):
            raise UsageError(f"the linear equation needs finite numbers, got {value}")


def _check_names(names: Sequence[str], known: tuple[str, ...]) -> None:
    for name in names:
        if name not in known:
            raise UsageError(f"no derivative by {name!r}; known are {', '.join(known)}")
