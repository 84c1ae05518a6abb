"""Full sine, drag −c |v| v."""

from toolkit.models.model import Model

MODEL = Model("full_quadratic_drag", "full sine, quadratic drag", ("quadratic_drag",))
