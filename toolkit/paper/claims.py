"""The paper's claims C1–C7, each weighed by numbers: transient and steady state, φ = 0 and π/2, both models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from toolkit.paper.table1 import MODELS, PHASES, SWEEPS, Case, Motion, Sweep, solve_case

PROPORTIONAL_WITHIN = 0.05
UNCHANGED_WITHIN = 0.001  # relative; no reader sees less on a plot
_STEPS_PER_S = 500
REGIMES = {"transient": (0.0, 10.0), "steady": (100.0, 120.0)}  # s; 20 s are three periods of the drive


@dataclass(frozen=True)
class Judgement:
    """A claim in one regime, for one φ and one model: the verdict and the numbers that decide it."""

    claim: str
    statement: str
    regime: str
    phi: str
    model: str
    verdict: str
    numbers: str


@dataclass(frozen=True)
class _Part:
    holds: bool
    numbers: str


_Run = dict[str, tuple[np.ndarray, Motion]]  # regime -> times and motion
_Quantity = Callable[[Motion], np.ndarray]
_QUANTITIES: dict[str, tuple[_Quantity, str]] = {
    "θ": (lambda m: m.theta, "rad"),
    "θ̇": (lambda m: m.omega, "rad/s"),
    "T": (lambda m: m.tension, "N"),
}
_STATEMENTS = {
    "C1": "longer ℓ: smaller amplitude of θ, longer period",
    "C2": "longer ℓ: smaller amplitude of θ̇, longer period",
    "C3": "larger f₀: larger amplitude of θ, no damped decay any more but a wave group",
    "C4": "larger f₀: larger amplitude of T, a wave group",
    "C5": "larger k_d: smaller amplitude of θ, θ̇ and T, inversely proportional",
    "C6": "larger θ₀: larger amplitude of θ, θ̇ and T, directly proportional",
    "C7": "longer ℓ: smaller amplitude of T, longer period",
}


def weigh_claims() -> list[Judgement]:
    """All judgements, claim by claim: 7 claims × 2 regimes × 2 phases × 2 models."""
    motions = {
        (sweep.field, model, phi): [_solve_both_regimes(case, model, PHASES[phi]) for case in sweep.cases()]
        for sweep in SWEEPS
        for model in MODELS
        for phi in PHASES
    }
    judgements = []
    for claim, statement in _STATEMENTS.items():
        for regime in REGIMES:
            for phi in PHASES:
                for model in MODELS:
                    solved = {sweep.field: motions[sweep.field, model, phi] for sweep in SWEEPS}
                    parts = _weigh(claim, regime, solved)
                    held = [part.holds for part in parts]
                    verdict = "holds" if all(held) else "holds in part" if any(held) else "fails"
                    numbers = "; ".join(f"{part.numbers} [{'yes' if part.holds else 'no'}]" for part in parts)
                    judgements.append(Judgement(claim, statement, regime, phi, model, verdict, numbers))
    return judgements


def _solve_both_regimes(case: Case, model: str, phi_rad: float) -> _Run:
    t = np.arange(round(REGIMES["steady"][1] * _STEPS_PER_S) + 1) / _STEPS_PER_S
    whole = solve_case(case, model, phi_rad, t)
    parts = {}
    for regime, (start, stop) in REGIMES.items():
        cut = slice(round(start * _STEPS_PER_S), round(stop * _STEPS_PER_S) + 1)
        parts[regime] = (t[cut], Motion(whole.theta[cut], whole.omega[cut], whole.tension[cut]))
    return parts


def _weigh(claim: str, regime: str, solved: Mapping[str, list[_Run]]) -> list[_Part]:
    if claim in ("C1", "C2", "C7"):
        quantity = {"C1": "θ", "C2": "θ̇", "C7": "T"}[claim]
        runs = [r[regime] for r in solved["length_m"]]
        return [_trend(SWEEPS[0], runs, quantity, -1), _period_trend(SWEEPS[0], runs, quantity)]
    if claim in ("C3", "C4"):
        quantity = {"C3": "θ", "C4": "T"}[claim]
        runs = [r[regime] for r in solved["f0_n"]]
        parts = [_trend(SWEEPS[1], runs, quantity, +1)]
        if claim == "C3":
            parts.append(_outlives_decay(solved["f0_n"]))
        return [*parts, _wave_group(SWEEPS[1], runs, quantity)]
    sweep, sign = (SWEEPS[2], -1) if claim == "C5" else (SWEEPS[3], +1)
    runs = [r[regime] for r in solved[sweep.field]]
    return [part for q in _QUANTITIES for part in (_trend(sweep, runs, q, sign), _proportion(sweep, runs, q, sign))]


def amplitude(x: np.ndarray) -> float:
    """Half the span between the largest and the smallest value."""
    return float(np.ptp(x)) / 2


def _amplitudes(runs: list, quantity: str) -> list[float]:
    return [amplitude(_QUANTITIES[quantity][0](motion)) for _, motion in runs]


def _listed(values: list[float]) -> str:
    return ", ".join(f"{v:.4g}" for v in values)


def _monotonic(values: list[float], sign: int) -> bool:
    return bool(np.all(sign * np.diff(values) > UNCHANGED_WITHIN * np.mean(values)))


def _trend(sweep: Sweep, runs: list, quantity: str, sign: int) -> _Part:
    values = _amplitudes(runs, quantity)
    text = f"amplitude of {quantity} {_listed(values)} {_QUANTITIES[quantity][1]} at {sweep.symbol} = {_listed(list(sweep.values))} {sweep.unit}"
    return _Part(_monotonic(values, sign), text)


def _proportion(sweep: Sweep, runs: list, quantity: str, sign: int) -> _Part:
    """Amplitude × k_d or amplitude / θ₀ must be one number, within 5 %."""
    constants = [a * v ** (-sign) for a, v in zip(_amplitudes(runs, quantity), sweep.values)]
    spread = max(constants) / min(constants) - 1
    what = f"amplitude of {quantity} {'×' if sign < 0 else '/'} {sweep.symbol} spreads by {100 * spread:.2g} %"
    return _Part(spread <= PROPORTIONAL_WITHIN, what)


def _period_trend(sweep: Sweep, runs: list, quantity: str) -> _Part:
    periods = [_period(t, _QUANTITIES[quantity][0](motion)) for t, motion in runs]
    return _Part(_monotonic(periods, +1), f"period of {quantity} {_listed(periods)} s")


def _period(t: np.ndarray, x: np.ndarray) -> float:
    """Mean time between maxima, over the first five of them."""
    turns = _turning_points(t, x)
    maxima = [time for time, value, is_top in turns if is_top][:5]
    return float(np.mean(np.diff(maxima))) if len(maxima) > 1 else float("nan")


def _turning_points(t: np.ndarray, x: np.ndarray) -> list[tuple[float, float, bool]]:
    """Inner extremes by the parabola through three samples: (time, value, is it a maximum)."""
    left, middle, right = x[:-2], x[1:-1], x[2:]
    found = np.flatnonzero((middle - left) * (middle - right) > 0)
    curve = left - 2 * middle + right
    shift = 0.5 * (left - right)[found] / curve[found]
    times = t[1:-1][found] + shift * (t[1] - t[0])
    values = middle[found] - 0.25 * (left - right)[found] * shift
    return [(float(a), float(b), bool(c)) for a, b, c in zip(times, values, curve[found] < 0)]


def _outlives_decay(runs: list) -> _Part:
    shares = [amplitude(r["steady"][1].theta) / amplitude(r["transient"][1].theta) for r in runs]
    return _Part(
        min(shares) > 0.05, f"after 100 s the swing still is {_listed([100 * s for s in shares])} % of the first 10 s"
    )


def _wave_group(sweep: Sweep, runs: list, quantity: str) -> _Part:
    """A group swells and fades: the span from one turning point to the next must grow again by more than 5 %."""
    counts = []
    for t, motion in runs:
        spans = np.abs(np.diff([value for _, value, _ in _turning_points(t, _QUANTITIES[quantity][0](motion))]))
        counts.append(_swellings(spans))
    return _Part(min(counts) >= 2, f"swellings of the envelope of {quantity}: {', '.join(map(str, counts))}")


def _swellings(spans: np.ndarray) -> int:
    """How often the sequence has an inner maximum that stands out from the minima on both sides by over 5 %."""
    count, low = 0, np.inf
    high, rising = -np.inf, False
    for span in spans:
        if not rising:
            low = min(low, span)
            if span > 1.05 * low:
                rising, high = True, span
        else:
            high = max(high, span)
            if span < high / 1.05:
                rising, low, count = False, span, count + 1
    return count
