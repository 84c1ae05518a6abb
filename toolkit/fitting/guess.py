"""First guesses from the data alone: where a fit starts.

Two ways. With two periods or more, short stretches of the record are fitted with a local sine (linear least squares),
which gives amplitude and frequency against time, hence ω_g (corrected for finite amplitude) and the decay law. With
less than that, or without oscillation, the equation of motion integrated twice is linear in its coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_STRETCH_PERIODS = 2.0
_MOST_STRETCHES = 40


@dataclass(frozen=True)
class Guess:
    """Start values (reduced coefficients, see `toolkit.models.model`) and what was seen on the way.

    periods : how many periods the record spans, as counted.    noise_rad : point-to-point scatter.
    """

    theta0: float
    phi: float
    omega_g: float
    theta_offset: float
    alpha_d: float = 0.0
    beta: float = 0.0
    mu: float = 0.0
    periods: float = 0.0
    noise_rad: float = 0.0


def guess(
    t_s: np.ndarray, theta_rad: np.ndarray, drags: Sequence[str] = ("alpha_d",), small_angle: bool = False
) -> Guess:
    """Start values for a record θ(t); `drags` names the coefficients that share the decay (alpha_d, beta, mu)."""
    noise = point_noise(theta_rad)
    offset = _middle(theta_rad)
    crossings = crossing_times(t_s, theta_rad - offset, noise)
    half = _half_period(crossings)
    if half is None:
        return guess_from_integrals(t_s, theta_rad, small_angle=small_angle)
    stretches = _stretches(t_s, theta_rad, half, crossings)
    if len(stretches) < 1 or crossings.size < 4:
        return guess_from_integrals(t_s, theta_rad, small_angle=small_angle)
    time, amplitude, omega, phase, middle, weight = (np.array(column) for column in zip(*stretches))
    strong = amplitude > max(0.05 * amplitude.max(), 0.3 * noise)
    time, amplitude, omega, phase, middle, weight = (a[strong] for a in (time, amplitude, omega, phase, middle, weight))
    peak = amplitude if small_angle else peak_from_fundamental(amplitude)
    ratio = np.ones_like(peak) if small_angle else frequency_ratio(peak)
    weight = weight * amplitude**2
    omega_g = float(np.average(omega / ratio, weights=weight))
    start, rates = decay_law(time, peak, omega_g, drags)
    start = min(start, 3.1) if not small_angle else start
    turns = _unwrapped(time, omega, phase)
    run = _run(time, ratio, 1.0 if small_angle else float(frequency_ratio(np.array([start]))[0]))
    phase_zero = float(turns[0] - omega_g * run[0])
    if time.size > 2:
        slope, level = (float(v) for v in np.polyfit(run, turns, 1, w=amplitude))
        if np.max(np.abs(turns - level - slope * run)) < 1.0:  # otherwise a turn was lost in a gap
            omega_g, phase_zero = slope, level
        else:
            omega_g = float(np.median(omega / ratio))
            phase_zero = float(turns[0] - omega_g * run[0])
    turn = phase_zero + math.pi / 2
    phi = turn if small_angle else _amplitude_phase(turn, start)
    return Guess(
        theta0=start,
        phi=math.remainder(phi, 2 * math.pi),
        omega_g=omega_g,
        theta_offset=float(np.median(middle)),
        periods=float((t_s[-1] - t_s[0]) / (2 * half)),
        noise_rad=noise,
        **rates,
    )


def _unwrapped(time: np.ndarray, omega: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """Phases of the stretches without their jumps of 2π: the frequencies at both ends of a gap count its turns."""
    turns = phase.copy()
    for i in range(1, time.size):
        ahead = turns[i - 1] + 0.5 * (omega[i] + omega[i - 1]) * (time[i] - time[i - 1])
        turns[i] = ahead + math.remainder(phase[i] - ahead, 2 * math.pi)
    return turns


def _run(time: np.ndarray, ratio: np.ndarray, at_zero: float) -> np.ndarray:
    """∫ ω/ω_g dt from t = 0 to each of the times."""
    first = 0.5 * (at_zero + ratio[0]) * time[0]
    steps = 0.5 * (ratio[1:] + ratio[:-1]) * np.diff(time)
    return first + np.concatenate([[0.0], np.cumsum(steps)])


def point_noise(theta_rad: np.ndarray) -> float:
    """Scatter of a point about its neighbours (third differences, median): an upper estimate of the noise σ in rad."""
    if theta_rad.size < 8:
        return 0.0
    return float(np.median(np.abs(np.diff(theta_rad, 3))) / (0.6745 * math.sqrt(20)))


def _middle(theta: np.ndarray) -> float:
    low, high = np.percentile(theta, [2, 98])
    mean = float(np.mean(theta))
    return min(max(mean, low + 0.3 * (high - low)), high - 0.3 * (high - low))


def crossing_times(t_s: np.ndarray, x: np.ndarray, noise: float) -> np.ndarray:
    """Times at which x(t) crosses zero, found with a dead band so that noise does not cross twice."""
    band = max(3.5 * noise, 0.02 * float(np.max(np.abs(x))))
    side = np.where(x > band, 1, np.where(x < -band, -1, 0))
    known = np.flatnonzero(side)
    if known.size < 2:
        return np.empty(0)
    change = np.flatnonzero(np.diff(side[known]) != 0)
    before, after = known[change], known[change + 1]
    return t_s[before] - x[before] * (t_s[after] - t_s[before]) / (x[after] - x[before])


def _half_period(crossings: np.ndarray) -> float | None:
    if crossings.size < 3:
        return None
    gaps = np.diff(crossings)
    return float(np.median(gaps))


def _stretches(
    t_s: np.ndarray, theta: np.ndarray, half: float, crossings: np.ndarray
) -> list[tuple[float, float, float, float, float, float]]:
    """(time, amplitude, ω, phase at that time, middle, weight) of stretches of about two periods along the record.

    θ ≈ middle + amplitude · cos(phase + ω (t − time)).
    """
    width = 2 * half * _STRETCH_PERIODS
    count = max(1, int((t_s[-1] - t_s[0]) / width))
    starts = t_s[0] + width * np.unique(np.linspace(0, count - 1, min(count, _MOST_STRETCHES)).astype(int))
    found = []
    omega = math.pi / half
    for begin in starts:
        low, high = np.searchsorted(t_s, [begin, begin + width * (1 + 1e-9)])
        if high - low < 8:
            continue
        step = max(1, (high - low) // 400)
        t, x = t_s[low:high:step], theta[low:high:step]
        centre = 0.5 * (t[0] + t[-1])
        first, last = np.searchsorted(crossings, [begin - half, begin + width + half])
        if last - first > 2:
            omega = math.pi / float(np.median(np.diff(crossings[first:last])))
        fit = _local_sine(t - centre, x, omega)
        if fit is None:
            continue
        amplitude, omega_here, phase, middle = fit
        found.append((centre, amplitude, omega_here, phase, middle, float(t.size)))
    return found


def _local_sine(t: np.ndarray, x: np.ndarray, omega: float) -> tuple[float, float, float, float] | None:
    """One sine with a middle and a third harmonic, ω by Gauss–Newton from `omega`. None where it does not settle."""
    begin = omega
    columns = np.empty((t.size, 6))
    columns[:, 2] = 1.0
    a = b = middle = 0.0
    for step in range(6):
        cosine, sine = np.cos(omega * t), np.sin(omega * t)
        columns[:, 0], columns[:, 1] = cosine, sine
        columns[:, 3], columns[:, 4] = cosine * (4 * cosine**2 - 3), sine * (3 - 4 * sine**2)
        columns[:, 5] = t * (b * cosine - a * sine)
        used = columns if step else columns[:, :5]
        gram = used.T @ used
        gram[np.diag_indices_from(gram)] *= 1 + 1e-9
        try:
            solution = np.linalg.solve(gram, used.T @ x)
        except np.linalg.LinAlgError:
            return None
        a, b, middle = (float(v) for v in solution[:3])
        if step:
            change = float(np.clip(solution[5], -0.1 * omega, 0.1 * omega))
            omega += change
            if not 0.5 * begin < omega < 2 * begin:
                return None
            if abs(change) < 1e-5 * omega:
                break
    return math.hypot(a, b), omega, math.atan2(-b, a), middle


def frequency_ratio(peak_rad: np.ndarray) -> np.ndarray:
    """ω/ω_g of a free swing of that amplitude: agm(1, cos(A/2)), exact (physics: T = 4K/ω_g)."""
    from scipy.special import ellipk

    modulus = np.sin(np.clip(np.abs(peak_rad), 0, 3.1415) / 2) ** 2
    return np.asarray(math.pi / (2 * ellipk(modulus)))


def peak_from_fundamental(amplitude_rad: np.ndarray) -> np.ndarray:
    """Turning-point angle of a free swing from the amplitude of its first harmonic (nome series)."""
    from scipy.special import ellipk, ellipkm1

    peak = np.linspace(1e-6, 3.12, 600)
    modulus = np.sin(peak / 2) ** 2
    nome = np.exp(-math.pi * ellipkm1(modulus) / ellipk(modulus))
    return np.asarray(np.interp(amplitude_rad, 8 * np.sqrt(nome) / (1 + nome), peak))


def _amplitude_phase(turn: float, peak: float) -> float:
    """φ of CONVENTIONS.md from the phase in time (0 at the upward crossing, 2π a period)."""
    from scipy.special import ellipj, ellipk

    modulus = math.sin(min(peak, 3.1) / 2) ** 2
    return float(ellipj(turn * 2 / math.pi * ellipk(modulus), modulus)[3])


def decay_law(time: np.ndarray, peak: np.ndarray, omega: float, drags: Sequence[str]) -> tuple[float, dict[str, float]]:
    """Amplitude at t = 0 and the coefficients ≥ 0 of A' = −α_d A − (4 β ω/3π) A² − 2 μ/(π ω), by its integral."""
    from scipy.optimize import nnls

    first = float(peak[np.argmin(time)])
    if not drags or time.size < 2:
        return first, dict.fromkeys(drags, 0.0)
    if time.size == 2 or tuple(drags) == ("alpha_d",):
        slope, level = np.polyfit(time, np.log(peak), 1, w=peak)
        rate = max(-float(slope), 0.0)
        start = math.exp(level) if rate else first
        rates = {
            "alpha_d": rate,
            "beta": 3 * math.pi * rate / (4 * omega * start),
            "mu": rate * start * omega * math.pi / 2,
        }
        return start, {name: rates[name] / len(drags) for name in drags}
    middle = 0.5 * (peak[1:] + peak[:-1])
    step = np.diff(time)
    law = {
        "alpha_d": middle,
        "beta": 4 * omega / (3 * math.pi) * middle**2,
        "mu": np.full_like(middle, 2 / (math.pi * omega)),
    }
    columns = [np.ones_like(peak)]
    for name in drags:
        columns.append(-np.concatenate([[0.0], np.cumsum(law[name] * step)]))
    columns[0] = columns[0]
    solution, _ = nnls(np.stack(columns, axis=1), peak)
    rates = dict(zip(drags, (float(v) for v in solution[1:])))
    at_first = float(solution[0])
    back = rates.get("alpha_d", 0.0) * at_first + law["beta"][0] / middle[0] ** 2 * rates.get("beta", 0.0) * at_first**2
    return at_first + back * float(time[0]), rates


