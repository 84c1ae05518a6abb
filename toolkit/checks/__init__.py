"""Checks of the assumptions of a pendulum experiment. One check is one module with a function
`check(evidence: Evidence) -> Finding | None` (None: the check does not apply to this record)."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from toolkit import registry

if TYPE_CHECKING:
    from toolkit.checks.evidence import Evidence
    from toolkit.checks.finding import Finding

_NOT_CHECKS = frozenset({"finding", "evidence"})


def check_names() -> tuple[str, ...]:
    """The sorted names of all checks found."""
    return registry.part_names(sys.modules[__name__], _NOT_CHECKS)


def load_check(name: str) -> Callable[[Evidence], Finding | None]:
    """The check of that name. Raises UsageError for a name that is not a check."""
    found: Callable[[Evidence], Finding | None] = registry.load_part(sys.modules[__name__], name, "check", _NOT_CHECKS)
    return found
