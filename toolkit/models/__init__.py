"""What is fitted: pendulum models with their free parameters. One model is one module with a module-level `MODEL`."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING

from toolkit import registry

if TYPE_CHECKING:
    from toolkit.models.model import Model

_NOT_MODELS = frozenset({"model"})

STANDARD = (
    "small_angle_linear_drag",
    "full_linear_drag",
    "full_quadratic_drag",
    "full_linear_quadratic_drag",
    "full_linear_quadratic_coulomb",
)
"""The ladder that every report fits: the paper's model and four with the full sine."""


def model_names() -> tuple[str, ...]:
    """The sorted names of all models found."""
    return registry.part_names(sys.modules[__name__], _NOT_MODELS)


@functools.cache
def load_model(name: str) -> Model:
    """The model of that name. Raises UsageError for a name that is not a model."""
    model: Model = registry.load_part(sys.modules[__name__], name, "MODEL", _NOT_MODELS)
    return model
