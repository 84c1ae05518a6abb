"""The pendulum once more, written by hand over SciPy: the truth against which the engine's tests judge.

Nothing of toolkit.motion is used. Turning points are SciPy events at which the integration starts again, so that |ω| and
sgn ω never switch inside a step; friction holds where the torque is too small.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp


def acceleration(p: Mapping[str, float], small_angle: bool = False) -> Any:
    """(t, θ, ω, sign of ω) -> θ'' for the effects whose parameters are in `p`."""
    m, length, g = p.get("mass_kg", 1.0), p["length_m"], p["g_m_per_s2"]
    k, c = p.get("linear_drag.k_d_kg_per_s", 0.0), p.get("quadratic_drag.c_kg_per_m", 0.0)
    torque = p.get("pivot_friction.torque_n_m", 0.0)
    f0, f, phase = (p.get(f"cosine_drive.{n}", 0.0) for n in ("f0_n", "f_hz", "phase_rad"))
    a, fp = p.get("moving_pivot.amplitude_m", 0.0), p.get("moving_pivot.f_hz", 0.0)
    factor = p.get("sphere_drag.factor", 0.0)
    sphere_re = 2 * p.get("bob_radius_m", 0.0) * length * p.get("fluid_density_kg_per_m3", 0.0)
    sphere_re /= p.get("fluid_viscosity_pa_s", 1.0)
    area = 0.5 * p.get("fluid_density_kg_per_m3", 0.0) * math.pi * p.get("bob_radius_m", 0.0) ** 2

    def second(t: float, theta: float, omega: float, sign: float) -> float:
        pull = theta if small_angle else math.sin(theta)
        tilt = 1.0 if small_angle else math.cos(theta)
        rate = 2 * math.pi * fp
        v = length * omega - a * rate * math.sin(rate * t) * tilt  # pivot shaken to the right
        total = -g / length * pull - k * v / (m * length) - c * length / m * omega * omega * sign
        total += f0 * math.cos(2 * math.pi * f * t + phase) / (m * length) - torque * sign / (m * length * length)
        total += a * rate**2 * math.cos(rate * t) * tilt / length
        if factor and omega:
            re = sphere_re * abs(omega)
            c_d = 24 / re * (1 + 0.152 * re**0.677) + 0.417 / (1 + 5070 * re**-0.94)
            total -= factor * area * c_d * (length * omega) ** 2 * sign / (m * length)
        return total

    return second


def integrate(
    p: Mapping[str, float], theta0: float, omega0: float, t: np.ndarray, small_angle: bool = False, rtol: float = 1e-13
) -> np.ndarray:
    """θ at the times t, from the state at 0."""
    second = acceleration(p, small_angle)
    switches = any(n.startswith(("quadratic_drag", "pivot_friction", "sphere_drag")) for n in p)
    holds = p.get("pivot_friction.torque_n_m", 0.0) > 0
    out = np.empty(t.size)
    out[t <= 0] = theta0
    now, state, end = 0.0, [theta0, omega0], float(t[-1])

    def turn(_t: float, y: Any) -> float:
        return float(y[1])

    turn.terminal = True  # type: ignore[attr-defined]
    while now < end:
        sign = math.copysign(1.0, state[1])
        if switches and state[1] == 0:
            up, down = second(now, state[0], 0.0, 1.0), second(now, state[0], 0.0, -1.0)
            if holds and up <= 0 <= down:
                until = _freed(second, now, end, state[0])
                out[(t > now) & (t <= until)] = state[0]
                now = until
                continue
            sign = 1.0 if up > 0 else -1.0
            kick = 1e-7  # away from the event at the start, by two terms of the series
            force = up if sign > 0 else down
            inside = (t > now) & (t <= now + kick)
            out[inside] = state[0] + 0.5 * force * (t[inside] - now) ** 2
            state = [state[0] + 0.5 * force * kick**2, force * kick]
            now += kick
        part = solve_ivp(
            lambda x, y, s=sign: (y[1], second(x, y[0], y[1], s)), (now, end), state, method="DOP853", rtol=rtol,
            atol=rtol, events=turn if switches else None, dense_output=True,
        )  # fmt: skip
        inside = (t > now) & (t <= part.t[-1])
        if inside.any():
            out[inside] = part.sol(t[inside])[0]
        now, state = float(part.t[-1]), [float(part.y[0, -1]), float(part.y[1, -1])]
        if part.status == 1:
            state[1] = 0.0
    return out


def _freed(second: Any, start: float, end: float, theta: float) -> float:
    """The time at which the torque on a held pendulum exceeds the friction."""
    from scipy.optimize import brentq

    grid = np.linspace(start, end, max(int((end - start) * 400), 2))
    for way in (1.0, -1.0):
        pull = np.array([way * second(x, theta, 0.0, way) for x in grid])
        over = np.flatnonzero(pull > 0)
        if over.size and over[0] > 0:
            first = brentq(lambda x, w=way: w * second(x, theta, 0.0, w), grid[over[0] - 1], grid[over[0]], xtol=1e-14)
            return float(first) + 1e-12
    return end
