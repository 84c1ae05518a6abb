"""The functions of which every motion of the linear pendulum is made, named by their Laplace transforms.

With D(s) = s² + 2αs + ω_g²:

    S = 1/D     S2 = 1/D²     P = 1/(D (s−iω_f))     Q = 1/(D² (s−iω_f))     R = 1/(D (s−iω_f)²)

They are divided differences of e^{λt} at the roots λ₁, λ₂ of D and at iω_f, so they stay smooth where roots meet (critical
damping) or meet iω_f (resonance); each is evaluated by the one of its forms that does not cancel there. Nothing is
multiplied by e^{+αt}: no overflow at any t. Phases are carried in doubled precision, so that long times cost no digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from toolkit.motion.exact_arithmetic import cos_and_sin_of_product, root_of_difference_of_squares

_TAYLOR_TERMS = 30


@dataclass(frozen=True)
class Roots:
    """λ₁, λ₂ of D, their half distance |ω_u| = rate + lost, and the sign of ω_g² − α²."""

    first: complex
    second: complex
    rate: float
    lost: float  # of the imaginary part of λ₁ (and with the other sign of λ₂) where sign > 0, else 0
    rate_lost: float
    sign: int


def find_roots(alpha: float, omega_g: float) -> Roots:
    """The roots of D, accurate also where they nearly meet."""
    rate, rate_lost, sign = root_of_difference_of_squares(omega_g, abs(alpha))
    if sign >= 0:
        return Roots(complex(-alpha, rate), complex(-alpha, -rate), rate, rate_lost, rate_lost, sign)
    far = -math.copysign(abs(alpha) + rate, alpha)
    near = omega_g * omega_g / far  # not −α + rate, which cancels
    return Roots(complex(max(near, far)), complex(min(near, far)), rate, 0.0, rate_lost, sign)


@dataclass(frozen=True)
class Free:
    """S, Ṡ, (Ṡ + 2αS where it needs its own form), S2, Ṡ2 at the times, and the roots."""

    roots: Roots
    value: np.ndarray
    velocity: np.ndarray
    held: np.ndarray | None
    square: np.ndarray
    square_dot: np.ndarray


def solve_free(t: np.ndarray, alpha: float, omega_g: float, with_square: bool) -> Free:
    """S and its derivative at the times; with_square : S2 too."""
    roots = find_roots(alpha, omega_g)
    rate = roots.rate
    none = np.empty(0)
    if roots.sign >= 0:
        decay = np.exp(-alpha * t)
        c, s = cos_and_sin_of_product(rate, roots.rate_lost, t)
        stretched = s / rate if rate else t
        value = decay * stretched
        velocity = decay * (c - alpha * stretched)
        held = decay * (c + alpha * stretched)
        if not with_square:
            return Free(roots, value, velocity, held, none, none)
        square = _squared_near_critical(t, alpha, -rate * rate)
        far = rate * t >= 1
        square[far] = (decay * (stretched - t * c))[far] / (2 * rate * rate)
        return Free(roots, value, velocity, held, square, 0.5 * t * value - alpha * square)
    slow, fast = roots.first.real, roots.second.real
    decay, fast_decay = np.exp(slow * t), np.exp(fast * t)
    spread = -np.expm1(-2 * rate * t)
    value = decay * spread / (2 * rate)
    velocity = fast_decay + slow * value
    held = decay - slow * value
    if not with_square:
        return Free(roots, value, velocity, held, none, none)
    square = _squared_near_critical(t, alpha, rate * rate)
    square_dot = 0.5 * t * value - alpha * square
    far = rate * t >= 1
    scale = 1 / (4 * rate * rate)
    square[far] = scale * (t * (decay + fast_decay) - 2 * value)[far]
    square_dot[far] = scale * ((1 + slow * t) * decay + (1 + fast * t) * fast_decay - 2 * velocity)[far]
    return Free(roots, value, velocity, held, square, square_dot)


def _squared_near_critical(t: np.ndarray, alpha: float, discriminant: float) -> np.ndarray:
    """S2 where |discriminant| t² < 1, by its series; 0 elsewhere."""
    square = np.zeros_like(t)
    near = abs(discriminant) * t * t < 1
    x, total = discriminant * t[near] ** 2, np.zeros(int(near.sum()))
    for k in range(9, -1, -1):
        total = total * x + (k + 1) / math.factorial(2 * k + 3)
    square[near] = np.exp(-alpha * t[near]) * t[near] ** 3 * total
    return square


@dataclass(frozen=True)
class Forced:
    """P, Ṗ, Q, Q̇, Q̈, R, Ṙ at the times, complex."""

    value: np.ndarray
    velocity: np.ndarray
    square: np.ndarray
    square_dot: np.ndarray
    square_dot2: np.ndarray
    by_frequency: np.ndarray
    by_frequency_dot: np.ndarray


def solve_forced(
    t: np.ndarray, alpha: float, frequency: float, free: Free, with_square: bool, with_frequency: bool
) -> Forced:
    """P and its derivative at the times; with_square : Q too; with_frequency : R too."""
    roots = free.roots
    shift = 1j * frequency
    # λ − iω_f, with what rounding lost of λ put back after the subtraction that may cancel
    first = roots.first - shift + 1j * roots.lost
    second = roots.second - shift - 1j * roots.lost
    near, far = sorted((first, second), key=abs)
    c, s = cos_and_sin_of_product(frequency, 0.0, t)
    wave = c + 1j * s
    p, q, r = (np.zeros(t.size, dtype=complex) for _ in range(3))
    all_close = abs(far) * t < 2
    settled = ~all_close & (abs(near) * t >= 1)
    resonant = ~all_close & ~settled
    if settled.any():
        m = slice(None) if settled.all() else settled
        z = 1 / (near * far)
        lead = shift + 2 * alpha
        p[m] = z * (wave[m] - free.velocity[m] - lead * free.value[m])
        if with_square:
            q[m] = z * (p[m] - free.square_dot[m] - lead * free.square[m])
        if with_frequency:
            r[m] = z * (t[m] * wave[m] - (shift + lead) * p[m] - free.value[m])
    if resonant.any():
        m = resonant
        p[m], q[m], r[m] = _one_root_near(t[m], wave[m], near, far)
    if all_close.any():
        m = all_close
        p[m], q[m], r[m] = _both_roots_near(t[m], wave[m], near, far)
    p_dot = shift * p + free.value
    if not with_square:
        q_dot = q_dot2 = q
    else:
        q_dot = shift * q + free.square
        q_dot2 = shift * q_dot + free.square_dot
    return Forced(p, p_dot, q, q_dot, q_dot2, r, shift * r + p)


_Three = tuple[np.ndarray, np.ndarray, np.ndarray]  # P, Q, R


def _one_root_near(t: np.ndarray, wave: np.ndarray, near: complex, far: complex) -> _Three:
    """Partial fractions over the two roots, one of which is within 1/t of iω_f."""
    z = near * t
    e_near = wave * t * _phi1(z)
    e_far = wave * np.expm1(far * t) / far
    g_near = wave * t * t * _phi2(z)
    g_far = (e_far - t * wave) / far
    f_near = wave * np.exp(z) * t * t * _phi2(-z)
    f_far = (t * wave * np.exp(far * t) - e_far) / far
    gap = near - far
    p = (e_near - e_far) / gap
    return p, (f_near + f_far - 2 * p) / gap**2, (g_near - g_far) / gap


def _both_roots_near(t: np.ndarray, wave: np.ndarray, near: complex, far: complex) -> _Three:
    """Taylor series about iω_f with both roots within 2/t of it: Σ h_k t^{k+n}/(k+n)!, h_k complete symmetric."""
    unit = abs(far) or 1.0
    once, twice = _complete_symmetric((near / unit, far / unit)), _complete_symmetric((near / unit, far / unit) * 2)
    tau = t * unit

    def summed(coefficients: list[complex], order: int) -> np.ndarray:
        total = np.zeros(t.size, dtype=complex)
        for k in range(_TAYLOR_TERMS - 1, -1, -1):
            total = total * tau + coefficients[k] / math.factorial(k + order)
        return wave * t**order * total

    return summed(once, 2), summed(twice, 4), summed(once, 3)


def _complete_symmetric(nodes: tuple[complex, ...]) -> list[complex]:
    h = [1.0 + 0j] + [0j] * (_TAYLOR_TERMS - 1)
    for node in nodes:
        for k in range(1, _TAYLOR_TERMS):
            h[k] += node * h[k - 1]
    return h


def _phi1(z: np.ndarray) -> np.ndarray:
    """(e^z − 1)/z."""
    none = np.abs(z) < 1e-17  # there it rounds to 1; the quotient of two subnormal numbers may overflow
    return np.where(none, 1.0, np.expm1(z) / np.where(none, 1.0, z))


def _phi2(z: np.ndarray) -> np.ndarray:
    """(e^z − 1 − z)/z² for |z| ≤ 1, by its series."""
    total = np.zeros(z.shape, dtype=complex)
    for k in range(18, -1, -1):
        total = total * z + 1 / math.factorial(k + 2)
    return total
