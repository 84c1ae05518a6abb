"""Full sine, the drag of a sphere in the scene's fluid: no drag parameter is fitted."""

from toolkit.models.model import Model

MODEL = Model("full_sphere_drag", "full sine, sphere drag", ("sphere_drag",))
