"""The symbols in which an effect writes its term, in three kinds: SymPy, NumPy numbers and LaTeX.

One term function serves all three, so that what is printed, what is compiled and what tension and energy are
computed from cannot differ.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from toolkit.effects.effect import Effect, PivotMotion

SCENE_SYMBOLS = {
    "mass_kg": "m",
    "length_m": r"\ell",
    "g_m_per_s2": "g",
    "bob_radius_m": "r",
    "fluid_density_kg_per_m3": r"\rho",
    "fluid_viscosity_pa_s": r"\mu",
}


class Symbols:
    """What a term function sees.

    t, theta, omega : time in s, angle in rad, angular velocity in rad/s.
    sin_theta, cos_theta, rise : sin θ, cos θ and 1 − cos θ; θ, 1 and θ²/2 under the small-angle approximation.
    velocity, speed : the bob's velocity along its path and its speed in m/s, against the room.
    mass_kg, length_m, g_m_per_s2, … : the scene.    Any other name : the effect's own parameter.
    pi, sin, cos, tan, exp, log, sqrt, tanh, abs, sign : as usual.
    """

    def __init__(self, names: Mapping[str, Any]):
        self.__dict__.update(names)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"no symbol {name!r}; an effect names what it uses in `needs` or `parameters`")

    def of(self, own: Mapping[str, Any]) -> Symbols:
        """The same symbols with an effect's own parameters."""
        return Symbols({**self.__dict__, **own})


def symbols(
    functions: Mapping[str, Any],
    state: Mapping[str, Any],
    values: Mapping[str, Any],
    effects: Sequence[Effect],
    small_angle: bool,
    formula_text: str = "",
) -> dict[str, Symbols]:
    """Effect name -> its symbols. `values` maps full parameter names ("length_m", "linear_drag.k_d_kg_per_s")."""
    theta, omega = state["theta"], state["omega"]
    common = {**functions, **state, **{n: v for n, v in values.items() if "." not in n}, "formula_text": formula_text}
    if small_angle:
        common |= {"sin_theta": theta, "cos_theta": 1, "rise": theta**2 / 2}
    else:
        cos_theta = functions["cos"](theta)
        common |= {"sin_theta": functions["sin"](theta), "cos_theta": cos_theta, "rise": 1 - cos_theta}
    common |= {"velocity": common["length_m"] * omega, "pivot": None}
    common |= {"speed": common["length_m"] * functions["abs"](omega)}
    own = {e.name: {n.split(".")[1]: v for n, v in values.items() if n.startswith(e.name + ".")} for e in effects}
    for effect in effects:
        if effect.pivot is not None:
            motion = effect.pivot(Symbols({**common, **own[effect.name]}))
            common |= _bob_velocity(common, motion, functions)
            common["pivot"] = motion
    return {e.name: Symbols({**common, **own[e.name]}) for e in effects} | {"": Symbols(common)}


def _bob_velocity(common: Mapping[str, Any], motion: PivotMotion, functions: Mapping[str, Any]) -> dict[str, Any]:
    right, up = motion.velocity
    along = common["velocity"] + right * common["cos_theta"] + up * common["sin_theta"]
    across = right * common["sin_theta"] - up * common["cos_theta"]
    return {"velocity": along, "speed": functions["sqrt"](along**2 + across**2)}


def number_functions() -> dict[str, Any]:
    """NumPy's functions: terms of arrays."""
    import numpy as np

    return {
        "pi": np.pi, "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log,
        "sqrt": np.sqrt, "tanh": np.tanh, "abs": np.abs, "sign": np.sign,
    }  # fmt: skip


def sympy_functions() -> dict[str, Any]:
    """SymPy's functions: terms that can be differentiated."""
    import sympy as sp

    return {
        "pi": sp.pi, "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "exp": sp.exp, "log": sp.log,
        "sqrt": sp.sqrt, "tanh": sp.tanh, "abs": sp.Abs, "sign": sp.sign,
    }  # fmt: skip


_SUM, _PRODUCT, _UNARY, _POWER, _ATOM = range(5)


