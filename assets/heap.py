#!/usr/bin/env python3
"""Writes hopper.obj, a funnel that is open above and below, and the scene heap.json: a hundred rigid and soft bodies that
pour through it onto uneven ground."""

import argparse
import json
import math
import pathlib
import random

SIDES, RINGS = 36, 8  # of the funnel; its faces are about as large as the bodies, as a search likes them
RADII = [(0.45, 1.05), (0.45, 0.8), (0.17, 0.4)]  # of the funnel, and how high they are
CELLS, SPACING = 24, 0.1  # of the ground
SHAPES = [  # name, file, size
    ("egg", {"surface": "../egg.obj"}, 0.07),
    ("block", {"tets": "../block.mesh"}, 0.05),
    ("bar", {"surface": "../finger.obj"}, 0.09),
]


def hopper():
    (top, high), (edge, middle), (opening, low) = RADII
    rings = [(top, high + (middle - high) * k / 3) for k in range(3)]
    rings += [(edge + (opening - edge) * k / RINGS, middle + (low - middle) * k / RINGS) for k in range(RINGS + 1)]
    lines = ["# made by heap.py, CC0"]
    for radius, z in rings:
        for k in range(SIDES):
            angle = 2 * math.pi * k / SIDES
            lines.append(f"v {radius * math.cos(angle):.6f} {radius * math.sin(angle):.6f} {z:.6g}")
    for ring in range(len(rings) - 1):
        for k in range(SIDES):
            a, b = 1 + ring * SIDES + k, 1 + ring * SIDES + (k + 1) % SIDES
            lines += [f"f {a} {a + SIDES} {b + SIDES}", f"f {a} {b + SIDES} {b}"]
    return "\n".join(lines) + "\n"


def ground(x, y):
    """A bowl with waves."""
    return 0.12 * (x * x + y * y) + 0.02 * math.sin(5 * x) * math.cos(4 * y)


def bodies(count, draw):
    """Bodies turned at random, in layers of 21 on a lattice."""
    places = [(0.13 * i, 0.13 * j) for i in range(-2, 3) for j in range(-2, 3) if abs(i) + abs(j) < 4]
    for n in range(count):
        shape, source, size = SHAPES[n % len(SHAPES)]
        rigid = n // len(SHAPES) % 2 == 0
        meshing = {"scale": size, "subdivide": 1}
        if rigid:
            meshing["elements"] = "rigid"
        x, y = places[n % len(places)]
        yield {
            **source,
            "name": f"{shape}{n}",
            "meshing": meshing,
            "material": {"density": 1000} if rigid else {"young": 2e5, "density": 1000},
            "transform": {
                "rotate": {"axis": [round(draw.uniform(-1, 1), 2) for _ in range(3)], "degrees": draw.randrange(360)},
                "translate": [round(x, 3), round(y, 3), round(0.86 + 0.12 * (n // len(places)), 3)],
            },
        }


def scene(count):
    half = CELLS * SPACING / 2
    table = [[round(ground(SPACING * i - half, SPACING * j - half), 4) for i in range(CELLS + 1)] for j in range(CELLS + 1)]
    obstacles = [
        {"name": "ground", "heights": {"spacing": SPACING, "table": table, "transform": {"translate": [-half, -half, 0]}},
         "friction": 0.6},
        {"name": "hopper", "mesh": {"file": "../hopper.obj"}, "friction": 0.2},
    ]
    listed = lambda things: "[\n" + ",\n".join("        " + json.dumps(thing) for thing in things) + "\n    ]"
    return "\n".join([
        "{",
        '    "$schema": "schema/scene.schema.json",',
        f'    "bodies": {listed(bodies(count, random.Random(1)))},',
        f'    "obstacles": {listed(obstacles)},',
        '    "contact": {"friction": 0.5, "thickness": 0.001},',
        '    "time": {"dt": 0.005, "steps_per_frame": 10, "frames": 40}',
        "}",
    ]) + "\n"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--bodies", metavar="N", type=int, default=100, help="how many bodies; default: 100")
    arguments.add_argument("folder", metavar="FOLDER", type=pathlib.Path,
                           help="where hopper.obj is written, and scenes/heap.json in it")
    given = arguments.parse_args()
    (given.folder / "hopper.obj").write_text(hopper())
    (given.folder / "scenes" / "heap.json").write_text(scene(given.bodies))
