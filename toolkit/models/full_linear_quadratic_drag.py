"""Full sine, linear and quadratic drag."""

from toolkit.models.model import Model

MODEL = Model("full_linear_quadratic_drag", "full sine, linear + quadratic drag", ("linear_drag", "quadratic_drag"))
