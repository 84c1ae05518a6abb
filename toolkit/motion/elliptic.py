"""The bare pendulum, solved exactly:  θ̈ + ω_g² sin θ = 0, from any start: libration, rotation, separatrix.

With the energy modulus κ² = sin²(θ/2) + (θ̇/2ω_g)² and κ'² = 1 − κ² = cos²(θ/2) − (θ̇/2ω_g)²:

    libration κ < 1    sin(θ/2) = κ sn(ω_g t + u₀, κ)      θ̇ = 2 κ ω_g cn
    rotation  κ > 1    θ/2 = am(κ ω_g t + u₀, 1/κ)         θ̇ = 2 κ ω_g dn
    separatrix κ = 1   tan(θ/2) = sinh(ω_g t + u₀)         θ̇ = 2 ω_g sech

The Jacobi functions are ratios of theta series (four terms reach double precision): in the nome q = e^{−πK'/K} for
κ² ≤ 1/2, and after Jacobi's imaginary transformation in q' = e^{−πK/K'} beyond, where that one is small. κ' is found
without cancellation and is all that the neighbourhood of the separatrix depends on, so no digits are lost there
(scipy.special.ellipj loses eight). Periods come from the arithmetic-geometric mean, u₀ from Carlson's R_F.
Sources: DLMF chapters 19, 20, 22.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from functools import lru_cache

import numpy as np

from toolkit.errors import UsageError
from toolkit.motion.blocks import blocks
from toolkit.motion.exact_arithmetic import whole_multiple

_PI = math.pi
_TWO_PI_DIGITS = Decimal("6.283185307179586476925286766559005768394")


@dataclass(frozen=True)
class PendulumSolution:
    """θ and θ̇, (n,) each; `kind` is rest, libration, separatrix or rotation.

    period_s is that of one swing there and back, or of one turn over the top; inf on the separatrix.
    """

    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    kind: str
    period_s: float


def solve_pendulum(
    t_s: np.ndarray, theta0_rad: float, omega0_rad_per_s: float, omega_g_rad_per_s: float, compiled: bool = False
) -> PendulumSolution:
    """Solve θ̈ = −ω_g² sin θ from θ(0), θ̇(0) at the times t_s (n,) in s, any sign.

    compiled : many samples of few periods are read off one period's series by machine code; t_s must be finite
    and increase.
    θ is continuous: it grows past π when the pendulum goes over the top. Raises UsageError where ω_g ≤ 0 or a number is
    not finite.
    """
    t = np.asarray(t_s, dtype=float)
    if t.ndim != 1 or not (compiled or np.all(np.isfinite(t))):
        raise UsageError("t_s must be one column of finite times")
    motion = _classify(theta0_rad, omega0_rad_per_s, omega_g_rad_per_s)
    turns, theta0 = motion.turns, motion.theta0
    rate = omega_g_rad_per_s
    if motion.kind == "rest":
        return PendulumSolution(np.full(t.size, float(theta0_rad)), np.zeros(t.size), "rest", motion.period_s)
    if motion.kind == "separatrix":
        if math.cos(theta0 / 2) < 1e-16:  # at the top to the last digit: it never leaves
            return PendulumSolution(np.full(t.size, float(theta0_rad)), np.zeros(t.size), "separatrix", math.inf)
        u = math.asinh(math.tan(theta0 / 2)) + math.copysign(rate, omega0_rad_per_s) * t
        with np.errstate(over="ignore"):
            theta, omega = 2 * np.arctan(np.sinh(u)), math.copysign(2 * rate, omega0_rad_per_s) / np.cosh(u)
        return PendulumSolution(theta + turns, omega, "separatrix", math.inf)
    period, period_lost = motion.period_s, motion.period_lost
    direction = math.copysign(1.0, omega0_rad_per_s) if motion.kind == "rotation" else 1.0
    phase0 = motion.phase0
    if compiled and t.size > _MANY and np.abs(t[[0, -1]]).max() < 1000 * period:
        return PendulumSolution(*_sample_period(motion, rate, direction, t), motion.kind, period)
    theta, omega = np.empty(t.size), np.empty(t.size)
    for part in blocks(t.size):
        now = t[part]
        count = np.rint(now / period)
        whole, whole_lost = whole_multiple(count, period)
        # in periods of cn (libration) or of am, that is 2K (rotation)
        phase = phase0 + (direction / period) * ((now - whole) - whole_lost - count * period_lost)
        more = np.rint(phase)
        if motion.kind == "libration":
            angle, velocity = _libration(phase - more, motion.kappa, motion.kappa_c)
            theta[part], omega[part] = angle + turns, rate * velocity
        else:
            angle, velocity = _rotation(phase - more, motion.kappa, motion.kappa_c)
            theta[part] = angle + 2 * _PI * (direction * count + more) + turns
            omega[part] = direction * rate * velocity
    return PendulumSolution(theta, omega, motion.kind, period)


_MANY = 500  # samples; below, the elliptic functions themselves are as fast
_SPACING = 0.3  # of the points of one period, in 1/ω_g: the nearest singularity is π/2 away


def _sample_period(motion: _Motion, rate: float, direction: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """θ and θ̇ at the increasing times t from Taylor series about equally spaced points of one period."""
    from toolkit.motion.compiled import address, call, kernel
    from toolkit.motion.routes import ROW, SPARE

    points = 2 * math.ceil(motion.period_s * rate * max(1.0, motion.kappa) / _SPACING / 2)
    phase = np.arange(-points // 2, points // 2 + 1) / points
    solution = _libration if motion.kind == "libration" else _rotation
    angle, velocity = solution(phase, motion.kappa, motion.kappa_c)
    over = float(motion.kind == "rotation")
    period = (motion.period_s, motion.period_lost, motion.phase0, direction, motion.turns, over, rate * rate)
    times = t if t.flags.c_contiguous and t.flags.writeable else t.copy()
    out = np.empty((2, t.size))
    arrays = (
        np.array([t.size, points]), np.array(period), times, np.array([angle, (direction * rate) * velocity]),
        np.empty(SPARE + 2 * ROW * (points + 2)), out,
    )  # fmt: skip
    call(kernel("orbit"), *map(address, arrays))
    return out[0], out[1]


def pendulum_period(theta0_rad: float, omega_g_rad_per_s: float, omega0_rad_per_s: float = 0.0) -> float:
    """The exact period in s of the motion through (θ(0), θ̇(0)): 2π/(ω_g agm(1, κ')) for a swing; a turn, beyond."""
    return _classify(theta0_rad, omega0_rad_per_s, omega_g_rad_per_s).period_s


@dataclass(frozen=True)
class _Motion:
    kind: str
    turns: float  # whole turns taken off θ(0), in rad
    theta0: float
    kappa: float
    kappa_c: float  # √|1 − κ²|, as the modulus that belongs to the functions used
    period_s: float
    period_lost: float
    phase0: float  # u₀ in periods


@lru_cache(maxsize=64)  # a swing is often asked for again from the same start
def _classify(theta0_rad: float, omega0_rad_per_s: float, rate: float) -> _Motion:
    for value in (theta0_rad, omega0_rad_per_s, rate):
        if not math.isfinite(value):
            raise UsageError(f"the pendulum needs finite numbers, got {value}")
    if not rate > 0:
        raise UsageError(f"omega_g_rad_per_s must be positive, got {rate}")
    theta0 = math.remainder(theta0_rad, 2 * _PI)
    turns = theta0_rad - theta0
    sin, cos, speed = math.sin(theta0 / 2), math.cos(theta0 / 2), omega0_rad_per_s / (2 * rate)
    kappa = math.hypot(sin, speed)
    if kappa == 0:
        return _Motion("rest", turns, theta0, 0.0, 1.0, 2 * _PI / rate, 0.0, 0.0)
    square_c = _complement(theta0, omega0_rad_per_s, rate)
    if square_c == 0:
        return _Motion("separatrix", turns, theta0, 1.0, 0.0, math.inf, 0.0, 0.0)
    if square_c > 0:
        kappa_c = math.sqrt(square_c)
        period, lost = _period(kappa_c, rate)
        if speed == 0:
            phase0 = math.copysign(0.25, sin)
        else:
            # am(u₀) has sine sin/κ and cosine speed/κ; the quarter where the cosine is negative is reflected
            quarter = _first_kind(abs(sin) / kappa, (speed / kappa) ** 2, cos * cos) / (rate * period)
            phase0 = math.copysign(quarter if speed > 0 else 0.5 - quarter, sin)
        return _Motion("libration", turns, theta0, kappa, kappa_c, period, lost, phase0)
    kappa_c = math.sqrt(-square_c) / kappa
    period, lost = _period(kappa_c, rate * kappa, 0.5)
    phase0 = math.copysign(_first_kind(abs(sin), cos * cos, (speed / kappa) ** 2) / (rate * kappa * period), sin)
    return _Motion("rotation", turns, theta0, kappa, kappa_c, period, lost, phase0)


def _complement(theta0: float, omega0: float, rate: float) -> float:
    """1 − κ² = cos²(θ/2) − (θ̇/2ω_g)², relatively accurate also where the two are nearly equal."""
    full, speed = 2 * rate * abs(math.cos(theta0 / 2)), abs(omega0)
    if speed == 0:
        return math.cos(theta0 / 2) ** 2
    difference = full - speed
    if abs(difference) < 0.01 * full:
        with localcontext() as context:
            context.prec = 60
            difference = float(2 * Decimal(rate) * abs(_exact_cosine(theta0)) - Decimal(speed))
    return difference * (full + speed) / (4 * rate * rate)


def _exact_cosine(theta0: float) -> Decimal:
    """cos(θ/2) to 40 digits by its Taylor series."""
    with localcontext() as context:
        context.prec = 45
        square = (Decimal(theta0) / 2) ** 2
        term, total, n = Decimal(1), Decimal(1), 0
        while abs(term) > Decimal("1e-42"):
            n += 2
            term *= -square / (n * (n - 1))
            total += term
        return total


def _period(kappa_c: float, rate: float, share: float = 1.0) -> tuple[float, float]:
    """share · 2π/(rate·agm(1, κ')) as (rounded, lost); the mean is taken to 32 digits, so that 1e5 periods are safe."""
    with localcontext() as context:
        context.prec = 34
        a, b = Decimal(1), Decimal(kappa_c)
        while abs(a - b) > Decimal("1e-17") * a:  # quadratic: one more step doubles the digits
            a, b = (a + b) / 2, (a * b).sqrt()
        period = Decimal(share) * _TWO_PI_DIGITS / (Decimal(rate) * (a + b) / 2)
        rounded = float(period)
        return rounded, float(period - Decimal(rounded))


def _first_kind(sin: float, cos_square: float, delta_square: float) -> float:
    """F(φ, k) = sin φ · R_F(cos²φ, 1 − k² sin²φ, 1), by Carlson's duplication (DLMF 19.25.5, 19.36.1)."""
    x, y, z = cos_square, delta_square, 1.0
    for _ in range(60):
        mean = (x + y + z) / 3
        dx, dy, dz = 1 - x / mean, 1 - y / mean, 1 - z / mean
        if max(abs(dx), abs(dy), abs(dz)) < 2e-3:
            break
        step = math.sqrt(x * y) + math.sqrt(y * z) + math.sqrt(z * x)
        x, y, z = (x + step) / 4, (y + step) / 4, (z + step) / 4
    e2, e3 = dx * dy + dy * dz + dz * dx, dx * dy * dz
    series = 1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44 - 5 * e2**3 / 208 + 3 * e3 * e3 / 104
    return sin * (series + e2 * e2 * e3 / 16) / math.sqrt(mean)


def _libration(phase: np.ndarray, kappa: float, kappa_c: float) -> tuple[np.ndarray, np.ndarray]:
    """θ and θ̇/ω_g at phases −½ … ½ of a swing that passes the lowest point, going up, at phase 0."""
    log_nome, transformed = _log_nome(kappa, kappa_c)
    q = math.exp(-log_nome)
    t2, t3, t4 = _theta_constants(q)
    if not transformed:
        first, second, third, fourth = _theta_functions(*_circular(2 * _PI * phase), q)
        theta = 2 * np.arctan((kappa * t3 * t3 / (t2 * t4)) * first / third)
        return theta, (2 * kappa * t4 / t2) * second / fourth
    back = np.abs(phase) > 0.25
    folded = np.where(back, np.copysign(0.5, phase) - phase, phase)
    first, second, third, fourth = _theta_functions(*_hyperbolic(2 * log_nome * folded), q)
    theta = 2 * np.arctan((t4 / t2) * first / third)
    return theta, np.where(back, -1.0, 1.0) * (2 * kappa * t2 / t4) * fourth / second


def _rotation(phase: np.ndarray, kappa: float, kappa_c: float) -> tuple[np.ndarray, np.ndarray]:
    """θ and |θ̇|/ω_g at phases −½ … ½ of a turn that passes the lowest point at phase 0."""
    log_nome, transformed = _log_nome(1 / kappa, kappa_c)
    q = math.exp(-log_nome)
    t2, t3, t4 = _theta_constants(q)
    if not transformed:
        first, second, third, fourth = _theta_functions(*_circular(_PI * phase), q)
        return 2 * np.arctan2((t3 / t4) * first, second), (2 * kappa * t4 / t3) * third / fourth
    first, second, third, fourth = _theta_functions(*_hyperbolic(log_nome * phase), q)
    return 2 * np.arctan2((t3 / t2) * first, fourth), (2 * kappa * t2 / t3) * third / second


def _log_nome(k: float, k_c: float) -> tuple[float, bool]:
    """−ln of the smaller nome, and whether that is the transformed one (k² > ½)."""
    mean, mean_c = _agm(k_c), _agm(k)  # K = π/(2 agm(1, k')), K' = π/(2 agm(1, k))
    if k <= k_c:
        return _PI * mean / mean_c, False
    return _PI * mean_c / mean, True


def _agm(b: float) -> float:
    a = 1.0
    while abs(a - b) > 1e-8 * a:
        a, b = (a + b) / 2, math.sqrt(a * b)
    return (a + b) / 2


def _theta_functions(s: np.ndarray, c: np.ndarray, double: np.ndarray, q: float) -> tuple[np.ndarray, ...]:
    """θ₁ … θ₄ at z, the first two without their factor 2q^{1/4}; q ≤ e^{−π}.

    s, c, double: sin z, cos z, cos 2z, or sinh, cosh and the cosh of the double at an imaginary argument. The series
    of DLMF 20.2, as polynomials in cos 2z, up to q⁹ in θ₃, θ₄ and q¹² in θ₁, θ₂.
    """
    q2, q4, q6, q9, q12 = q * q, q**4, q**6, q**9, q**12
    square = double * double
    odd = (1 - q2 - q6 + q12) + (4 * q6 - 4 * q12) * square
    odd_slope = ((2 * q2 - 2 * q6 - 4 * q12) + 8 * q12 * square) * double
    even = (1 - 2 * q4) + 4 * q4 * square
    even_slope = ((2 * q - 6 * q9) + 8 * q9 * square) * double
    return s * (odd - odd_slope), c * (odd + odd_slope), even + even_slope, even - even_slope


def _theta_constants(q: float) -> tuple[float, float, float]:
    """θ₂ (without its factor 2q^{1/4}), θ₃, θ₄ at 0."""
    return 1 + q**2 + q**6 + q**12, 1 + 2 * q + 2 * q**4 + 2 * q**9, 1 - 2 * q + 2 * q**4 - 2 * q**9


def _circular(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    s = np.sin(z)
    return s, np.cos(z), 1 - 2 * s * s


def _hyperbolic(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    s = np.sinh(x)
    square = s * s
    return s, np.sqrt(1 + square), 1 + 2 * square
