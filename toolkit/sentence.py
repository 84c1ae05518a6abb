"""A sentence for the user that other languages can say too."""

from __future__ import annotations

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


def said(key: str, template: str, /, **values: Any) -> Sentence:
    """The Sentence of an English `template` (`"… {length_px:.2f} px …"`), which other languages fill with the same values.

    A value may itself be a Sentence.
    """
    return Sentence(template.format(**values), key, **values)
