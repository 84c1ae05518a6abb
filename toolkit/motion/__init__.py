"""From the active effects to one equation, and from the equation to its solution."""

from toolkit.motion.equation import Equation, Solution, build_equation

__all__ = ["Equation", "Solution", "build_equation"]
