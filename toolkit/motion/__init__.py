"""From the active effects to one equation, and from the equation to its solution."""

from toolkit.motion.equation import Equation, build_equation
from toolkit.motion.solver import Solution, Solver

__all__ = ["Equation", "Solution", "Solver", "build_equation"]
