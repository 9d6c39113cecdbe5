"""Closed triangle meshes of simple bodies, as loose triangles (m, 3, 3) that face outward."""

from itertools import pairwise

import numpy as np


def box_mesh(a, b, c):
    """A box of edges a, b, c around the origin."""
    x = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) - 0.5
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    corners = [[x[q[0]], x[q[1]], x[q[2]]] for q in quads] + [[x[q[0]], x[q[2]], x[q[3]]] for q in quads]
    return np.array(corners) * [a, b, c]


def revolved_mesh(profile, sides):
    """The body swept by a profile (radius, height) that starts and ends on the axis and goes round it upwards."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rings = [
        np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(sides, h)]) if r > 0 else np.array([[0, 0, h]])
        for r, h in profile
    ]
    triangles = []
    for below, above in pairwise(rings):
        for i in range(sides):
            j = (i + 1) % sides
            if len(below) > 1:
                triangles.append([below[i], below[j], above[i % len(above)]])
            if len(above) > 1:
                triangles.append([below[j % len(below)], above[j], above[i]])
    return np.array(triangles)


def cylinder_mesh(radius, length, sides):
    return revolved_mesh([(0, -length / 2), (radius, -length / 2), (radius, length / 2), (0, length / 2)], sides)


def cone_mesh(radius, height, sides):
    return revolved_mesh([(0, 0), (radius, 0), (0, height)], sides)


def ellipsoid_mesh(a, b, c, sides):
    latitudes = np.pi * (np.arange(sides // 2 + 1) / (sides // 2) - 0.5)
    profile = [(float(np.cos(s)), float(np.sin(s))) for s in latitudes]
    profile[0], profile[-1] = (0.0, -1.0), (0.0, 1.0)
    return revolved_mesh(profile, sides) * [a, b, c]


def tube_mesh(outer, inner, length, sides):
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angles), np.sin(angles)])

    def at(radius, height):
        return np.column_stack([radius * ring, np.full(sides, height)])

    loop = [at(outer, -length / 2), at(outer, length / 2), at(inner, length / 2), at(inner, -length / 2)]
    triangles = []
    for below, above in zip(loop, [*loop[1:], loop[0]], strict=True):
        for i in range(sides):
            j = (i + 1) % sides
            triangles += [[below[i], below[j], above[j]], [below[i], above[j], above[i]]]
    return np.array(triangles)


def write_ascii(path, soup, name="body"):
    lines = [f"solid {name}"]
    for triangle in soup:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += [f"      vertex {x:.17g} {y:.17g} {z:.17g}" for x, y, z in triangle]
        lines += ["    endloop", "  endfacet"]
    path.write_text("\n".join([*lines, f"endsolid {name}", ""]))


def write_binary(path, soup, header=b"", tail=b""):
    records = np.zeros(len(soup), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    records["c"] = soup
    path.write_bytes(header.ljust(80, b"\0") + len(soup).to_bytes(4, "little") + records.tobytes() + tail)
