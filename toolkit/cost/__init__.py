"""What accuracy costs in time, one subject a file; each has `measure(folder, quick, progress) -> text`."""

from __future__ import annotations

import sys
from collections.abc import Callable

from toolkit.errors import UsageError
from toolkit.registry import did_you_mean, load_part, part_names

_NOT_SUBJECTS = frozenset({"problems"})


def subject_names() -> tuple[str, ...]:
    """The sorted names of what can be measured."""
    return part_names(sys.modules[__name__], _NOT_SUBJECTS)


def load_subject(name: str) -> Callable[..., str]:
    """A subject's `measure`. Raises UsageError for an unknown name."""
    if name not in subject_names():
        raise UsageError(f"unknown subject {name!r}{did_you_mean(name, subject_names())}")
    found: Callable[..., str] = load_part(sys.modules[__name__], name, "measure", _NOT_SUBJECTS)
    return found
