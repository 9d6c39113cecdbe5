"""The dynamics of a scene as functions of numbers, and the start values that conditions ask for."""

from atwood.theory.dynamics.dynamics import Dynamics, dynamics
from atwood.theory.dynamics.initial_values import StartSolution, solve_initial_values

__all__ = ["Dynamics", "StartSolution", "dynamics", "solve_initial_values"]
