#!/usr/bin/env python3
"""Measures what a thin sheet costs and how wrong it bends when it is made of solid tetrahedra.

    apps/results/sheets.py build/release/apps/nbdtree [-o FILE.csv]

strip: 100 x 20 x 1 mm, held at one end, bends by its weight: its sag over that of a beam, by the edges of its cells and the number of
layers. Poisson's ratio is 0, so that it is a beam; its sag is a hundredth of its length. cloth: 300 x 300 x 1 mm of 1 MPa falls on a ball
of 100 mm for 0.1 s in steps of 5 ms. Milliseconds are of the processor, on one thread, without what the start takes.
"""
import argparse
import csv
import itertools
import json
import resource
import subprocess
import tempfile
from pathlib import Path

STRIP = (0.1, 0.02, 0.001)
CLOTH = (0.3, 0.3, 0.001)
COLUMNS = ["case", "elements", "edge_mm", "layers", "nodes", "tets", "unknowns", "unknowns_of_a_shell", "sag_over_beam", "linearisations",
           "iterations", "ms", "steps"]


def write_sheet(path, size, cells):
    """A box of cells of six tetrahedra each, mirrored from cell to cell. Returns the numbers of corners and tetrahedra."""
    number, points, tets = {}, [], []
    for i in itertools.product(*(range(n + 1) for n in cells)):
        number[i] = len(number) + 1
        points.append([s * (k / n - 0.5) for s, k, n in zip(size, i, cells)])
    for cell in itertools.product(*(range(n) for n in cells)):
        flips = [k % 2 for k in cell]
        for order in itertools.permutations(range(3)):
            at, walk = [0, 0, 0], []
            for axis in (None, *order):
                if axis is not None:
                    at[axis] = 1
                walk.append(number[tuple(c + (1 - a if flip else a) for c, a, flip in zip(cell, at, flips))])
            if (order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))) == (sum(flips) % 2 == 1):
                walk[1], walk[2] = walk[2], walk[1]
            tets.append(walk)
    with open(path, "w") as file:
        file.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n")
        file.writelines("{:.9g} {:.9g} {:.9g} 0\n".format(*p) for p in points)
        file.write(f"Tetrahedra\n{len(tets)}\n")
        file.writelines("{} {} {} {} 0\n".format(*t) for t in tets)
        file.write("End\n")
    return len(points), len(tets)


def strip():
    """Sags by a hundredth of its length."""
    length, _, thick = STRIP
    young = 1.5 * 1000 * 9.81 * length**4 / (thick**2 * 0.01 * length)
    return {"bodies": [{"tets": "sheet.mesh", "name": "sheet", "material": {"young": young, "poisson": 0, "density": 1000},
                        "pins": [{"box": {"min": [-1, -1, -1], "max": [1e-9 - length / 2, 1, 1]}}]}],
            "time": {"static": {"increments": 1}}}


def cloth(steps):
    return {"bodies": [{"tets": "sheet.mesh", "name": "sheet", "transform": {"translate": [0, 0, 0.102]},
                        "material": {"young": 1e6, "poisson": 0.3, "density": 300}}],
            "obstacles": [{"sphere": {"radius": 0.1}}],
            "time": {"dt": 0.005, "steps_per_frame": 1, "frames": steps}}


def run(program, folder, scene, frames):
    """Runs so many frames. Returns the processor's seconds and the rows of the table of steps."""
    (folder / "scene.json").write_text(json.dumps(scene))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, "--threads", "1", "-q", "simulate", "scene.json", "-o", "run.h5", "--csv", "steps.csv", "--obj", "frames",
                    "--frames", str(frames)], cwd=folder, check=True, stderr=subprocess.DEVNULL)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    with open(folder / "steps.csv") as file:
        return seconds, list(csv.DictReader(file))


def heights(path):
    return [float(line.split()[3]) for line in open(path) if line.startswith("v ")]


def measure(program, case, elements, edge, layers, steps):
    size = STRIP if case == "strip" else CLOTH
    cells = (round(size[0] / edge), round(size[1] / edge), layers)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        nodes, tets = write_sheet(folder / "sheet.mesh", size, cells)
        if elements == "quadratic":
            nodes = (2 * cells[0] + 1) * (2 * cells[1] + 1) * (2 * layers + 1)
        scene = strip() if case == "strip" else cloth(steps)
        scene["bodies"][0]["meshing"] = {"elements": elements}
        frames = 1 if case == "strip" else steps
        start = 0.0
        if case == "cloth":
            start, _ = run(program, folder, scene, 1)
        seconds, rows = run(program, folder, scene, frames)
        sag = ""
        if case == "strip":
            sag = round(-(min(heights(folder / "frames" / "0_sheet_000001.obj")) + STRIP[2] / 2) / (0.01 * STRIP[0]), 4)
        count = len(rows)
        mean = lambda column: round(sum(float(row[column]) for row in rows) / count, 1)
        return {"case": case, "elements": elements, "edge_mm": edge * 1e3, "layers": layers, "nodes": nodes, "tets": tets,
                "unknowns": 3 * nodes, "unknowns_of_a_shell": 3 * (cells[0] + 1) * (cells[1] + 1), "sag_over_beam": sag,
                "linearisations": mean("newton_iterations"), "iterations": mean("solver_iterations"),
                "ms": round(1e3 * (seconds - start) / max(count - (case == "cloth"), 1), 1), "steps": count}


CASES = [("strip", "linear", edge, layers, 1) for edge, layers in ((0.01, 1), (0.005, 1), (0.0025, 1), (0.0025, 2), (0.0025, 4), (0.00125, 1))]
CASES += [("strip", "quadratic", edge, 1, 1) for edge in (0.02, 0.01, 0.005)] + [("strip", "quadratic", 0.005, 2, 1)]
CASES += [("cloth", "linear", 0.02, 1, 20), ("cloth", "linear", 0.02, 2, 20), ("cloth", "quadratic", 0.02, 1, 20)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="nbdtree")
    parser.add_argument("-o", metavar="FILE.csv", type=Path, default=Path("sheets.csv"), help="where the table is written; default: sheets.csv")
    given = parser.parse_args()
    program = str(Path(given.program).resolve())
    with open(given.o, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        for case in CASES:
            row = measure(program, *case)
            print(row, flush=True)
            table.writerow(row)
            file.flush()


if __name__ == "__main__":
    main()
