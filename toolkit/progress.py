"""How long work tells what it is doing: any function of a stage's name and the fraction of it that is done."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """The default `Progress`: says nothing."""
