"""All words of the report, one file a language in `words/`. A new language is one more file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from datetime import date
from functools import cache
from importlib.resources import files
from typing import Any

from toolkit.errors import UsageError


@dataclass(frozen=True)
class Words:
    """The words of one language: `words("page.title", name="…")` fills in the values."""

    lang: str
    table: dict[str, str]

    def __call__(self, key: str, /, **values: Any) -> str:
        text = self.table[key]
        return text.format(**values)

    def __contains__(self, key: str) -> bool:
        return key in self.table

    def either(self, key: str, otherwise: str, /, **values: Any) -> str:
        """The words for `key`, or `otherwise` where this language has none."""
        return self(key, **values) if key in self.table else otherwise

    def under(self, prefix: str) -> tuple[tuple[str, str], ...]:
        """(rest of the key, words) of every key that begins with `prefix`."""
        return tuple((key.removeprefix(prefix), text) for key, text in self.table.items() if key.startswith(prefix))

    def date(self, day: date) -> str:
        """A calendar date as the language writes it (Thai: the year of the Buddhist era)."""
        year = day.year + int(self.table["date.year_offset"])
        return self("date.form", day=day.day, month=self.table[f"date.month_{day.month}"], year=year)


def languages() -> tuple[str, ...]:
    """The languages there are, by their files."""
    folder = files("toolkit.report") / "words"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


@cache
def load_words(lang: str) -> Words:
    """The words of a language. Raises UsageError for one that has no file."""
    known = languages()
    if lang not in known:
        raise UsageError(f"unknown language {lang!r}: the report speaks {', '.join(known)}")
    text = (files("toolkit.report") / "words" / f"{lang}.toml").read_text(encoding="utf-8")
    return Words(lang, _flat(tomllib.loads(text)))


def _flat(table: dict[str, Any], above: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for key, value in table.items():
        name = f"{above}{key}"
        if isinstance(value, dict):
            flat |= _flat(value, name + ".")
        else:
            flat[name] = str(value)
    return flat
