"""Full sine, linear and quadratic drag and friction at the pivot."""

from toolkit.models.model import Model

MODEL = Model(
    "full_linear_quadratic_coulomb",
    "full sine, linear + quadratic drag + pivot friction",
    ("linear_drag", "quadratic_drag", "pivot_friction"),
)
