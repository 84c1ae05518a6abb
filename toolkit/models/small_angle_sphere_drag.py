"""Small angles, the drag of a sphere in the scene's fluid: no drag parameter is fitted."""

from toolkit.models.model import Model

MODEL = Model("small_angle_sphere_drag", "small angle, sphere drag", ("sphere_drag",), small_angle=True)