class Latex:
    """LaTeX text that knows enough of precedence to be added, multiplied and raised to powers.

    factors : of a product, as (text, level, power), so that equal ones can be collected; the sign is left out.
    """

    def __init__(self, text: str, level: int = _ATOM, factors: tuple[tuple[str, int, int], ...] = ()):
        self.text, self.level, self.factors = text, level, factors
        if not factors:
            self.factors = ((text.removeprefix("-") if level > _SUM else text, level, 1),)

    @staticmethod
    def of(value: Any) -> Latex:
        """A number or LaTeX as LaTeX."""
        if isinstance(value, Latex):
            return value
        part = Fraction(value).limit_denominator(12)
        if part.denominator > 1 and abs(part - value) < 1e-15 and part.denominator not in (2, 4, 5, 8, 10):
            sign = "-" if part < 0 else ""
            return Latex(rf"{sign}\frac{{{abs(part.numerator)}}}{{{part.denominator}}}", _UNARY if sign else _ATOM)
        number = f"{value:g}"
        if "e" in number:
            digits, exponent = number.split("e")
            number = rf"{digits} \times 10^{{{int(exponent)}}}"
        return Latex(number, _ATOM if value >= 0 else _UNARY)

    def at(self, level: int) -> str:
        """The text, in brackets where it binds less than `level`."""
        return self.text if self.level >= level else rf"\left({self.text}\right)"

    def is_zero(self) -> bool:
        return self.text == "0"

    def __add__(self, other: Any) -> Latex:
        other = Latex.of(other)
        if self.is_zero() or other.is_zero():
            return other if self.is_zero() else self
        if other.text.startswith("-"):
            return Latex(f"{self.text} - {other.text[1:].lstrip()}", _SUM)
        return Latex(f"{self.text} + {other.text}", _SUM)

    def __radd__(self, other: Any) -> Latex:
        return Latex.of(other) + self

    def __neg__(self) -> Latex:
        if self.is_zero():
            return self
        if self.text.startswith("-") and self.level in (_PRODUCT, _UNARY):
            return Latex(self.text[1:].lstrip(), _PRODUCT, self.factors)
        factors = self.factors if self.level > _SUM else ((self.text, _SUM, 1),)
        return Latex("-" + self.at(_PRODUCT), _PRODUCT, factors)

    def __sub__(self, other: Any) -> Latex:
        return (
            self + (-Latex.of(other))
            if Latex.of(other).level > _SUM
            else self + Latex("-" + Latex.of(other).at(_PRODUCT), _PRODUCT)
        )

    def __rsub__(self, other: Any) -> Latex:
        return Latex.of(other) - self

    def __mul__(self, other: Any) -> Latex:
        other = Latex.of(other)
        if self.text == "1" or other.text == "1":
            return other if self.text == "1" else self
        if self.text == "-1":
            return -other
        if self.is_zero() or other.is_zero():
            return Latex("0")
        for one in (self, other):
            if one.text.startswith("-") and one.level in (_PRODUCT, _UNARY):
                return -(-self * other) if one is self else -(self * -other)
        powers: dict[tuple[str, int], int] = {}
        for text, level, power in (*self.factors, *other.factors):
            powers[text, level] = powers.get((text, level), 0) + power
        factors = tuple((text, level, power) for (text, level), power in powers.items())
        shown = ""
        for factor in factors:
            part = _raised(*factor)
            shown += (r" \cdot " if part[0].isdigit() else " ") + part if shown else part
        return Latex(shown, _PRODUCT, factors)

    def __rmul__(self, other: Any) -> Latex:
        return Latex.of(other) * self

    def __truediv__(self, other: Any) -> Latex:
        if self.text.startswith("-"):
            return -((-self) / other)
        return Latex(rf"\frac{{{self.text}}}{{{Latex.of(other).text}}}", _PRODUCT)

    def __rtruediv__(self, other: Any) -> Latex:
        return Latex.of(other) / self

    def __pow__(self, power: Any) -> Latex:
        if isinstance(power, int) and len(self.factors) == 1 and not self.text.startswith("-"):
            text, level, before = self.factors[0]
            return Latex(_raised(text, level, before * power), _POWER, ((text, level, before * power),))
        return Latex(rf"{{{self.at(_ATOM)}}}^{{{Latex.of(power).text}}}", _POWER)


def _raised(text: str, level: int, power: int) -> str:
    if power == 1:
        return Latex(text, level).at(_PRODUCT)
    base = Latex(text, level).at(_ATOM)
    return rf"{base}^{{{power}}}" if re.fullmatch(r"[A-Za-z]|\\[A-Za-z]+", base) else rf"{{{base}}}^{{{power}}}"


def latex_functions() -> dict[str, Any]:
    """LaTeX's functions: terms that can be read."""

    def named(name: str) -> Any:
        return lambda x: Latex(
            rf"\{name}" + (" " + x.text if len(x.text) < 8 and x.level >= _UNARY else rf"\left({x.text}\right)"),
            _PRODUCT if len(x.text) < 8 else _POWER,
        )

    def sign(x: Latex) -> Latex:
        return Latex(rf"\operatorname{{sgn}}\left({Latex.of(x).text}\right)", _POWER)

    def absolute(x: Latex) -> Latex:
        text = Latex.of(x).text
        return Latex(f"|{text}|" if " " not in text else rf"\left|{text}\right|")

    def root(x: Latex) -> Latex:
        return Latex(rf"\sqrt{{{Latex.of(x).text}}}")

    functions = {name: named(name) for name in ("sin", "cos", "tan", "exp", "log", "tanh")}
    return {**functions, "pi": Latex(r"\pi"), "sqrt": root, "abs": absolute, "sign": sign}
