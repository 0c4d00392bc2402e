"""Bends a pneumatic finger: tells the pressure in its chambers step by step, and measures how far it bends and how hard it presses.

    python3 6_finger.py
"""

import pathlib
import sys

import numpy as np

import nbdtree as nbd

SCENE = pathlib.Path(__file__).resolve().parents[3] / "assets" / "scenes" / "finger.json"
world = nbd.World(SCENE)
x = world.positions(0)  # a view: it shows every step
rest = x.copy()
root = np.flatnonzero(rest[:, 2] > rest[:, 2].max() - 0.005)
tip = np.flatnonzero(rest[:, 2] < rest[:, 2].min() + 0.005)
chambers = 4  # of the scene, whose loads have a pressure of 60 kPa times what is told


def angle() -> float:
    """Degrees by which the line from the root to the tip has turned."""
    way, before = (y[tip].mean(axis=0) - y[root].mean(axis=0) for y in (x, rest))
    return float(np.degrees(np.arctan2(-way[0], -way[2]) - np.arctan2(-before[0], -before[2])))


def push() -> float:
    """Force on the ball, newtons."""
    return sum(float(np.linalg.norm(r.force)) for r in world.reactions() if r.kind == "obstacle")


print("kPa, degrees, newtons")
angles: list[tuple[int, float, float]] = []
for kilopascals in (0, 20, 40, 60):
    before = angles[-1][0] if angles else 0
    for step in range(15):
        share = min((step + 1) / 10, 1)  # goes there in ten steps, then waits
        for chamber in range(chambers):
            world.set_load(chamber, (before + share * (kilopascals - before)) / 60)
        report = world.step()
        if report.failure:
            sys.exit(report.failure)
    angles.append((kilopascals, angle(), push()))
    print("{:.0f}, {:.2f}, {:.3f}".format(*angles[-1]))
if not all(a[1] < b[1] for a, b in zip(angles, angles[1:])):
    sys.exit("the finger did not bend farther with more pressure")
