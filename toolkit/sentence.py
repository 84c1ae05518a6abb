"""A sentence for the user that other languages can say too."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class Sentence(str):
    """An English sentence; `key` names it in `toolkit/report/words`, `values` hold what is filled in (SI, plain numbers).

    It is a str in every other respect, so it prints, compares, pickles and goes into JSON as one.
    """

    key: str
    values: dict[str, Any]

    def __new__(cls, text: str, key: str = "", **values: Any) -> Sentence:
        made = super().__new__(cls, text)
        made.key, made.values = key, values
        return made


_RAISED = str.maketrans("0123456789+-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻")


class _Number(float):
    """A number that writes its power of ten as people do: `9.1×10⁻⁵`, not `9.1e-05`."""

    def __format__(self, spec: str) -> str:
        digits, e, power = super().__format__(spec).partition("e")
        return f"{digits}×10{str(int(power)).translate(_RAISED)}" if e else digits


def filled(template: str, values: Mapping[str, Any]) -> str:
    """The template with its values filled in."""
    return template.format(**{name: _Number(v) if isinstance(v, float) else v for name, v in values.items()})


def said(key: str, template: str, /, **values: Any) -> Sentence:
    """The Sentence of an English `template` (`"… {length_px:.2f} px …"`), which other languages fill with the same values.

    A value may itself be a Sentence.
    """
    return Sentence(filled(template, values), key, **values)
