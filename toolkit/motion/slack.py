"""A string instead of a rod: it goes slack where T = 0, the bob flies free, and the string catches it again.

While the string is taut the bob swings by the equation of motion; in flight it moves in the plane under whatever acts on
the bob itself; when it is a string's length away from the pivot again, the velocity along the string is lost (a
light string that does not rebound) and the swing goes on with the velocity across it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolkit.errors import JobError
from toolkit.trajectory import Event

Swing = Callable[[float, float, float, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(start in s, θ and θ̇ there, times ≥ start) -> θ and θ̇ at the times."""
Tension = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(times, θ, θ̇) -> tension; only its sign is used."""
Acceleration = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
"""(time, position, velocity), each (right, up) from the pivot -> acceleration in m/s²."""

_SAMPLES_PER_RADIAN = 12
_MOST_FLIGHTS = 10_000


@dataclass(frozen=True)
class SlackSolution:
    """The motion at t_s: (n,) arrays. In flight radius_m < ℓ, and θ, θ̇ are the bob's polar angle and its rate.

    events : `slack` and `taut`, in order, with their times and angles.    kept_energy : at each `taut` event, the
    share of the kinetic energy that the catch leaves.
    """

    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    radius_m: np.ndarray
    radial_velocity_m_per_s: np.ndarray
    events: tuple[Event, ...]
    kept_energy: tuple[float, ...]

    @property
    def in_flight(self) -> np.ndarray:
        """(n,) True where the string is slack."""
        return np.isfinite(self.radial_velocity_m_per_s)


def solve_with_slack(
    t_s: np.ndarray,
    theta0_rad: float,
    omega0_rad_per_s: float,
    length_m: float,
    g_m_per_s2: float,
    swing: Swing,
    tension: Tension,
    acceleration: Acceleration | None = None,
    fastest_rad_per_s: float = 0.0,
) -> SlackSolution:
    """Swing, fly and be caught, from θ(0), θ̇(0) at t = 0, at the increasing times t_s ≥ 0.

    g_m_per_s2 : what pulls the bob down in flight (less buoyancy).    acceleration : None for flight under it alone,
    which is then exact; otherwise the flight is integrated (DOP853).    fastest_rad_per_s : the highest angular
    frequency of a drive, so that no dip of the tension is missed.
    radial_velocity_m_per_s is NaN while the string is taut. Raises JobError after 10 000 flights.
    """
    t = np.asarray(t_s, dtype=float)
    theta, omega = np.zeros(t.size), np.zeros(t.size)
    radius, radial = np.full(t.size, float(length_m)), np.full(t.size, np.nan)
    events: list[Event] = []
    kept: list[float] = []
    now, angle, rate = 0.0, float(theta0_rad), float(omega0_rad_per_s)
    end = float(t[-1]) if t.size else 0.0
    natural = math.sqrt(g_m_per_s2 / length_m)
    done = 0
    while done < t.size:
        fastest = max(natural, fastest_rad_per_s, abs(rate) + 2 * natural)
        window = min(end, now + 200 / fastest)
        until, at_theta, at_omega = _swing_until_slack(now, angle, rate, window, fastest, swing, tension)
        stop = int(np.searchsorted(t, until, side="right" if at_theta is None else "left"))
        if stop > done:
            theta[done:stop], omega[done:stop] = swing(now, angle, rate, t[done:stop])
            done = stop
        if at_theta is None or at_omega is None:
            if done >= t.size:
                break
            last = swing(now, angle, rate, np.array([until]))
            now, angle, rate = until, float(last[0][0]), float(last[1][0])
            continue
        events.append(Event("slack", until, at_theta))
        flight = _fly(until, at_theta, at_omega, length_m, g_m_per_s2, acceleration, end)
        stop = int(np.searchsorted(t, flight.stop, side="left"))
        if stop > done:
            part = slice(done, stop)
            theta[part], omega[part], radius[part], radial[part] = flight.polar(t[part], at_theta)
            done = stop
        if done >= t.size and not flight.stop <= end:
            break
        now = flight.stop
        caught = flight.polar(np.array([now]), at_theta)
        angle, rate = float(caught[0][0]), float(caught[1][0])
        across, along = rate * length_m, float(caught[3][0])
        whole = across * across + along * along
        kept.append(across * across / whole if whole else 1.0)
        events.append(Event("taut", now, angle))
        if len(kept) > _MOST_FLIGHTS:
            raise JobError(
                f"the string went slack {_MOST_FLIGHTS} times by t = {now:.6g} s; shorten the time or leave slack_string out"
            )
    return SlackSolution(theta, omega, radius, radial, tuple(events), tuple(kept))


def _swing_until_slack(
    start: float, theta: float, omega: float, stop: float, fastest: float, swing: Swing, tension: Tension
) -> tuple[float, float | None, float | None]:
    """(time, θ, θ̇) at which the tension first falls below zero, or (stop, None, None)."""
    t = np.linspace(start, stop, 2 + int((stop - start) * fastest * _SAMPLES_PER_RADIAN))
    angle, rate = swing(start, theta, omega, t)
    pull = tension(t, angle, rate)
    slack = np.flatnonzero(pull < 0)
    if slack.size and slack[0] == 0:
        return start, theta, omega
    first = int(slack[0]) if slack.size else t.size
    for dip in _dips(pull[:first]):  # a minimum between two samples may be below zero
        bracket = _dive(start, theta, omega, t[dip - 1], t[dip + 1], swing, tension)
        if bracket is not None:
            return _narrow(start, theta, omega, *bracket, swing, tension)
    if not slack.size:
        return stop, None, None
    return _narrow(start, theta, omega, t[first - 1], t[first], swing, tension)


def _dips(pull: np.ndarray) -> np.ndarray:
    """Indices of inner minima that are low enough for the tension to fall below zero beside them."""
    if pull.size < 3:
        return np.empty(0, dtype=int)
    left, middle, right = pull[:-2], pull[1:-1], pull[2:]
    return np.flatnonzero((middle <= left) & (middle <= right) & (middle < left - 2 * middle + right)) + 1


def _dive(
    start: float, theta: float, omega: float, left: float, right: float, swing: Swing, tension: Tension
) -> tuple[float, float] | None:
    """A bracket of the first zero within a dip of the tension, or None where it stays positive."""
    for _ in range(8):
        t = np.linspace(left, right, 33)
        pull = tension(t, *swing(start, theta, omega, t))
        below = np.flatnonzero(pull < 0)
        if below.size:
            return float(t[max(below[0] - 1, 0)]), float(t[below[0]])
        i = 1 + int(np.argmin(pull[1:-1]))
        if pull[i] > pull[i - 1] - 2 * pull[i] + pull[i + 1]:
            return None
        left, right = t[i - 1], t[i + 1]
    return None


_TOWARDS = np.concatenate([-(10.0 ** -np.arange(0, 17)), [0.0], 10.0 ** -np.arange(16, -1, -1)])


def _narrow(
    start: float, theta: float, omega: float, before: float, after: float, swing: Swing, tension: Tension
) -> tuple[float, float, float]:
    """The zero of the tension in a bracket, to the last digit of the time: (time, θ, θ̇) just after it.

    The line through the bracket's ends guesses it; the next samples crowd around the guess, so that the bracket shrinks as
    fast as the guess is good.
    """
    guess = 0.5 * (before + after)
    while True:
        t = np.clip(guess + (after - before) * _TOWARDS, before, after)
        t[0], t[-1] = before, after
        angle, rate = swing(start, theta, omega, t)
        pull = tension(t, angle, rate)
        slack = np.flatnonzero(pull < 0)
        first = max(int(slack[0]), 1) if slack.size else t.size - 1
        shorter = t[first] - t[first - 1] < (after - before) / 2
        before, after = float(t[first - 1]), float(t[first])
        if not shorter or after - before <= 4e-16 * after:
            return after, float(angle[first]), float(rate[first])
        high, low = float(pull[first - 1]), float(pull[first])
        guess = before + (after - before) * high / (high - low)


@dataclass(frozen=True)
class _Flight:
    start: float
    stop: float  # inf where it ends after the last time asked for
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # (n, 2) positions and velocities

    def polar(self, t: np.ndarray, theta_start: float) -> tuple[np.ndarray, ...]:
        """θ (continuous with theta_start), θ̇, r and ṙ."""
        stop = self.stop if math.isfinite(self.stop) else float(t[-1])
        path = np.union1d(np.linspace(self.start, stop, 257), t)
        position, velocity = self.at(path)
        x, y = position.T
        angle = np.unwrap(np.arctan2(x, -y))
        angle += 2 * math.pi * np.rint((theta_start - angle[0]) / (2 * math.pi))
        square = x * x + y * y
        safe = np.where(square > 0, square, 1.0)
        rate = np.where(square > 0, (x * velocity[:, 1] - y * velocity[:, 0]) / safe, 0.0)
        distance = np.sqrt(square)
        outward = np.where(square > 0, (x * velocity[:, 0] + y * velocity[:, 1]) / np.sqrt(safe), 0.0)
        wanted = np.searchsorted(path, t)
        return angle[wanted], rate[wanted], distance[wanted], outward[wanted]


def _fly(
    start: float,
    theta: float,
    omega: float,
    length: float,
    g: float,
    acceleration: Acceleration | None,
    end: float,
) -> _Flight:
    position = length * np.array([math.sin(theta), -math.cos(theta)])
    velocity = length * omega * np.array([math.cos(theta), math.sin(theta)])
    if acceleration is not None:
        return _fly_through_air(start, position, velocity, length, g, acceleration, end)
    fall = np.array([0.0, -g])
    # |x|² = ℓ² with the double root at the start taken out: g²τ²/4 + (v·g)τ + (v² + x·g) = 0
    half, rest = -2 * float(velocity @ fall) / (g * g), 4 * float(velocity @ velocity + position @ fall) / (g * g)
    duration = half + math.copysign(math.sqrt(max(half * half - rest, 0.0)), half) if half > 0 else _falling(half, rest)

    def at(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        tau = (t - start)[:, None]
        return position + tau * (velocity + 0.5 * tau * fall), velocity + tau * fall

    return _Flight(start, start + duration, at)


def _falling(half: float, rest: float) -> float:
    """The positive root of τ² − 2·half·τ + rest for half ≤ 0 and rest ≤ 0, without cancellation."""
    root = math.sqrt(max(half * half - rest, 0.0))
    return -rest / (root - half) if root > half else 0.0


def _fly_through_air(
    start: float,
    position: np.ndarray,
    velocity: np.ndarray,
    length: float,
    g: float,
    acceleration: Acceleration,
    end: float,
) -> _Flight:
    from scipy.integrate import solve_ivp

    def slope(t: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[2:], acceleration(t, state[:2], state[2:])])

    def stretched(t: float, state: np.ndarray) -> float:
        return float(state[:2] @ state[:2]) - length * length * (1 + 1e-14)  # rounding at the start is no catch

    stretched.terminal, stretched.direction = True, 1.0  # type: ignore[attr-defined]
    unit = math.sqrt(length / g)
    solved = solve_ivp(
        slope,
        (start, max(end, start) + unit),  # a little further, so that a catch just after the end is told from none
        np.concatenate([position, velocity]),
        method="DOP853",
        rtol=3e-14,
        atol=1e-15 * length,
        max_step=unit / 40,
        dense_output=True,
        events=stretched,
    )
    path = solved.sol

    def at(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        state = path(t).T
        return state[:, :2], state[:, 2:]

    caught = solved.t_events[0]
    return _Flight(start, float(caught[0]) if caught.size else math.inf, at)
