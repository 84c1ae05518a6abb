"""What an effect is. One effect is one module of this package with a module-level `EFFECT`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Parameter:
    """A named, unit-bearing number of an effect. `default` None: the scene must give it."""

    name: str
    unit: str
    meaning: str
    default: float | None = None
    minimum: float | None = 0.0
    maximum: float | None = None
