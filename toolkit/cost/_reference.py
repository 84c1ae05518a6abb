"""An independent truth for measuring errors: Taylor series in whole-number arithmetic, 36 decimal places.

It shares neither code nor arithmetic with what it judges: no floating point, no NumPy, no SciPy, no compiled code.
θ̈ = −W sin θ − 2α θ̇ − β |θ̇| θ̇ + a cos(ω_f t + ψ) is solved with every parameter exact (a ratio of whole numbers), each
turning point of |θ̇| located and started from anew. The tests hold it to the elliptic solution in mpmath, to the
exact turning points of quadratic drag and to the linear closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from operator import mul

_BITS = 120
_ONE = 1 << _BITS
_ORDER = 26
_STEP_ERROR = 1e-26


@dataclass(frozen=True)
class ExactPendulum:
    """θ̈ = −gravity sin θ − 2α θ̇ − β |θ̇| θ̇ + drive cos(ω_f t + ψ); ω_f as a ratio, or in multiples of 2π as f_hz."""

    gravity: Fraction
    two_alpha: Fraction = Fraction(0)
    beta: Fraction = Fraction(0)
    drive: Fraction = Fraction(0)
    omega_f: Fraction = Fraction(0)
    f_hz: Fraction = Fraction(0)
    phase: Fraction = Fraction(0)


def solve_exactly(
    problem: ExactPendulum, theta0: float, omega0: float, times: Sequence[float]
) -> tuple[list[float], list[float]]:
    """θ and θ̇ at the increasing times ≥ 0, correctly rounded as far as 1e-24 a step allows."""
    theta, omega = solve_to_many_digits(problem, Fraction(theta0), Fraction(omega0), times)
    return [float(v) for v in theta], [float(v) for v in omega]


def solve_to_many_digits(
    problem: ExactPendulum, theta0: Fraction, omega0: Fraction, times: Sequence[float]
) -> tuple[list[Fraction], list[Fraction]]:
    """The same, not rounded: for differences between neighbouring solutions."""
    solver = _Solver(problem, theta0, omega0)
    pairs = [solver.state_at(Fraction(t)) for t in times]
    return [Fraction(p[0], _ONE) for p in pairs], [Fraction(p[1], _ONE) for p in pairs]


class _Solver:
    """Steps forward when asked for a time beyond the present step."""

    def __init__(self, problem: ExactPendulum, theta0: Fraction, omega0: Fraction):
        self.gravity, self.two_alpha, self.beta = (
            _fixed(v) for v in (problem.gravity, problem.two_alpha, problem.beta)
        )
        self.drive, self.phase = _fixed(problem.drive), _fixed(problem.phase)
        self.rate = _fixed(problem.omega_f) + _product(_fixed(problem.f_hz), 2 * _pi())
        self.start = self.step = 0
        self.theta, self.omega = [_fixed(theta0)], [_fixed(omega0)]
        self._expand()

    def state_at(self, time: Fraction) -> tuple[int, int]:
        at = _fixed(time)
        while at > self.start + self.step:
            self._advance()
        s = at - self.start
        return _value(self.theta, s), _value(self.omega, s)

    def _advance(self) -> None:
        end = self.step
        self.theta, self.omega = [_value(self.theta, end)], [self.turned or _value(self.omega, end)]
        self.start += end
        self._expand()

    def _expand(self) -> None:
        """Taylor coefficients of θ and ω about the start, and the length of the step that they allow."""
        theta, omega = self.theta, self.omega
        sine, cosine = _sine_and_cosine(theta[0])
        s, c = [sine], [cosine]
        drive_sine, drive_cosine = _sine_and_cosine(_product(self.rate, self.start) + self.phase)
        push = _product(self.drive, drive_cosine) - _product(self.gravity, sine)
        sign = 1 if (omega[0] or push) > 0 else -1  # from rest: where it will go
        weighted: list[int] = []  # j θ_j
        for k in range(_ORDER):
            force = -_product(self.gravity, s[k]) - _product(self.two_alpha, omega[k])
            if self.beta:
                force -= sign * _product(self.beta, _convolve(omega, omega, k))
            if self.drive:
                force += _product(self.drive, drive_cosine)
                drive_cosine, drive_sine = (
                    -_product(self.rate, drive_sine) // (k + 1),
                    _product(self.rate, drive_cosine) // (k + 1),
                )
            theta.append(omega[k] // (k + 1))
            omega.append(force // (k + 1))
            weighted.append((k + 1) * theta[k + 1])
            s.append(_convolve(weighted, c, k) // (k + 1))
            c.append(-_convolve(weighted, s, k) // (k + 1))
        sizes = [
            (_STEP_ERROR / max(abs(series[n]) / _ONE, 1e-60)) ** (1 / n)
            for series in (theta, omega)
            for n in (_ORDER - 1, _ORDER)
        ]
        # a longer step would amplify what decays, however small it has become
        decay = (self.two_alpha + 2 * _product(self.beta, abs(omega[0]))) / _ONE
        stable = 8.0 / (1e-3 + decay + (abs(self.gravity) / _ONE) ** 0.5)
        self.step = int(min(*sizes, stable) * _ONE)
        self.turned = 0
        if self.beta:
            self._stop_at_turning_point(sign)

    def _stop_at_turning_point(self, sign: int) -> None:
        """Cut the step where ω changes its sign, and start the next one just on the other side."""
        inside = [self.step * i // 16 for i in range(1, 17)]
        beyond = next((s for s in inside if _value(self.omega, s) * sign < 0), None)
        if beyond is None:
            return
        low, high = 0, beyond
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if _value(self.omega, middle) * sign < 0 else (middle, high)
        self.step = high
        self.turned = -sign


def _fixed(value: Fraction) -> int:
    return (value.numerator << _BITS) // value.denominator


def _product(a: int, b: int) -> int:
    return (a * b) >> _BITS


def _convolve(a: Sequence[int], b: Sequence[int], k: int) -> int:
    """Σ a_j b_{k−j}, j = 0 … k."""
    return sum(map(mul, a[: k + 1], b[k::-1])) >> _BITS


def _value(series: Sequence[int], s: int) -> int:
    total = 0
    for coefficient in reversed(series):
        total = ((total * s) >> _BITS) + coefficient
    return total


def _pi() -> int:
    """π by Machin's formula."""

    def arctan_of_inverse(n: int) -> int:
        guard = 32
        term = total = (_ONE << guard) // n
        k = 1
        while term:
            term = -term // (n * n)
            k += 2
            total += term // k
        return total >> guard

    return 4 * (4 * arctan_of_inverse(5) - arctan_of_inverse(239))


_PI = _pi()


def _sine_and_cosine(angle: int) -> tuple[int, int]:
    """sin and cos of a fixed-point angle: reduced to |x| ≤ π/8, Taylor, doubled twice."""
    turn = 2 * _PI
    angle -= turn * ((angle + _PI) // turn)
    x = angle >> 3
    square = _product(x, x)
    s = term_s = x
    c = term_c = _ONE
    for k in range(1, 20):
        term_c = -_product(term_c, square) // ((2 * k - 1) * (2 * k))
        term_s = -_product(term_s, square) // ((2 * k) * (2 * k + 1))
        c, s = c + term_c, s + term_s
    for _ in range(3):
        s, c = 2 * _product(s, c), _ONE - 2 * _product(s, s)
    return s, c
