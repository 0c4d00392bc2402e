"""Collides two meshes that turn against each other, without a simulator: trees from arrays, queries per pose.

    python3 2_collide_two_meshes.py
"""

import pathlib

import numpy as np
import numpy.typing as npt

import nbdtree as nbd

assets = pathlib.Path(__file__).resolve().parents[3] / "assets"

gear = nbd.read_surface(assets / "gear.obj")
width = float(np.ptp(gear.X[:, 0]))

# One tree for all copies of a mesh; a PosedTree for each copy; one query, which keeps its scratch memory.
tree = nbd.make_exact_tree(gear.X, gear.F)
a, b = nbd.PosedTree(tree, "boxes"), nbd.PosedTree(tree, "boxes")
pairs, distances = nbd.PairQuery(), nbd.ClosestQuery()


def turned(angle: float, shift: float) -> npt.NDArray[np.float32]:
    """The gear turned about its axis and moved along x: float32 and contiguous, as poses need it."""
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return np.ascontiguousarray(gear.X @ rotation.T + [shift, 0, 0], np.float32)


touching = 0
for step in range(60):
    xa, xb = turned(0.02 * step, 0), turned(-0.02 * step, 0.985 * width)
    a.begin_pose(xa)  # refers to the array: keep it unchanged until the next pose
    b.begin_pose(xb)
    found = pairs.intersecting(a, b)  # rows (face of a, face of b)
    touching += len(found) > 0
    if step % 20 == 0:
        near = pairs.within(a, b, 0.02 * width)
        closest = distances.closest(a, b)
        assert closest is not None
        print(
            f"pose {step}: {len(found)} face pairs intersect, {len(near)} are within 2 % of the width, "
            f"distance {closest['distance']:.4f} m at {np.round(closest['a'], 3)}"
        )
print(f"the gears touch in {touching} of 60 poses")

# The same answer without a tree, for a single question about two meshes.
once = nbd.intersecting_faces(xa, gear.F, xb, gear.F)
assert np.array_equal(once, pairs.intersecting(a, b))
