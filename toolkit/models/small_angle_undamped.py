"""Small angles, no drag."""

from toolkit.models.model import Model

MODEL = Model("small_angle_undamped", "small angle, no drag", (), small_angle=True)
