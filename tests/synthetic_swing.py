"""Records whose truth is known, integrated by SciPy: independent of the toolkit's own equations and solvers."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from toolkit.series import ThetaSeries


def swing(
    theta0: float = 0.5,
    phi: float = 1.2,
    omega_g: float = 4.43,
    alpha_d: float = 0.02,
    beta: float = 0.0,
    mu: float = 0.0,
    drive: tuple[float, float] = (0.0, 0.0),
    duration_s: float = 20.0,
    fps: float = 60.0,
    noise_rad: float = 1e-3,
    rho: float = 0.0,
    offset: float = 0.01,
    seed: int = 1,
    sigma_known: bool = True,
    small_angle: bool = False,
    t_s: np.ndarray | None = None,
) -> ThetaSeries:
    """θ'' = −ω² sin θ − 2αθ' − β|θ'|θ' − μ sgn θ' + a cos 2πft, started as CONVENTIONS.md says, plus AR(1) noise."""
    t = np.arange(int(duration_s * fps) + 1) / fps if t_s is None else np.asarray(t_s)

    def slope(now: float, y: np.ndarray) -> tuple[float, float]:
        theta, omega = y
        back = omega_g**2 * (theta if small_angle else math.sin(theta))
        rub = mu * math.tanh(omega * 1e5) if mu else 0.0
        push = drive[0] * math.cos(2 * math.pi * drive[1] * now) if drive[0] else 0.0
        return omega, -back - 2 * alpha_d * omega - beta * abs(omega) * omega - rub + push

    kappa = math.sin(theta0 / 2)
    start = (
        (theta0 * math.sin(phi), theta0 * omega_g * math.cos(phi))
        if small_angle
        else (2 * math.asin(kappa * math.sin(phi)), 2 * kappa * omega_g * math.cos(phi))
    )
    if mu:
        theta = _by_halves(slope, start, t)
    else:
        theta = solve_ivp(slope, (0.0, float(t[-1]) + 1e-9), start, "DOP853", t, rtol=1e-11, atol=1e-12).y[0]
    rng = np.random.default_rng(seed)
    white = rng.normal(size=t.size + 200) * noise_rad * math.sqrt(1 - rho**2)
    noise = np.empty(white.size)
    noise[0] = white[0]
    for i in range(1, white.size):
        noise[i] = rho * noise[i - 1] + white[i]
    measured = theta + offset + noise[200:]
    return ThetaSeries(t, measured, np.full(t.size, noise_rad) if sigma_known and noise_rad > 0 else None)


def _by_halves(slope, start, t):  # type: ignore[no-untyped-def]
    """Coulomb friction by small fixed Runge–Kutta steps: nothing adaptive can trip over the jump."""
    theta = np.empty(t.size)
    y, now = np.array(start, float), 0.0
    for i, stop in enumerate(t):
        count = max(1, math.ceil((stop - now) / 1e-3)) if stop > now else 0
        for _ in range(count):
            h = (stop - now) / count
            k1 = np.array(slope(now, y))
            k2 = np.array(slope(now + h / 2, y + h / 2 * k1))
            k3 = np.array(slope(now + h / 2, y + h / 2 * k2))
            k4 = np.array(slope(now + h, y + h * k3))
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        now = stop
        theta[i] = y[0]
    return theta
