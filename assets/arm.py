#!/usr/bin/env python3
"""Writes arm.mesh: a bar of tetrahedra from z = 0 to 0.2 m, 0.02 m thick, with reference number 1 where x < 0 and 2 where
x > 0."""

import argparse
import itertools

SIZE, CELLS = (0.02, 0.02, 0.2), (2, 2, 12)


def bar():
    corner = {}
    for i in itertools.product(*(range(n + 1) for n in CELLS)):
        corner[i] = len(corner) + 1
    points = [[SIZE[k] * (i[k] / CELLS[k] - (0.5 if k < 2 else 0)) for k in range(3)] for i in corner]
    tets = []
    for cell in itertools.product(*(range(n) for n in CELLS)):
        flips = [k % 2 for k in cell]  # cells mirror their neighbours, so that it bends alike to all sides
        for order in itertools.permutations(range(3)):
            at, walk = [0, 0, 0], []
            for axis in (None, *order):
                if axis is not None:
                    at[axis] = 1
                walk.append(corner[tuple(c + (1 - a if flip else a) for c, a, flip in zip(cell, at, flips))])
            even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
            if even == (sum(flips) % 2 == 1):
                walk[1], walk[2] = walk[2], walk[1]
            tets.append([*walk, 1 if 2 * cell[0] < CELLS[0] else 2])
    return points, tets


def main(path):
    points, tets = bar()
    with open(path, "w") as file:
        file.write("# made by arm.py, CC0\nMeshVersionFormatted 2\nDimension 3\n")
        file.write(f"Vertices\n{len(points)}\n")
        file.writelines("{:g} {:g} {:g} 0\n".format(*(x + 0.0 for x in point)) for point in points)
        file.write(f"Tetrahedra\n{len(tets)}\n")
        file.writelines("{} {} {} {} {}\n".format(*tet) for tet in tets)
        file.write("End\n")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("file", metavar="FILE.mesh", help="where the bar is written")
    main(arguments.parse_args().file)
