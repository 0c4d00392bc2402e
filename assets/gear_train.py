#!/usr/bin/env python3
"""Writes the parts of the scene gear_train.json: a gear of 12 teeth, one of 24 teeth with a pulley on its shaft, a larger
pulley, and a belt around both. Their axis is y; they are in metres, the gears and pulleys about the origin."""

import argparse
import itertools
import math
import pathlib

MODULE = 0.004  # a gear of n teeth rolls as a circle of radius MODULE * n / 2
SLOPE = math.radians(25)  # of the flanks where those circles touch
PLAY = 0.0003  # by which a tooth is thinner than the gap that it goes into
SMALL, LARGE = 0.024, 0.036  # radii of the pulleys
APART = 0.14  # distance of their axes
BELT = 0.004  # its thickness
WIDTH = 0.012  # of the belt and of the gears
GAP = 0.0004  # between the belt and the pulleys, before it is tightened


def involute(angle):
    return math.tan(angle) - angle


def gear(teeth, turn):
    """Radius and angle of the outline of a gear whose teeth have flanks of involutes, about the axis."""
    rolling = MODULE * teeth / 2
    base, root, tip = rolling * math.cos(SLOPE), rolling - 1.2 * MODULE, rolling + MODULE
    half = math.pi / (2 * teeth) - PLAY / (4 * rolling)
    first = max(base, root)
    foot = half + involute(SLOPE) - involute(math.acos(base / first))
    flank = [(root, foot + 0.3 * (math.pi / teeth - foot))] if base > root else []
    for k in range(5):
        radius = first + (tip - first) * k / 4
        flank.append((radius, half + involute(SLOPE) - involute(math.acos(base / radius))))
    outline = []
    for k in range(teeth):
        middle = turn + 2 * math.pi * k / teeth
        outline += [(radius, middle - angle) for radius, angle in flank]
        outline += [(radius, middle + angle) for radius, angle in reversed(flank)]
    return outline


def circle(radius, angles):
    return [(radius, angle) for angle in angles]


def turned(rings):
    """The surface of a solid between outlines (y, [(radius, angle), ...]) of as many points each."""
    count = len(rings[0][1])
    vertices = [(0, rings[0][0], 0)]
    for y, outline in rings:
        vertices += [(radius * math.cos(angle), y, -radius * math.sin(angle)) for radius, angle in outline]
    vertices.append((0, rings[-1][0], 0))
    faces = []
    for i in range(count):
        j = (i + 1) % count
        faces.append((0, 1 + j, 1 + i))
        for ring in range(len(rings) - 1):
            a, b = 1 + ring * count + i, 1 + ring * count + j
            faces += [(a, b, b + count), (a, b + count, a + count)]
        last = 1 + (len(rings) - 1) * count
        faces.append((len(vertices) - 1, last + i, last + j))
    return vertices, faces


def belt(cells):
    """Nodes and tetrahedra of a closed band around the small pulley at the origin and the large one at x = APART."""
    lean = math.asin((LARGE - SMALL) / APART)  # of the straight parts
    parts = []  # (length, point and normal at a share of it) of a path around the pulleys
    for at, radius, begin, end in ((APART, LARGE, -math.pi / 2 - lean, math.pi / 2 + lean),
                                   (0, SMALL, math.pi / 2 + lean, 3 * math.pi / 2 - lean)):
        parts.append((at, radius + GAP, begin, end))
    straight = math.sqrt(APART**2 - (LARGE - SMALL) ** 2)
    lengths = [parts[0][1] * (parts[0][3] - parts[0][2]), straight, parts[1][1] * (parts[1][3] - parts[1][2]), straight]

    def at(way):
        """Point of the inner side and its normal after so much of the way."""
        for k, length in enumerate(lengths):
            if way <= length or k == 3:
                break
            way -= length
        share = way / lengths[k]
        if k % 2 == 0:
            centre, radius, begin, end = parts[k // 2]
            angle = begin + share * (end - begin)
            normal = (math.cos(angle), math.sin(angle))
            return (centre + radius * normal[0], radius * normal[1]), normal
        centre, radius, _, angle = parts[k // 2]
        normal = (math.cos(angle), math.sin(angle))
        other = parts[1 - k // 2]
        start = (centre + radius * normal[0], radius * normal[1])
        goal = (other[0] + other[1] * normal[0], other[1] * normal[1])
        return tuple(a + share * (b - a) for a, b in zip(start, goal)), normal

    points, tets = [], []
    for i in range(cells[0]):
        point, normal = at(sum(lengths) * i / cells[0])
        for j in range(cells[1] + 1):
            for k in range(cells[2] + 1):
                h = BELT * k / cells[2]
                points.append((point[0] + h * normal[0], WIDTH * (j / cells[1] - 0.5), point[1] + h * normal[1]))
    for cell in itertools.product(*(range(n) for n in cells)):
        for order in itertools.permutations(range(3)):  # six tetrahedra, along the ways from corner to corner
            walk, corner = [], list(cell)
            for axis in (None, *order):
                if axis is not None:
                    corner[axis] += 1
                walk.append((corner[0] % cells[0] * (cells[1] + 1) + corner[1]) * (cells[2] + 1) + corner[2])
            if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                walk[1], walk[2] = walk[2], walk[1]
            tets.append(walk)
    return points, tets


def write_tets(path, points, tets):
    with open(path, "w") as file:
        file.write("# made by gear_train.py, CC0\nMeshVersionFormatted 2\nDimension 3\n")
        file.write(f"Vertices\n{len(points)}\n")
        file.writelines("{:.6f} {:.6f} {:.6f} 0\n".format(*(x + 0.0 for x in point)) for point in points)
        file.write(f"Tetrahedra\n{len(tets)}\n")
        file.writelines("{} {} {} {} 0\n".format(*(n + 1 for n in tet)) for tet in tets)
        file.write("End\n")


def write(path, vertices, faces):
    corners = [[vertices[v] for v in face] for face in faces]
    volume = sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
                 for a, b, c in corners)
    if volume < 0:
        faces = [face[::-1] for face in faces]
    with open(path, "w") as file:
        file.write("# made by gear_train.py, CC0\n")
        file.writelines("v {:.6f} {:.6f} {:.6f}\n".format(*(x + 0.0 for x in vertex)) for vertex in vertices)
        file.writelines("f {} {} {}\n".format(*(v + 1 for v in face)) for face in faces)


def main(folder):
    low, high, end = -WIDTH / 2, WIDTH / 2, WIDTH / 2 + 0.016
    driver = gear(12, 0)
    write(folder / "small_gear.obj", *turned([(low, driver), (high, driver)]))
    wheel = gear(24, math.pi / 24)
    shaft = circle(SMALL, [angle for _, angle in wheel])
    write(folder / "gear_and_pulley.obj", *turned([(low, wheel), (high, wheel), (high, shaft), (end, shaft)]))
    rim = circle(LARGE, [2 * math.pi * k / 144 for k in range(144)])
    write(folder / "pulley.obj", *turned([(-0.008, rim), (0.008, rim)]))
    write_tets(folder / "belt.mesh", *belt((72, 2, 2)))


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", metavar="FOLDER", type=pathlib.Path, help="where the four files are written")
    main(arguments.parse_args().folder)
