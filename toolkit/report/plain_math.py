"""The formulas of our equations as plain letters, for a terminal: `m ℓ² θ̈ = −m g ℓ sin θ`."""

from __future__ import annotations

import re
from collections.abc import Iterator

_TOKEN = re.compile(r"\\[A-Za-z]+|\\,|[{}^_]|\s+|[0-9.]+|.")
_LETTERS = {
    "\\ell": "ℓ",
    "\\theta": "θ",
    "\\pi": "π",
    "\\rho": "ρ",
    "\\mu": "μ",
    "\\tau": "τ",
    "\\varphi": "φ",
    "\\chi": "χ",
}
_LETTERS |= {
    "\\alpha": "α",
    "\\beta": "β",
    "\\omega": "ω",
    "\\cdot": "·",
    "\\,": " ",
    "\\left": "",
    "\\right": "",
    "-": "−",
}
_RAISED = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_LOWERED = str.maketrans("0123456789aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
_DOTS = {"\\dot": "\u0307", "\\ddot": "\u0308"}


def plain_math(latex: str) -> str:
    """A formula of `toolkit.motion` in Unicode. What it has no letter for stays as it was, without its backslash."""
    return " ".join(_sequence(iter(_TOKEN.findall(latex)), "").split())


def _sequence(tokens: Iterator[str], end: str) -> str:
    """All up to the token `end`, which is taken too."""
    told = ""
    for token in tokens:
        if token == end:
            break
        if token in "^_":
            told = told.rstrip() + _moved(token, _one(tokens))
        elif token == "\\frac":
            told += f"{_in_brackets(_one(tokens))}/{_in_brackets(_one(tokens))}"
        else:
            told += _said(token, tokens)
    return told


def _one(tokens: Iterator[str]) -> str:
    """The next letter, command or group."""
    token = next((token for token in tokens if not token.isspace()), "")
    return _said(token, tokens).strip()


def _said(token: str, tokens: Iterator[str]) -> str:
    if token == "{":
        return _sequence(tokens, "}")
    if token in _DOTS:
        return _one(tokens) + _DOTS[token]
    if token == "\\sqrt":
        return f"√{_in_brackets(_one(tokens))}"
    if token == "\\operatorname":
        return _one(tokens)
    return _LETTERS.get(token, token.lstrip("\\"))


def _in_brackets(part: str) -> str:
    """In brackets, but for one letter or number and for what is in a bracket or in bars already."""
    whole = re.fullmatch(r"√?[\w.²³]+[\u0307\u0308]?|\([^()]*\)[²³⁴]?|\|[^|]*\|", part)
    return part if whole else f"({part})"


def _moved(where: str, part: str) -> str:
    """Raised or lowered where there are such letters, else behind a mark."""
    letters = part.translate(_RAISED if where == "^" else _LOWERED)
    return letters if part and not set(letters) & set(part) else f"{where}{_in_brackets(part)}"
