"""Small angles, linear and quadratic drag."""

from toolkit.models.model import Model

MODEL = Model(
    "small_angle_linear_quadratic_drag",
    "small angle, linear + quadratic drag",
    ("linear_drag", "quadratic_drag"),
    small_angle=True,
)
