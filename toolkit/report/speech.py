"""How a language says what the toolkit found: names, findings, and the sentences of logs and warnings."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import TYPE_CHECKING, Any

from toolkit.report.numbers import number, percent
from toolkit.report.words import Words, load_words
from toolkit.sentence import Sentence, filled

if TYPE_CHECKING:
    from toolkit.checks.finding import Finding


def say(words: Words, text: str) -> str:
    """A logged sentence in the reader's language where it has a key and the language knows it, else as it is."""
    if isinstance(text, Sentence) and f"said.{text.key}" in words:
        values = {name: _named(words, value) for name, value in text.values.items()}
        return filled(words.table[f"said.{text.key}"], values)
    return str(text)


def say_error(words: Words, error: Exception | str) -> str:
    """An error's one line in the reader's language where it has words for a line of that shape, else as it is.

    The keys under `error.` are the shapes of the English lines, `{}` for what is filled in; that is said likewise.
    """
    line = " ".join(str(error).split())
    for shape, told in _shapes(words.lang):
        found = shape.fullmatch(line)
        if found:
            return told.format(*(say_error(words, part) for part in found.groups()))
    return line


@cache
def _shapes(lang: str) -> list[tuple[re.Pattern[str], str]]:
    """Shapes of error lines with their words, those with most letters first."""
    shapes = sorted(load_words(lang).under("error."), key=lambda pair: -len(pair[0].replace("{}", "")))
    return [(re.compile("(.*?)".join(map(re.escape, shape.split("{}"))), re.DOTALL), told) for shape, told in shapes]


def say_whole(words: Words, text: str) -> str:
    """`say`, beginning with a capital and ending with the language's full stop."""
    told = say(words, text)
    if told[:1].isascii():  # a symbol stays small
        told = f"{told[:1].upper()}{told[1:]}"
    return told if told.endswith((".", ":", "?")) else words("language.sentence", text=told)


def _named(words: Words, value: Any) -> Any:
    """A value to fill in: a sentence said, names in a list (`k_d, c` or `k1 0.02, yaw_rad 0.1`) as the language has them."""
    if isinstance(value, Sentence):
        return say(words, value)
    return (
        ", ".join(_term(words, *part.partition(" ")) for part in value.split(", ")) if isinstance(value, str) else value
    )


def _term(words: Words, name: str, *rest: str) -> str:
    return words.either(f"said.term.{name}", symbol(words, name)) + "".join(rest)


def solver(words: Words, method: str) -> str:
    """How an equation was solved, in the reader's language."""
    for key, told in words.under("said.solver."):
        method = method.replace(key, told)
    return method or "–"


def model_name(words: Words, name: str) -> str:
    """A model's name in words; its own name where the language has none."""
    return words.either(f"model.{name}", name.replace("_", " "))


def symbol(words: Words, name: str) -> str:
    """A parameter's symbol with the marks of `numbers.rich`; its own name where there is none."""
    return words.either(f"symbol.{name}", name)


def assumption(words: Words, finding: Finding) -> str:
    """The name of the assumption that was checked."""
    return words.either(f"assumption.{finding.assumption}", finding.assumption.replace("_", " "))


def sentence(words: Words, finding: Finding) -> str:
    """What was found, in the reader's language where that language has it, else in the check's own English."""
    return _said(words, "finding", finding, finding.sentence)


def remedy(words: Words, finding: Finding) -> str:
    """What to do about it, likewise."""
    return _said(words, "remedy", finding, finding.remedy)


def _said(words: Words, kind: str, finding: Finding, otherwise: str) -> str:
    key = f"{kind}.{finding.words_key}"
    if key not in words:
        key = key.removesuffix(".throughout")  # one remedy for both
    if key not in words:
        return say_whole(words, otherwise) if otherwise else ""
    try:
        return words(key, **_shown(finding.words_values))
    except (KeyError, IndexError):
        return otherwise


_SHARES = frozenset(
    [
        "share",
        "visible_share",
        "share_bound",
        "share_at_end",
        "slack_share",
        "decay",
        "period_shift",
        "rate_change",
        "scale",
        "scale_u",
    ]
)


_ABOUT = frozenset(["amplitude_above_rad", "amplitude_below_rad", "amplitude_visible_rad"])
"""Limits that are told as `about`, with two digits."""


def _shown(values: Any) -> dict[str, str]:
    """words_values as texts: `…_rad` also as `…_deg` and `…_mrad`, shares also as `…_percent`."""
    shown: dict[str, str] = {}
    for key, found in values.items():
        if not isinstance(found, int | float) or isinstance(found, bool):
            shown[key] = str(found)
            continue
        shown[key] = number(float(found), 3)
        if key.endswith("_rad"):
            digits = 2 if key in _ABOUT else 3
            shown[key.removesuffix("_rad") + "_deg"] = number(math.degrees(found), digits)
            shown[key.removesuffix("_rad") + "_mrad"] = number(1e3 * found, 2)
        if key.endswith("_s"):
            shown[key.removesuffix("_s") + "_ms"] = number(1e3 * found, 2)
        if key in _SHARES or key.endswith(("_share", "_relative")):
            shown[key + "_percent"] = percent(abs(float(found)))
    return shown
