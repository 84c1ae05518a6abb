"""Full sine, linear drag and friction at the pivot."""

from toolkit.models.model import Model

MODEL = Model("full_linear_coulomb", "full sine, linear drag + pivot friction", ("linear_drag", "pivot_friction"))
