"""Numbers as a lab report writes them: the uncertainty to two digits, the value to the same place (JCGM 100, 7.2.6).

Texts carry light marks that each writer turns into its own: `_{below}`, `^{above}` and `**bold**`; an option of the
command (`--start`) is set as code.
"""

from __future__ import annotations

import math
import re
from decimal import ROUND_HALF_EVEN, Decimal

_MINUS = "−"
_ROUNDING = 2.0**-52
"""An uncertainty below the value's own rounding says nothing."""
_MARK = re.compile(r"_\{([^{}]*)\}|\^\{([^{}]*)\}|\*\*(.+?)\*\*|(--[a-z][a-z-]+)")


def rounded(value: float, u: float) -> tuple[str, str]:
    """(value, uncertainty) as plain decimals: `u` to two significant digits, `value` to the same place."""
    quantum = _quantum(u)
    return _plain(Decimal(repr(value)).quantize(quantum, ROUND_HALF_EVEN), quantum), _plain(
        Decimal(repr(u)).quantize(quantum, ROUND_HALF_EVEN), quantum
    )


def _quantum(u: float) -> Decimal:
    """The decimal place of the second significant digit of `u` after rounding."""
    exact = Decimal(repr(u))
    place = exact.adjusted() - 1
    if exact.quantize(Decimal(1).scaleb(place), ROUND_HALF_EVEN).adjusted() > exact.adjusted():
        place += 1  # 0.0996 becomes 0.10, not 0.100
    return Decimal(1).scaleb(place)


def _plain(number: Decimal, quantum: Decimal) -> str:
    places = max(0, -int(quantum.adjusted()))
    text = f"{number:.{places}f}"
    if not number:
        text = text.lstrip("-")
    return text.replace("-", _MINUS)


def with_uncertainty(value: float, u: float | None, unit: str = "", digits: int = 6) -> str:
    """`(0.1234 ± 0.0056) kg/s`, or with a power of ten; without a known `u`, or one below rounding, the value alone to `digits` digits."""
    if not math.isfinite(value):
        return "–"
    shown = unit_text(unit)
    if u is None or not math.isfinite(u) or u <= abs(value) * _ROUNDING:
        return _joined(number(value, digits), shown)
    exponent = _exponent(max(abs(value), u))
    if exponent:
        scaled_value, scaled_u = (float(Decimal(repr(x)).scaleb(-exponent)) for x in (value, u))
        text = "({} ± {}) × 10^{{{}}}".format(*rounded(scaled_value, scaled_u), str(exponent).replace("-", _MINUS))
        return _joined(text, shown)
    first, second = rounded(value, u)
    return _joined(f"({first} ± {second})", shown) if shown else f"{first} ± {second}"


def _joined(text: str, unit: str) -> str:
    if not unit:
        return text
    return text + unit if unit == "°" and not text.endswith("}") else f"{text}\u00a0{unit}"


def _exponent(size: float) -> int:
    """0 where a plain decimal reads well, else the power of ten to take out."""
    if size == 0:
        return 0
    power = math.floor(math.log10(size))
    return power if power < -3 or power >= 5 else 0


def number(value: float, digits: int = 3) -> str:
    """A number to `digits` significant digits, with a power of ten where it is very large or small."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    exponent = _exponent(abs(value))
    scaled = value / 10.0**exponent
    places = max(0, digits - 1 - math.floor(math.log10(abs(scaled))))
    text = f"{scaled:.{places}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".") if digits > 4 else text
    text = text.replace("-", _MINUS)
    return f"{text} × 10^{{{str(exponent).replace('-', _MINUS)}}}" if exponent else text


def percent(fraction: float) -> str:
    """A fraction as a percentage with two digits: `0.34 %`."""
    return f"{number(100 * fraction, 2)}\u00a0%"


_UNITS = {
    "1": "",
    "": "",
    "deg": "°",
    "N·m": "N m",
    "1/s": "s^{−1}",
    "1/s2": "s^{−2}",
    "1/s^2": "s^{−2}",
    "1/s²": "s^{−2}",
}


def unit_text(unit: str) -> str:
    """A unit as it is printed: `1/s` as s⁻¹, the unit one as nothing."""
    return _UNITS.get(unit, unit)


def rich(text: str) -> list[tuple[str, str]]:
    """[(style, text)] with style `plain`, `sub`, `sup`, `bold` or `code`."""
    parts: list[tuple[str, str]] = []
    end = 0
    for found in _MARK.finditer(text):
        if found.start() > end:
            parts.append(("plain", text[end : found.start()]))
        below, above, bold, code = found.groups()
        if below is not None:
            parts.append(("sub", below))
        elif above is not None:
            parts.append(("sup", above))
        elif bold is not None:
            parts.append(("bold", bold))
        else:
            parts.append(("code", code))
        end = found.end()
    if end < len(text):
        parts.append(("plain", text[end:]))
    return parts


def bare(text: str) -> str:
    """The text without marks, for a terminal, a spreadsheet or an `alt` text; powers of ten as ×10^−5."""
    return unmarked(text).replace("\u00a0", " ")


def unmarked(text: str) -> str:
    """`bare`, with the spaces at which no line may end."""
    out = []
    for style, part in rich(text):
        out.append(("^" if style == "sup" else "_" if style == "sub" else "") + part)
    return "".join(out)
