#!/usr/bin/env python3
"""Compares linear and quadratic tetrahedra in motion: error against the time of a step.

    apps/results/elements_live.py [--repeats 3] [-o FILE.csv] [--picture FILE.png]

A beam held at one end swings down by its weight; and it swings down on a ball in its way, over which it bends. The bodies share their
collision surface; their tetrahedra have edges of several lengths, and are of both kinds. The error is that of the surface's
vertices at the end, root of mean squares, over the way of the reference's: quadratic tetrahedra with edges of 2 cm.
Milliseconds are of the processor on one thread, medians over steps, of which the least of the repeats is taken.
"""
import argparse
import csv
import os
import statistics
import time
from pathlib import Path

import numpy as np

import nbdtree as nbd

ASSETS = Path(__file__).parents[2] / "assets"
EDGES = {"linear": [0.12, 0.05, 0.025, 0.015, 0.01], "quadratic": [0.12, 0.08, 0.05, 0.035, 0.025]}
REFERENCE = 0.02  # quadratic
COLUMNS = ["scene", "elements", "edge_m", "nodes", "tets", "error", "ms", "least_ms", "reference"]


def scene_of(name, body):
    low = body.surface_X.min(axis=0)
    scene = {"bodies": [{"body": body, "material": {"young": 2e5, "poisson": 0.45},
                         "pins": [{"box": {"min": [-9, -9, -9], "max": [low[0] + 1e-6, 9, 9]}}]}], "time": {"dt": 0.004}}
    if name == "draped":
        scene["obstacles"] = [{"sphere": {"centre": [low[0] + 0.5, 0, low[2] - 0.12], "radius": 0.1}, "friction": 0.3}]
    return scene


def run(name, body, steps):
    world = nbd.World(scene_of(name, body))
    start, times = world.surface_positions(0), []
    for _ in range(steps):
        begun = time.process_time()
        world.step()
        times.append(1e3 * (time.process_time() - begun))
    return start, world.surface_positions(0), statistics.median(times)


def rows_of(name, steps, repeats):
    bodies = [(kind, edge) for kind, edges in EDGES.items() for edge in edges] + [("quadratic", REFERENCE)]
    found = []
    for kind, edge in bodies:
        body = nbd.mesh_file(ASSETS / "beam.obj", edge=edge, elements=kind)
        ran = [run(name, body, steps) for _ in range(repeats if edge != REFERENCE else 1)]
        found.append((kind, edge, body, ran[0][0], ran[0][1], [ms for _, _, ms in ran]))
    _, _, _, start, truth, _ = found[-1]
    way = np.sqrt(np.mean((truth - start) ** 2))
    return [{"scene": name, "elements": kind, "edge_m": edge, "nodes": len(body.X), "tets": len(body.T),
             "error": f"{np.sqrt(np.mean((end - truth) ** 2)) / way:.4g}", "ms": f"{statistics.median(ms):.4g}",
             "least_ms": f"{min(ms):.4g}", "reference": int(edge == REFERENCE)} for kind, edge, body, _, end, ms in found]


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, name in zip(axes, ("swing", "draped")):
        for kind, mark in (("linear", "o-"), ("quadratic", "s-")):
            chosen = [r for r in rows if r["scene"] == name and r["elements"] == kind and not int(r["reference"])]
            axis.loglog([float(r["least_ms"]) for r in chosen], [100 * float(r["error"]) for r in chosen], mark, label=kind)
        axis.set_title({"swing": "a beam swings down", "draped": "it bends over a ball"}[name])
        axis.set_xlabel("ms a step, one thread")
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("error in displacement, %")
    axes[0].legend(title="tetrahedra")
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path, help="table to write (CSV)")
    parser.add_argument("--picture", type=Path, help="chart to write (PNG)")
    arguments = parser.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rows = [row for name, steps in (("swing", 75), ("draped", 100)) for row in rows_of(name, steps, arguments.repeats)]
    for row in rows:
        print(", ".join(f"{key} {value}" for key, value in row.items()))
    if arguments.output:
        with open(arguments.output, "w", newline="") as file:
            table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
    if arguments.picture:
        draw(rows, arguments.picture)


if __name__ == "__main__":
    main()
