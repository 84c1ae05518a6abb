"""Small angles, drag −c |v| v."""

from toolkit.models.model import Model

MODEL = Model("small_angle_quadratic_drag", "small angle, quadratic drag", ("quadratic_drag",), small_angle=True)
