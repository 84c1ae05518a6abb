"""The paper's model: small angles, drag −k_d v, in closed form."""

from toolkit.models.model import Model

MODEL = Model(
    "small_angle_linear_drag",
    "small angle, linear drag (the paper's)",
    ("linear_drag",),
    small_angle=True,
    closed_form=True,
)
