#!/usr/bin/env python3
"""Writes pneumatic_finger.obj: a bar of length 1 along x with four chambers, above its middle, so that it bends
down where they are blown up."""

import argparse


def box(low, high, cells, inward):
    """Vertices and triangles of a box whose sides are grids of so many cells."""
    numbers, vertices, faces = {}, [], []

    def vertex(i):
        if i not in numbers:
            numbers[i] = len(vertices)
            vertices.append([a + (b - a) * k / n for a, b, k, n in zip(low, high, i, cells)])
        return numbers[i]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for j in range(cells[u]):
                for k in range(cells[v]):
                    corners = []
                    for dj, dk in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        i = [0, 0, 0]
                        i[axis], i[u], i[v] = side, j + dj, k + dk
                        corners.append(vertex(tuple(i)))
                    if (side == 0) != inward:
                        corners.reverse()
                    turn = (j + k) % 2  # diagonals alternate, so that it bends alike to all sides
                    a, b, c, d = corners[turn:] + corners[:turn]
                    faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def main(path):
    parts = [box((-0.5, -0.1, -0.1), (0.5, 0.1, 0.1), (20, 4, 4), False)]
    for k in range(4):
        x = -0.44 + 0.23 * k
        parts.append(box((x, -0.04, 0.01), (x + 0.19, 0.04, 0.07), (4, 2, 2), True))
    with open(path, "w") as file:
        first = 1
        for vertices, _ in parts:
            for vertex in vertices:
                file.write("v {:.6g} {:.6g} {:.6g}\n".format(*vertex))
        for vertices, faces in parts:
            for face in faces:
                file.write("f {} {} {}\n".format(*(first + v for v in face)))
            first += len(vertices)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("file", metavar="FILE.obj", help="where the surface is written")
    main(arguments.parse_args().file)
