"""Draws grasps from a scene with variables, looks at one, and makes a dataset of a finger's motions from them.

    python3 7_template.py [grasps.h5]
"""

import pathlib
import sys

import numpy as np

import nbdtree as nbd

SCENE = pathlib.Path(__file__).resolve().parents[3] / "assets" / "scenes" / "templates" / "grasp.json"
dataset = sys.argv[1] if len(sys.argv) > 1 else "grasps.h5"

# What the first trajectories are made of. The same seed gives the same scenes, here and in the dataset.
for trajectory in range(3):
    scene = nbd.draw_scene(SCENE, trajectory, seed=7)
    egg = scene["bodies"][0]
    size, young = egg["transform"]["scale"], egg["material"]["young"]
    print(f"grasp {trajectory}: an egg of {100 * 0.746 * size:.1f} cm, {young / 1e3:.0f} kPa")

# One of them with a value of our own.
soft = nbd.draw_scene(SCENE, 0, seed=7, values={"young": 1e5})
world = nbd.World(soft, folder=SCENE.parent)
for _ in range(40):
    report = world.step()
    if report.failure:
        sys.exit(report.failure)
print(f"after {world.time:.2f} s the soft egg is pressed with {np.abs(world.contact_forces(0)[:, 0]).sum() / 2:.2f} N")

nbd.make_scene_dataset(SCENE, dataset, record="left", trajectories=2, frames=12, seed=7)
reader = nbd.RecordingReader(dataset)
print(f"{dataset}: {reader.frames} frames of the left finger in {len(reader.trajectories)} trajectories")
