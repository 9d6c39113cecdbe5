"""Kinetic energy, potential, Rayleigh function and generalized forces of a scene as expressions, part by part.

With ``L = T - V`` and the Rayleigh function R, Lagrange's equations are

    d/dt dL/dq' - dL/dq + dR/dq' = Q + G^T lambda,    g(q, t) = 0,    G = dg/dq

(Goldstein, equations 1.57, 1.70 and 2.23). All velocities are derivatives of coordinates, but for the angular velocity
of a body whose orientation is in quaternions: there the equations are Euler's, in the axes of the body (Goldstein,
equation 5.39). Angular velocities are rates of angles where orientations are in Euler angles.
"""

from atwood.forms.lagrangian.of_assembly import lagrangian_along_speeds, lagrangian_of, rows_by_part
from atwood.forms.lagrangian.terms import Contribution, Lagrangian

__all__ = ["Contribution", "Lagrangian", "lagrangian_along_speeds", "lagrangian_of", "rows_by_part"]
