"""Small angles, linear and quadratic drag and friction at the pivot."""

from toolkit.models.model import Model

MODEL = Model(
    "small_angle_linear_quadratic_coulomb",
    "small angle, linear + quadratic drag + pivot friction",
    ("linear_drag", "quadratic_drag", "pivot_friction"),
    small_angle=True,
)
