#!/usr/bin/python3
"""Writes the scenes of `nbdtree-bench contact`, with the meshes that they need, into a folder.

    python3 assets/contact_scenes.py FOLDER MODELS

MODELS: a folder with octopus.obj and armadillo.obj, whose longest sides are about 1; scenes of models that it does not have
are left out. Fast thin parts, twists, folds, tight spaces.
"""

import json
import math
import pathlib
import sys

ASSETS = pathlib.Path(__file__).resolve().parent


def write_obj(path, points, faces):
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in points]
    lines += ["f {} {} {}".format(*(i + 1 for i in f)) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def read_points(path):
    return [tuple(map(float, line.split()[1:4])) for line in path.read_text().splitlines() if line.startswith("v ")]


def box(size, cells):
    """The surface of a box around the origin."""
    numbers, points, faces = {}, [], []

    def vertex(cell):
        if cell not in numbers:
            numbers[cell] = len(points)
            points.append([size[k] * (cell[k] / cells[k] - 0.5) for k in range(3)])
        return numbers[cell]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for i in range(cells[u]):
                for j in range(cells[v]):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        cell = [0, 0, 0]
                        cell[axis], cell[u], cell[v] = side, i + di, j + dj
                        corners.append(vertex(tuple(cell)))
                    if side == 0:
                        corners.reverse()
                    faces += [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
    return points, faces


def ball(radius, rings, sides):
    points = [[0, 0, radius]]
    for i in range(1, rings):
        for j in range(sides):
            t, p = math.pi * i / rings, 2 * math.pi * (j + 0.5 * (i % 2)) / sides
            points.append([radius * math.sin(t) * math.cos(p), radius * math.sin(t) * math.sin(p), radius * math.cos(t)])
    points.append([0, 0, -radius])
    return points, rows_of_faces(rings - 1, sides, 0, len(points) - 1)


def rows_of_faces(rows, sides, top, bottom):
    """Faces between rows of vertices that begin at number 1, closed by a vertex above and one below."""
    at = lambda i, j: 1 + i * sides + j % sides
    faces = [[top, at(0, j), at(0, j + 1)] for j in range(sides)]
    for i in range(rows - 1):
        for j in range(sides):
            shift = i % 2  # ball() turns every second row by half a side
            a, b, c, d = at(i, j), at(i, j + 1), at(i + 1, j + 0), at(i + 1, j + 1)
            faces += [[a, c, b], [b, c, d]] if shift else [[a, c, d], [a, d, b]]
    faces += [[at(rows - 1, j), bottom, at(rows - 1, j + 1)] for j in range(sides)]
    return faces


def spike(height, radius, sides):
    points = [[0, 0, height]] + [
        [radius * math.cos(2 * math.pi * j / sides), radius * math.sin(2 * math.pi * j / sides), 0] for j in range(sides)
    ]
    points.append([0, 0, 0])
    return points, rows_of_faces(1, sides, 0, len(points) - 1)


def cylinder(radius, half, sides, axis):
    points = [[0, 0, half]]
    for z in (half, -half):
        points += [
            [radius * math.cos(2 * math.pi * j / sides), radius * math.sin(2 * math.pi * j / sides), z] for j in range(sides)
        ]
    points.append([0, 0, -half])
    shifted = [[p[(k - axis + 2) % 3] for k in range(3)] for p in points]  # z becomes the axis
    return shifted, rows_of_faces(2, sides, 0, len(points) - 1)


def torus(radius, thickness, around, across):
    points, faces = [], []
    for i in range(around):
        for j in range(across):
            t, p = 2 * math.pi * i / around, 2 * math.pi * j / across
            r = radius + thickness * math.cos(p)
            points.append([r * math.cos(t), r * math.sin(t), thickness * math.sin(p)])
            a, b = i * across + j, (i + 1) % around * across + j
            c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
            faces += [[a, b, c], [a, c, d]]
    return points, faces


def scene(bodies, obstacles=(), gravity=(0, 0, 0), dt=2e-3, steps=40, **contact):
    return {
        # Damping by mass would hide what contact does to momentum.
        "bodies": [body | {"material": {"rayleigh_mass": 0} | body.get("material", {})} for body in bodies],
        "obstacles": list(obstacles),
        "gravity": list(gravity),
        "contact": contact,
        "time": {"dt": dt, "frames": steps, "steps_per_frame": 1},
    }


def turned(axis, degrees, translate=(0, 0, 0), scale=1):
    return {"scale": scale, "rotate": {"axis": axis, "degrees": degrees}, "translate": list(translate)}


def grip(place, radius, **motion):
    return {"region": {"sphere": {"centre": list(place), "radius": radius}}, **motion}


def slab(axis, low, high, **motion):
    least, most = [-9, -9, -9], [9, 9, 9]
    least[axis], most[axis] = low, high
    return {"region": {"box": {"min": least, "max": most}}, **motion}


def plane(normal, point, speed=0.0, stop=None):
    result = {"plane": {"normal": normal, "point": list(point)}, "velocity": [speed * n for n in normal], "friction": 0.3}
    if stop is not None:
        result["stop"] = stop
    return result


def arm_tips(points):
    """The farthest vertex from the y axis in each of eight sectors, without those near another."""
    tips = []
    for p in sorted(points, key=lambda p: -math.hypot(p[0], p[2])):
        if all(math.dist(p, q) > 0.25 for q in tips) and len(tips) < 8:
            tips.append(p)
    return tips


def scenes(folder, models):
    meshes = {
        "sheet": box([1, 1, 0.05], [20, 20, 1]),
        "shot": box([0.2, 0.2, 0.025], [8, 8, 1]),
        "ball": ball(0.1, 8, 12),
        "spike": spike(0.6, 0.12, 24),
        "hoop": torus(0.2, 0.02, 48, 8),
    }
    for name, (points, faces) in meshes.items():
        write_obj(folder / f"{name}.obj", points, faces)
    result = {}
    octopus, armadillo = models / "octopus.obj", models / "armadillo.obj"
    if octopus.exists():
        name, points = str(octopus.resolve()), read_points(octopus)
        result["octopuses"] = scene(
            [
                {"surface": name, "name": "left", "velocity": [8, 0, 0]},
                {"surface": name, "name": "right", "velocity": [-8, 0, 0], "transform": turned([0, 0, 1], 180, [1.02, 0, 0])},
            ],
            steps=40,
        )
        low = min(p[1] for p in points)
        curl = []
        for p in arm_tips(points):
            r = math.hypot(p[0], p[2])
            target = [0.1 * p[0] / r, low - 0.15, 0.1 * p[2] / r]
            curl.append(grip(p, 0.035, translate=[t - x for t, x in zip(target, p)], duration=0.4))
        result["octopus_curls"] = scene([{"surface": name, "name": "octopus", "grips": curl}], dt=1e-2, steps=50)
        high = max(p[1] for p in points)
        speed = 0.42 * (high - low) / 0.4
        result["octopus_squashed"] = scene(
            [{"surface": name, "name": "octopus"}],
            [plane([0, 1, 0], [0, low - 0.002, 0], speed, 0.4), plane([0, -1, 0], [0, high + 0.002, 0], speed, 0.4)],
            dt=1e-2,
            steps=45,
        )
    if armadillo.exists():
        name = str(armadillo.resolve())
        result["armadillos_pressed"] = scene(
            [
                {"surface": name, "name": "left", "transform": turned([0, 1, 0], 90, [-0.36, 0, 0])},
                {"surface": name, "name": "right", "transform": turned([0, 1, 0], -90, [0.36, 0, 0])},
            ],
            [plane([1, 0, 0], [-0.78, 0, 0], 1, 0.25), plane([-1, 0, 0], [0.78, 0, 0], 1, 0.25)],
            dt=5e-3,
            steps=50,
        )
    edges = [slab(axis, low, high) for axis, low, high in ((0, -9, -0.47), (0, 0.47, 9))]
    for speed in (30, 100, 300):
        result[f"sheet_{speed}"] = scene(
            [
                {"surface": "sheet.obj", "name": "sheet", "pins": [{"box": e["region"]["box"]} for e in edges]},
                {
                    "surface": "shot.obj",
                    "name": "shot",
                    "velocity": [0, 0, -speed],
                    "transform": turned([1, 0.3, 0], 20, [0.03, 0.02, 0.25]),
                },
            ],
            steps=20,
            thickness=2e-3,  # a shot needs a way to stop
        )
    turn = {"centre": [0, 0, 0], "duration": 1.0}
    beam = str(ASSETS / "beam.obj")
    ends = read_points(ASSETS / "beam.obj")
    axis = max(range(3), key=lambda k: max(p[k] for p in ends) - min(p[k] for p in ends))
    half = max(p[axis] for p in ends)
    about = lambda angle: [angle if k == axis else 0 for k in range(3)]
    result["beam_twisted"] = scene(
        [
            {
                "surface": beam,
                "name": "beam",
                "material": {"law": "stable_neo_hookean"},
                "grips": [
                    slab(axis, -9, -0.9 * half, rotate={"axis": about(1), "degrees": 720}, **turn),
                    slab(axis, 0.9 * half, 9, rotate={"axis": about(-1), "degrees": 720}, **turn),
                ],
            }
        ],
        dt=1e-2,
        steps=100,
    )
    result["rings_pulled"] = scene(
        [
            {"surface": "hoop.obj", "name": "left", "grips": [grip([-0.2, 0, 0], 0.05, translate=[-0.25, 0, 0], duration=0.3)]},
            {
                "surface": "hoop.obj",
                "name": "right",
                "transform": turned([1, 0, 0], 90, [0.2, 0, 0]),
                "grips": [grip([0.4, 0, 0], 0.05, translate=[0.25, 0, 0], duration=0.3)],
            },
        ],
        dt=5e-3,
        steps=70,
    )
    balls = [
        {
            "surface": "ball.obj",
            "name": f"ball {i}",
            "transform": turned([1, 0, 0], 30 * i, [0.22 * (i % 2) - 0.11, 0.22 * (i // 2 % 2) - 0.11, 0.22 * (i // 4) - 0.3]),
        }
        for i in range(10)
    ]
    sides = [plane([n * (k == a) for k in range(3)], [-0.45 * n * (k == a) for k in range(3)], 0.5, 0.48)
             for a in range(3) for n in (1, -1)]
    result["balls_in_a_box"] = scene(balls, sides, dt=5e-3, steps=110)
    gear = str(ASSETS / "gear.obj")
    teeth = read_points(ASSETS / "gear.obj")
    flat = min(range(3), key=lambda k: max(p[k] for p in teeth) - min(p[k] for p in teeth))
    other = (flat + 1) % 3
    outer = max(math.hypot(p[other], p[(flat + 2) % 3]) for p in teeth)
    bore = min(math.hypot(p[other], p[(flat + 2) % 3]) for p in teeth)
    write_obj(folder / "axle.obj", *cylinder(0.9 * bore, 0.3, 24, flat))
    offset = [1.86 * outer if k == other else 0 for k in range(3)]
    spin = [1 if k == flat else 0 for k in range(3)]
    hub = {"centre": [0, 0, 0], "rotate": {"axis": spin, "degrees": 120}, "duration": 0.5}
    result["gears"] = scene(
        [
            {"surface": gear, "name": "driver", "grips": [grip([0, 0, 0], 1.35 * bore, **hub)]},
            {"surface": gear, "name": "driven", "transform": turned(spin, 15, offset)},
        ],
        [{"mesh": {"file": "axle.obj", "transform": {"translate": offset}}, "friction": 0}],
        dt=5e-3,
        steps=100,
    )
    result["hoop_on_spike"] = scene(
        [{"surface": "hoop.obj", "name": "hoop", "transform": turned([1, 0, 0], 12, [0.05, 0, 0.75], 0.5)}],
        [{"mesh": {"file": "spike.obj"}, "friction": 0.3}, plane([0, 0, 1], [0, 0, -0.001])],
        gravity=[0, 0, -9.81],
        dt=5e-3,
        steps=120,
    )
    return result


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: contact_scenes.py FOLDER MODELS")
    folder, models = map(pathlib.Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in scenes(folder, models).items():
        (folder / f"{name}.json").write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main()
