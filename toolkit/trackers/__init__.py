"""Localisers of the bob, one file each: found by name, not listed."""

from __future__ import annotations

import sys
from functools import cache
from typing import TYPE_CHECKING

from toolkit.registry import load_part, part_names

if TYPE_CHECKING:
    from toolkit.trackers.localiser import Localiser

_NOT_PARTS = frozenset({"localiser"})


def tracker_names() -> tuple[str, ...]:
    """The names of all localisers."""
    return part_names(sys.modules[__name__], _NOT_PARTS)


@cache
def load_tracker(name: str) -> Localiser:
    """The localiser of that name. Raises UsageError for an unknown one."""
    found: Localiser = load_part(sys.modules[__name__], name, "LOCALISER", _NOT_PARTS)
    return found
