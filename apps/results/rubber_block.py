#!/usr/bin/env python3
"""Stiffness of a rubber block between rigid plates by CalculiX's quadratic tetrahedra (C3D10), for the check `rubber_block`
of `nbdtree-bench physics`: force over E times area times compression by height, of a block as wide and deep as 1, half as
high, bonded to both plates, for small displacements. Needs ccx (Debian: calculix-ccx).

    rubber_block.py [--cells N ...] [--poisson NU ...]
"""
import argparse
import itertools
import math
import pathlib
import re
import subprocess
import sys
import tempfile

TETS = ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))


def effective_modulus(cells, poisson, folder):
    """A quarter of the block, of `cells` cells an edge, with planes of symmetry at x = 0 and y = 0."""
    fine = 2 * cells + 1

    # Cells grow from the edges of the bonded faces, where stresses are infinite. Middle nodes lie in the middle.
    outward = [0.5 * (1 - (1 - k / cells) ** 2) for k in range(cells + 1)]
    upward = [0.25 * (1 - math.cos(math.pi * k / cells)) for k in range(cells + 1)]

    def place(along, k):
        return (along[k // 2] + along[(k + 1) // 2]) / 2

    def node(at):
        return (at[0] * fine + at[1]) * fine + at[2] + 1

    nodes, elements = {}, []
    for corner in itertools.product(range(cells), repeat=3):
        for turn, path in enumerate(TETS):
            at = [2 * k for k in corner]
            places = [tuple(at)]
            for axis in path:
                at[axis] += 2
                places.append(tuple(at))
            if turn in (1, 2, 5):
                places[2], places[3] = places[3], places[2]
            middle = [tuple((places[a][k] + places[b][k]) // 2 for k in range(3))
                      for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
            elements.append(places + middle)
            nodes.update((node(p), p) for p in places + middle)
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, {place(outward, p[0]):.12g}, {place(outward, p[1]):.12g}, {place(upward, p[2]):.12g}"
              for n, p in sorted(nodes.items())]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BLOCK")
    lines += [", ".join(map(str, [e + 1] + [node(p) for p in places])) for e, places in enumerate(elements)]
    for name, axis, side in (("LOW", 2, 0), ("TOP", 2, fine - 1), ("X0", 0, 0), ("Y0", 1, 0)):
        lines.append(f"*NSET, NSET={name}")
        lines += [str(n) for n, p in sorted(nodes.items()) if p[axis] == side]
    lines += ["*MATERIAL, NAME=RUBBER", "*ELASTIC", f"1, {poisson}", "*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER",
              "*STEP", "*STATIC", "*BOUNDARY", "LOW, 1, 3, 0", "TOP, 1, 2, 0", "TOP, 3, 3, -0.0005",
              "X0, 1, 1, 0", "Y0, 2, 2, 0", "*NODE PRINT, NSET=TOP, TOTALS=ONLY", "RF", "*END STEP"]
    (folder / "block.inp").write_text("\n".join(lines) + "\n")
    ran = subprocess.run(["ccx", "block"], cwd=folder, capture_output=True, text=True, check=False)
    text = (folder / "block.dat").read_text() if (folder / "block.dat").exists() else ""
    numbers = re.findall(r"[-+]?\d\.\d+E[-+]\d+", text)
    if not numbers:
        sys.exit(f"ccx gave no force: {ran.stdout[-300:]}")
    force, area, strain = -float(numbers[-1]), 0.25, 0.0005 / 0.5
    return force / (area * strain)


def limit(counts, values):
    """What the values tend to as C counts^-p + limit, by the three largest counts."""
    (a, b, c), (f, g, h) = counts[-3:], values[-3:]
    low, high = 0.1, 6
    for _ in range(60):
        p = (low + high) / 2
        is_steep = (a**-p - b**-p) / (b**-p - c**-p) > (f - g) / (g - h)
        low, high = (low, p) if is_steep else (p, high)
    return h - (g - h) * c**-p / (b**-p - c**-p)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--cells", type=int, nargs="+", default=[6, 8, 10])
parser.add_argument("--poisson", type=float, nargs="+", default=[0.3, 0.45, 0.49, 0.499])
arguments = parser.parse_args()
print("poisson,cells,force_over_e_area_strain")
for ratio in arguments.poisson:
    found = []
    for count in arguments.cells:
        with tempfile.TemporaryDirectory() as folder:
            found.append(effective_modulus(count, ratio, pathlib.Path(folder)))
        print(f"{ratio},{count},{found[-1]:.6f}", flush=True)
    if len(found) > 2:
        print(f"{ratio},infinite,{limit(arguments.cells, found):.4f}", flush=True)
