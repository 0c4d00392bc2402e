"""Drops two beams on the floor, one across the other, and plots where their energy goes.

    python3 1_drop_two_bodies.py [energy.png]
"""

import pathlib
import sys

import matplotlib  # type: ignore[import]
import numpy as np

import nbdtree as nbd

matplotlib.use("Agg")  # no display is needed
import matplotlib.pyplot as plt  # type: ignore[import]

assets = pathlib.Path(__file__).resolve().parents[3] / "assets"
picture = sys.argv[1] if len(sys.argv) > 1 else "energy.png"

# A surface becomes a body: it is checked, filled with tetrahedra, and keeps its triangles for contact.
beam = nbd.mesh_file(assets / "beam.obj")
print(beam)

# The keys are those of scene files; bodies may be objects instead of files.
world = nbd.World(
    {
        "bodies": [
            {"body": beam, "name": "lower", "transform": {"translate": [0, 0, 0.3]}},
            {
                "body": beam,
                "name": "upper",
                "transform": {"translate": [0, 0, 0.8], "rotate": {"axis": [0, 0, 1], "degrees": 70}},
            },
        ],
        "obstacles": [{"plane": {"normal": [0, 0, 1]}, "friction": 0.5}],
        "time": {"dt": 0.005},
    }
)

rows = []
for _ in range(200):
    report = world.step()
    if report.failure:
        sys.exit(report.failure)
    rows.append((report.time, report.kinetic_energy, report.elastic_energy, report.gravity_energy, report.contacts))
time, kinetic, elastic, gravity, contacts = np.array(rows).T
total = kinetic + elastic + gravity
print(f"{len(rows)} steps, at most {int(contacts.max())} contacts at a time")
print(f"energy at the start {total[0]:.2f} J, at the end {total[-1]:.2f} J")

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for values, label in ((gravity, "gravity"), (kinetic, "kinetic"), (elastic, "elastic"), (total, "total")):
    axes.plot(time, values, label=label)
axes.set(xlabel="time, s", ylabel="energy, J")
axes.legend()
figure.savefig(picture, dpi=120)
print(f"plotted in {picture}")
