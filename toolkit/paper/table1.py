"""Table 1: the paper's parameter sets, and their motion by both models."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from toolkit.motion.closed_form import paper_model

MODELS = ("small angle", "full equation")
PHASES = {"π/2": math.pi / 2, "0": 0.0}


@dataclass(frozen=True)
class Case:
    """One parameter set, SI; the paper's common values are the defaults."""

    length_m: float = 0.5
    f0_n: float = 0.15
    k_d_kg_per_s: float = 0.16
    theta0_rad: float = 1.0
    mass_kg: float = 0.25
    f_hz: float = 0.15
    g_m_per_s2: float = 9.8

    @property
    def alpha_d_per_s(self) -> float:
        """α_d = k_d/(2m)."""
        return self.k_d_kg_per_s / (2 * self.mass_kg)

    @property
    def omega_g_rad_per_s(self) -> float:
        """ω_g = √(g/ℓ)."""
        return math.sqrt(self.g_m_per_s2 / self.length_m)

    @property
    def omega_u_rad_per_s(self) -> float:
        """ω_u = √(ω_g² − α_d²)."""
        return math.sqrt(self.omega_g_rad_per_s**2 - self.alpha_d_per_s**2)


@dataclass(frozen=True)
class Sweep:
    """One row of Table 1: what varies, and the names of its panels for θ, θ̇ and T."""

    field: str
    symbol: str
    unit: str
    values: tuple[float, ...]
    panels: tuple[str, str, str]

    def cases(self) -> list[Case]:
        """One case a value."""
        return [replace(Case(), **{self.field: value}) for value in self.values]


SWEEPS = (
    Sweep("length_m", "ℓ", "m", (0.3, 0.5, 0.7), ("2a", "4a", "6a")),
    Sweep("f0_n", "f₀", "N", (0.3, 0.6, 0.9), ("2b", "4b", "6b")),
    Sweep("k_d_kg_per_s", "k_d", "kg/s", (0.12, 0.14, 0.16), ("3a", "5a", "7a")),
    Sweep("theta0_rad", "θ₀", "rad", (0.5, 0.6, 0.7), ("3b", "5b", "7b")),
)


@dataclass(frozen=True)
class Motion:
    """θ (rad), θ̇ (rad/s) and T (N) at the times, (n,) each."""

    theta: np.ndarray
    omega: np.ndarray
    tension: np.ndarray


def solve_case(case: Case, model: str, phi_rad: float, t_s: np.ndarray) -> Motion:
    """The motion of a case at t_s, by the paper's small-angle model (18)–(20) or the full equation (5) and (4).

    Both start from the same θ(0) = θ₀ sin φ and θ̇(0) = θ₀ (ω_u cos φ − α_d sin φ), which is what (10) means at t = 0.
    """
    weight, inertia = case.mass_kg * case.g_m_per_s2, case.mass_kg * case.length_m
    if model == "small angle":
        drive = case.f0_n / inertia, 2 * math.pi * case.f_hz
        own = (case.theta0_rad, phi_rad, case.alpha_d_per_s, case.omega_g_rad_per_s)
        solved = paper_model(t_s, *own, *drive)
        theta, omega = solved.theta_rad, solved.omega_rad_per_s
        return Motion(theta, omega, weight * (1 - theta**2 / 2) + inertia * omega**2)
    from toolkit.motion import build_equation

    start = case.theta0_rad * math.sin(phi_rad)
    rate = case.theta0_rad * (case.omega_u_rad_per_s * math.cos(phi_rad) - case.alpha_d_per_s * math.sin(phi_rad))
    parameters = {
        "mass_kg": case.mass_kg,
        "length_m": case.length_m,
        "g_m_per_s2": case.g_m_per_s2,
        "linear_drag.k_d_kg_per_s": case.k_d_kg_per_s,
        "cosine_drive.f0_n": case.f0_n,
        "cosine_drive.f_hz": case.f_hz,
        "cosine_drive.phase_rad": 0.0,
    }
    full = build_equation(("linear_drag", "cosine_drive")).solve(parameters, start, rate, t_s, accuracy_rad=1e-10)
    theta, omega = full.theta_rad, full.omega_rad_per_s
    return Motion(theta, omega, weight * np.cos(theta) + inertia * omega**2)
