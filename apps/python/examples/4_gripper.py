"""Controls a gripper: two soft fingers close on a block until they hold it, lift it, and let it go.

    python3 4_gripper.py [gripper.h5]
"""

import pathlib
import sys

import numpy as np

import nbdtree as nbd

recording = sys.argv[1] if len(sys.argv) > 1 else "gripper.h5"


def box(name: str, size: tuple[float, float, float], cells: tuple[int, int, int], young: float) -> nbd.Body:
    """A box about the origin, each of whose cells is cut into six tetrahedra."""
    count = np.array(cells) + 1
    corners = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), -1).reshape(-1, 3)
    X = (corners / np.array(cells) - 0.5) * size
    first = corners[np.all(corners < np.array(cells), axis=1)]
    # From one corner of a cell to the opposite one, along the axes in each order.
    T = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        path = [first]
        for axis in order:
            path.append(path[-1] + np.eye(3, dtype=int)[axis])
        tets = np.stack([np.ravel_multi_index(tuple(p.T), tuple(count)) for p in path], 1)
        even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        T.append(tets if even else tets[:, [0, 2, 1, 3]])
    return nbd.make_body(name, nbd.TetMesh(X, np.vstack(T)), material=nbd.Material(young=young, density=500))


block = box("block", (0.1, 0.1, 0.1), (5, 5, 5), 2e5)
finger = box("finger", (0.03, 0.08, 0.2), (2, 4, 8), 1e6)
world = nbd.World(
    {
        "bodies": [
            {"body": block, "name": "block", "transform": {"translate": [0, 0, 0.051]}},
            {"body": finger, "name": "left", "transform": {"translate": [-0.09, 0, 0.13]}},
            {"body": finger, "name": "right", "transform": {"translate": [0.09, 0, 0.13]}},
        ],
        "obstacles": [{"plane": {"normal": [0, 0, 1]}, "friction": 0.5}],
        "contact": {"friction": 0.9},
        "time": {"dt": 0.005},
    }
)

# The gripper holds the upper ends of the fingers.
fingers = (1, 2)
inward = {1: np.array([1.0, 0, 0]), 2: np.array([-1.0, 0, 0])}
held = {f: np.flatnonzero(world.positions(f)[:, 2] > world.positions(f)[:, 2].max() - 1e-6) for f in fingers}
start = {f: world.positions(f)[held[f]].copy() for f in fingers}
block_z = world.positions(0)[:, 2]  # a view: it shows every step


def squeeze() -> float:
    """Force with which the fingers press on the block, newtons: the smaller one of both."""
    return float(min(-inward[f] @ world.contact_forces(f).sum(axis=0) for f in fingers))


closed = lifted = 0.0  # metres that the gripper has gone inward and up
state, wanted = "close", 8.0  # newtons
highest = 0.0
with nbd.recording(world, recording) as record:
    for _ in range(800):
        if state == "close":
            closed += 0.0002
            if squeeze() > wanted:
                state = "lift"
                print(f"{world.time:.2f} s: holds the block with {squeeze():.1f} N, {1e3 * closed:.0f} mm inward")
        elif state == "lift":
            lifted += 0.0005
            closed += np.clip(2e-5 * (wanted - squeeze()), -1e-4, 1e-4)  # keeps the force
            if lifted > 0.2:
                state = "open"
                print(f"{world.time:.2f} s: the block is {100 * block_z.min():.1f} cm above the floor")
                highest = float(block_z.min())
        elif closed > 0:
            closed -= 0.001
        for f in fingers:
            world.drive(held[f], start[f] + closed * inward[f] + [0, 0, lifted], body=f)
        report = world.step()
        if report.failure:
            sys.exit(report.failure)
        record.add_frame()
print(f"{world.time:.2f} s: let go, the block lies {1e3 * block_z.min():.1f} mm above the floor")
if not (highest > 0.15 and block_z.min() < 0.01):
    sys.exit("the gripper did not lift the block and put it down")
print(f"recorded in {recording}")
