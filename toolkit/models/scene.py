"""What the scene names: its effects, small angles where it says so. Drags of the reduced equation are fitted, the rest is held."""

from toolkit.models.model import Model

MODEL = Model("scene", "what the scene names", (), from_scene=True)