def guess_from_integrals(
    t_s: np.ndarray,
    theta_rad: np.ndarray,
    *,
    small_angle: bool = False,
    drive: tuple[float, float, float] | None = None,
    span_s: float | None = None,
) -> Guess:
    """Start values from the equation of motion integrated twice, linear in its coefficients; any damping regime.

    θ = θ(0) + [θ'(0) + 2α θ(0)] t − 2α ∫θ − ω_g² ∬ sin θ + q t²/2 (+ ∬ drive); q stands for an offset of the vertical.
    drive : (a in 1/s², f in Hz, phase in rad), known.    span_s : use only the beginning of the record.
    """
    keep = slice(None) if span_s is None else slice(0, max(8, int(np.searchsorted(t_s, t_s[0] + span_s))))
    t, theta = t_s[keep], theta_rad[keep]
    noise = point_noise(theta)
    if t.size < 5:
        return Guess(
            max(float(np.max(np.abs(theta))), 1e-3), math.pi / 2, 2 * math.pi / max(float(np.ptp(t)), 1e-3), 0.0
        )
    tau = t - t[0]

    def integral(y: np.ndarray) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(tau))])

    force = theta if small_angle else np.sin(theta)
    target = theta.copy()
    if drive is not None:
        push = drive[0] * np.cos(2 * math.pi * drive[1] * t + drive[2])
        target = target - integral(integral(push))
    columns = np.stack([np.ones_like(tau), tau, -integral(theta), -integral(integral(force)), tau**2 / 2], axis=1)
    size = np.linalg.norm(columns, axis=0)
    solution = np.linalg.lstsq(columns / size, target, rcond=1e-9)[0] / size
    at_zero, slope, twice_alpha, omega2, lift = (float(v) for v in solution)
    if not omega2 > 0:
        solution = np.linalg.lstsq((columns / size)[:, :4], target, rcond=1e-9)[0] / size[:4]
        at_zero, slope, twice_alpha, omega2 = (float(v) for v in solution)
        lift = 0.0
    if not omega2 > 0:
        omega2 = (2 * math.pi / max(float(tau[-1]), 1e-6)) ** 2
    omega = math.sqrt(omega2)
    alpha = max(twice_alpha / 2, 0.0)
    offset = lift / omega2
    if not abs(offset) < 0.5 * float(np.ptp(theta)):
        offset = 0.0
    theta_start, omega_start = at_zero - offset, slope - twice_alpha * at_zero
    half = (
        (theta_start / 2, omega_start / (2 * omega))
        if small_angle
        else (math.sin(theta_start / 2), omega_start / (2 * omega))
    )
    size_half = math.hypot(*half)
    theta0 = 2 * size_half if small_angle else 2 * math.asin(min(size_half, 0.9999))
    return Guess(
        theta0=max(theta0, 1e-6),
        phi=math.atan2(half[0], half[1]) - omega * float(t[0]),
        omega_g=omega,
        theta_offset=offset,
        alpha_d=alpha,
        periods=float(tau[-1]) * omega / (2 * math.pi),
        noise_rad=noise,
    )
