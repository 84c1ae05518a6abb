"""Full sine, drag −k_d v."""

from toolkit.models.model import Model

MODEL = Model("full_linear_drag", "full sine, linear drag", ("linear_drag",))
