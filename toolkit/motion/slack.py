"""A string instead of a rod: it goes slack where T = 0, the bob flies free, and the string catches it again.

While the string is taut the bob swings by the equation of motion, whose integrator watches the tension; in flight it moves
in the plane under whatever acts on the bob itself; when it is a string's length away from the pivot again, the velocity
along the string is lost (a light string that does not rebound) and the swing goes on with the velocity across it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from toolkit.errors import JobError
from toolkit.motion.flight import Acceleration, Flight, free_flight
from toolkit.motion.solver import Solver
from toolkit.trajectory import Event

if TYPE_CHECKING:
    from toolkit.motion.equation import Equation

_MOST_FLIGHTS = 10_000
_LOOKS = 257  # at a flight, to tell which way round the pivot it goes


@dataclass(frozen=True)
class SlackSolution:
    """The motion at t_s: (n,) arrays. In flight radius_m < ℓ, and θ, θ̇ are the bob's polar angle and its rate.

    events : `slack` and `taut`, in order, with their times and angles.    kept_energy : at each `taut` event, the
    share of the kinetic energy that the catch leaves.    evaluations, steps : of the swings.
    """

    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    radius_m: np.ndarray
    radial_velocity_m_per_s: np.ndarray
    events: tuple[Event, ...]
    kept_energy: tuple[float, ...]
    evaluations: int
    steps: int

    @property
    def in_flight(self) -> np.ndarray:
        """(n,) True where the string is slack."""
        return np.isfinite(self.radial_velocity_m_per_s)


def solve_with_slack(
    equation: Equation,
    parameters: Mapping[str, float],
    theta0_rad: float,
    omega0_rad_per_s: float,
    t_s: np.ndarray,
    accuracy_rad: float,
    flight: Flight | None = None,
) -> SlackSolution:
    """Swing, fly and be caught, from θ(0), θ̇(0) at t = 0, at the increasing times t_s ≥ 0.

    equation : with the effect `slack_string`.    accuracy_rad : of each swing.    flight : what acts while the string is
    slack, by default what the equation's effects do to a free body. A flight under gravity alone is exact; otherwise it
    is integrated (DOP853). radial_velocity_m_per_s is NaN while the string is taut. Raises JobError after 10 000 flights.
    """
    t = np.asarray(t_s, dtype=float)
    flight = flight or free_flight(equation, parameters)
    length, p = parameters["length_m"], equation.values(parameters)
    theta, omega = np.empty(t.size), np.empty(t.size)
    radius, radial = np.full(t.size, float(length)), np.full(t.size, np.nan)
    events: list[Event] = []
    kept: list[float] = []
    now, angle, rate = 0.0, float(theta0_rad), float(omega0_rad_per_s)
    done = evaluations = steps = 0
    while done < t.size:
        solver = Solver(equation, t[done:], accuracy_rad, start_s=now, again=False, until_slack=True)
        swing = solver.integrate(p, angle, rate)
        evaluations, steps = evaluations + swing.cost.evaluations, steps + swing.cost.steps
        events += swing.events
        slack = events[-1] if swing.events and events[-1].kind == "slack" else None
        stop = t.size if slack is None else int(np.searchsorted(t, slack.t_s, side="right"))
        theta[done:stop], omega[done:stop] = swing.theta_rad[: stop - done], swing.omega_rad_per_s[: stop - done]
        done = stop
        if slack is None or done >= t.size:
            break
        fall = _fly(slack, length, flight, float(t[-1]))
        stop = int(np.searchsorted(t, fall.stop, side="left"))
        part = slice(done, stop)
        caught = fall.stop if math.isfinite(fall.stop) else float(t[-1])
        path = fall.polar(np.append(t[part], caught), slack.theta_rad)
        theta[part], omega[part], radius[part], radial[part] = (column[:-1] for column in path)
        done = stop
        if not fall.stop <= t[-1]:
            break
        now = fall.stop
        angle, rate, _, along = (float(column[-1]) for column in path)
        whole = (rate * length) ** 2 + along**2
        kept.append((rate * length) ** 2 / whole if whole else 1.0)
        events.append(Event("taut", now, angle, rate))
        if len(kept) > _MOST_FLIGHTS:
            raise JobError(
                f"the string went slack {_MOST_FLIGHTS} times by t = {now:.6g} s; shorten the time or leave slack_string out"
            )
    return SlackSolution(theta, omega, radius, radial, tuple(events), tuple(kept), evaluations, steps)


@dataclass(frozen=True)
class _Fall:
    start: float
    stop: float  # inf where it ends after the last time asked for
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # (n, 2) positions and velocities

    def polar(self, t: np.ndarray, theta_start: float) -> tuple[np.ndarray, ...]:
        """θ (continuous with theta_start), θ̇, r and ṙ at increasing times."""
        looks = np.linspace(self.start, t[-1], _LOOKS)
        path = np.concatenate([looks, t])
        order = np.argsort(path, kind="stable")
        position, velocity = self.at(path)
        x, y = position.T
        angle = np.empty(path.size)
        angle[order] = np.unwrap(np.arctan2(x, -y)[order])
        angle += 2 * math.pi * np.rint((theta_start - angle[0]) / (2 * math.pi))
        square = x * x + y * y
        safe = np.where(square > 0, square, 1.0)
        rate = np.where(square > 0, (x * velocity[:, 1] - y * velocity[:, 0]) / safe, 0.0)
        distance = np.sqrt(square)
        outward = np.where(square > 0, (x * velocity[:, 0] + y * velocity[:, 1]) / np.sqrt(safe), 0.0)
        return tuple(column[_LOOKS:] for column in (angle, rate, distance, outward))


def _fly(slack: Event, length: float, flight: Flight, end: float) -> _Fall:
    """The flight from the state at which the string goes slack."""
    theta, omega, g, start = slack.theta_rad, slack.omega_rad_per_s, flight.g_m_per_s2, slack.t_s
    position = length * np.array([math.sin(theta), -math.cos(theta)])
    velocity = length * omega * np.array([math.cos(theta), math.sin(theta)])
    if flight.acceleration is not None:
        return _fly_through_air(start, position, velocity, length, g, flight.acceleration, end)
    fall = np.array([0.0, -g])
    # |x|² = ℓ² with the double root at the start taken out: g²τ²/4 + (v·g)τ + (v² + x·g) = 0
    half, rest = -2 * float(velocity @ fall) / (g * g), 4 * float(velocity @ velocity + position @ fall) / (g * g)
    duration = half + math.copysign(math.sqrt(max(half * half - rest, 0.0)), half) if half > 0 else _falling(half, rest)

    def at(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        tau = (t - start)[:, None]
        return position + tau * (velocity + 0.5 * tau * fall), velocity + tau * fall

    return _Fall(start, start + duration, at)


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
) -> _Fall:
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
    return _Fall(start, float(caught[0]) if caught.size else math.inf, at)
