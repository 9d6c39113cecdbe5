"""Large scenes made of many equal parts."""

from __future__ import annotations

from atwood import Scene
from atwood_library import Ground, PointMass, Rod, Spring


def spring_net(rows: int, columns: int) -> Scene:
    """Return masses in a net of springs, hung up at its upper edge and stretched a little."""
    scene = Scene(t_end=0.2)
    gap = 1.0 / columns
    masses = {
        (i, j): scene.add(f"m{i}_{j}", PointMass(mass=1.0 / columns)) for i in range(rows) for j in range(columns)
    }
    for j in range(columns):
        ground = scene.add(f"g{j}", Ground(position=(j * gap, 0.0, 0.0)))
        spring = scene.add(f"s{j}", Spring(stiffness=200.0, natural_length=gap))
        scene.connect(ground.frame, spring.a)
        scene.connect(spring.b, masses[0, j].point)
    for (i, j), mass in masses.items():
        for name, other in (("right", (i, j + 1)), ("down", (i + 1, j))):
            if other in masses:
                spring = scene.add(f"{name}{i}_{j}", Spring(stiffness=200.0, natural_length=gap))
                scene.connect(mass.point, spring.a)
                scene.connect(spring.b, masses[other].point)
        for axis, value in (("x", j * gap), ("z", -(i + 1) * 1.05 * gap)):
            scene.start[f"m{i}_{j}.position.{axis}"] = value
            scene.start[f"m{i}_{j}.velocity.{axis}"] = 0.0
    return scene


def rod_ladder(steps: int) -> Scene:
    """Return a ladder of rods that hangs from one of its ends: a chain of four-bars."""
    scene = Scene(t_end=0.2)
    left, right = (scene.add(f"g{side}", Ground(position=(float(side), 0.0, 0.0))).frame for side in range(2))
    for k in range(steps):
        ends = []
        for side, above in enumerate((left, right)):
            rod = scene.add(f"rod{side}_{k}", Rod(length=1.0))
            mass = scene.add(f"m{side}_{k}", PointMass(mass=1.0 + side))
            scene.connect(above, rod.a)
            scene.connect(rod.b, mass.point)
            scene.guess[f"m{side}_{k}.position.x"] = side + 0.3
            scene.guess[f"m{side}_{k}.position.z"] = -(k + 1.0)
            ends.append(mass.point)
        left, right = ends
        step = scene.add(f"step{k}", Rod(length=1.0))
        scene.connect(left, step.a)
        scene.connect(step.b, right)
    return scene
