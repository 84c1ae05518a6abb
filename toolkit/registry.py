"""Parts are found, not listed: a part is a module of a package, and its name is the module's name.

Finding only looks at file names; a part's module is imported when that part is asked for, so that a part which
nobody uses costs nothing.
"""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from types import ModuleType
from typing import Any

from toolkit.errors import UsageError


def part_names(package: ModuleType, not_parts: frozenset[str] = frozenset()) -> tuple[str, ...]:
    """The sorted names of the parts in `package`; modules in `not_parts` or with a leading _ do not count."""
    found = (module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(sorted(name for name in found if not name.startswith("_") and name not in not_parts))


def load_part(package: ModuleType, name: str, attribute: str, not_parts: frozenset[str] = frozenset()) -> Any:
    """The object called `attribute` in the part's module. Raises UsageError for a name that is not a part."""
    known = part_names(package, not_parts)
    if name not in known:
        kind = package.__name__.rsplit(".", 1)[-1].rstrip("s")
        raise UsageError(f"unknown {kind} {name!r}{did_you_mean(name, known)}")
    return getattr(importlib.import_module(f"{package.__name__}.{name}"), attribute)


def did_you_mean(word: str, known: tuple[str, ...] | list[str]) -> str:
    """The end of an error sentence: the nearest known word, or all of them."""
    near = difflib.get_close_matches(word, known, n=1)
    if near:
        return f": did you mean {near[0]!r}?"
    return f": known are {', '.join(known)}" if known else ""
