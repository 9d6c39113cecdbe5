"""Rotation matrices R_WB: columns are the axes of the body B in the world W, so that R_WB takes body to world."""

import numpy as np


def cross_matrix(v):
    """[v]x, so that [v]x w = v x w; shape (..., 3) gives (..., 3, 3)."""
    v = np.asarray(v, dtype=float)
    out = np.zeros((*v.shape, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return out - np.swapaxes(out, -1, -2)


def about(axis, angle):
    """The rotation by an angle (any shape) about a unit vector: Rodrigues' formula."""
    angle = np.asarray(angle, dtype=float)[..., None, None]
    k = cross_matrix(np.asarray(axis, dtype=float))
    return np.eye(3) + np.sin(angle) * k + 2 * np.sin(angle / 2) ** 2 * (k @ k)


def about_x(angle):
    return about([1, 0, 0], angle)


def about_y(angle):
    return about([0, 1, 0], angle)


def about_z(angle):
    return about([0, 0, 1], angle)


def euler_zyz(phi, theta, psi):
    """Rz(phi) Ry(theta) Rz(psi)."""
    return about_z(phi) @ about_y(theta) @ about_z(psi)


def from_quaternion(q):
    """The matrix of a unit quaternion (w, x, y, z); shape (..., 4) gives (..., 3, 3)."""
    q = np.asarray(q, dtype=float)
    w, k = q[..., 0][..., None, None], cross_matrix(q[..., 1:])
    return np.eye(3) + 2 * w * k + 2 * (k @ k)


def quaternion(r):
    """The unit quaternion (w, x, y, z) of one matrix, its largest component positive."""
    r = np.asarray(r, dtype=float)
    trace = np.trace(r)
    squares = np.array([1 + trace, *(1 - trace + 2 * np.diag(r))])  # 4 w^2, 4 x^2, 4 y^2, 4 z^2
    w = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]  # 4 w x, 4 w y, 4 w z
    s = r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1]  # 4 x y, 4 x z, 4 y z
    rows = [[squares[0], *w], [w[0], squares[1], s[0], s[1]]]
    rows += [[w[1], s[0], squares[2], s[2]], [w[2], s[1], s[2], squares[3]]]
    row = np.array(rows[int(np.argmax(squares))])
    return row / np.linalg.norm(row)


def angle_between(a, b):
    """The angle of the rotation from a to b, exact where it is small; shapes (..., 3, 3)."""
    relative = np.swapaxes(np.asarray(a), -1, -2) @ np.asarray(b)
    skew = relative - np.swapaxes(relative, -1, -2)
    sine = np.sqrt(skew[..., 2, 1] ** 2 + skew[..., 0, 2] ** 2 + skew[..., 1, 0] ** 2) / 2
    return np.arctan2(sine, (np.trace(relative, axis1=-2, axis2=-1) - 1) / 2)
