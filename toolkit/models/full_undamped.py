"""The bare pendulum: full sine, no drag."""

from toolkit.models.model import Model

MODEL = Model("full_undamped", "full sine, no drag", ())
