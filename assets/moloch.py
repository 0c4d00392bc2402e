#!/usr/bin/env python3
"""Makes the thorny devil (Moloch horridus): the gecko's body, all over scales, ridges and spikes.

    assets/moloch.py OUTPUT.obj

Three rounds of Loop subdivision [Loop87] smooth gecko.obj. Scales are the cells of points spread evenly over the
surface; they rise towards the tail, each with a keel, and spikes stand on the back, the tail and the limbs. Faces
around spikes are divided once more. The surface is closed, manifold and of about 300,000 faces. Needs nothing but
Python; every run gives the same bytes.
"""

import math
import os
import pathlib
import random
import sys

GECKO = pathlib.Path(__file__).resolve().parent / "gecko.obj"
LOOP_ROUNDS = 3
SCALE_RADIUS = 0.019  # half the distance of neighbouring scales, metres; the body is 1 m long
SCALE_HEIGHT = 0.0075
LEAN = 0.45  # how far spikes lean towards the tail

# Rows of spikes: the least distance between two of them, radius of the base, height, all in metres.
LARGE = (0.078, 0.024, 0.050)
SMALL = (0.046, 0.012, 0.022)


def read_obj(path):
    points, faces = [], []
    for line in path.read_text().splitlines():
        word, *values = line.split()
        if word == "v":
            points.append(tuple(map(float, values)))
        elif word == "f":
            faces.append(tuple(int(value) - 1 for value in values))
    return points, faces


def edges_of(faces):
    """Edge (a, b) with a < b -> the opposite vertices of its two faces. Raises ValueError unless closed."""
    opposite = {}
    for a, b, c in faces:
        for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
            opposite.setdefault((i, j) if i < j else (j, i), []).append(k)
    if any(len(pair) != 2 for pair in opposite.values()):
        raise ValueError("the surface is not closed")
    return opposite


def loop(points, faces):
    """One round of Loop subdivision of points of any dimension."""
    opposite = edges_of(faces)
    around = [[] for _ in points]
    for a, b in opposite:
        around[a].append(b)
        around[b].append(a)
    smooth = []
    for p, ring in zip(points, around):
        n = len(ring)
        beta = 3 / 16 if n == 3 else 3 / (8 * n)
        sums = map(sum, zip(*[points[i] for i in ring]))
        smooth.append(tuple((1 - n * beta) * x + beta * s for x, s in zip(p, sums)))
    middle = {}
    for (a, b), (c, d) in opposite.items():
        middle[a, b] = middle[b, a] = len(smooth)
        smooth.append(tuple(0.375 * (p + q) + 0.125 * (r + s)
                            for p, q, r, s in zip(points[a], points[b], points[c], points[d])))
    divided = []
    for a, b, c in faces:
        ab, bc, ca = middle[a, b], middle[b, c], middle[c, a]
        divided += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return smooth, divided


def way_from_snout(points, faces):
    """Length of the way along edges from the tip of the snout to every vertex, smoothed."""
    around = [[] for _ in points]
    for a, b in edges_of(faces):
        length = math.dist(points[a], points[b])
        around[a].append((b, length))
        around[b].append((a, length))
    way = [math.inf] * len(points)
    way[max(range(len(points)), key=lambda i: points[i][0])] = 0.0
    changed = set(i for i, w in enumerate(way) if w == 0)
    while changed:
        reached = set()
        for i in changed:
            for j, length in around[i]:
                if way[i] + length < way[j] - 1e-12:
                    way[j] = way[i] + length
                    reached.add(j)
        changed = reached
    for _ in range(3):
        way = [(w + sum(way[j] for j, _ in ring)) / (1 + len(ring)) for w, ring in zip(way, around)]
    return way


def normals_of(points, faces):
    sums = [[0.0, 0.0, 0.0] for _ in points]
    for a, b, c in faces:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[a][:3], points[b][:3], points[c][:3]
        ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for i in (a, b, c):
            s = sums[i]
            s[0] += nx
            s[1] += ny
            s[2] += nz
    return [(x / r, y / r, z / r) for x, y, z in sums for r in [math.sqrt(x * x + y * y + z * z)]]


class Grid:
    """Points in cubes of one size, to find those near a place."""

    def __init__(self, size):
        self.size, self.cubes = size, {}

    def add(self, p, item):
        self.cubes.setdefault(tuple(math.floor(x / self.size) for x in p[:3]), []).append(item)

    def near(self, p):
        """The items in the cube of p and in its neighbours: all within `size` of p, and others."""
        i, j, k = (math.floor(x / self.size) for x in p[:3])
        return [item for a in (i - 1, i, i + 1) for b in (j - 1, j, j + 1) for c in (k - 1, k, k + 1)
                for item in self.cubes.get((a, b, c), ())]


def spread(points, candidates, distance):
    """Some of the candidates, indices of points, none closer than `distance` to another."""
    grid, chosen = Grid(distance), []
    for i in candidates:
        if all(math.dist(points[i][:3], points[j][:3]) >= distance for j in grid.near(points[i])):
            grid.add(points[i], i)
            chosen.append(i)
    return chosen


def smoothstep(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def scale_heights(points, seeds):
    """Height of the scales at every point (x, y, z, way): shingles that rise towards the tail, with a keel."""
    grid = Grid(4 * SCALE_RADIUS)
    for i in seeds:
        grid.add(points[i], points[i])
    nearby, heights = {}, []
    size = grid.size
    for x, y, z, way in points:
        cube = (math.floor(4 * x / size), math.floor(4 * y / size), math.floor(4 * z / size))
        if cube not in nearby:  # the seeds that may be one of the two nearest to a point of a small cube
            centre = [(c + 0.5) * size / 4 for c in cube]
            ranked = sorted((math.dist(centre, s[:3]), s) for s in grid.near(centre))
            reach = ranked[1][0] + 2 * math.sqrt(0.75) * size / 4
            nearby[cube] = [s for d, s in ranked if d <= reach]
        first = second = math.inf
        seed_way = 0.0
        for sx, sy, sz, sw in nearby[cube]:
            d = (x - sx) ** 2 + (y - sy) ** 2 + (z - sz) ** 2
            if d < first:
                first, second, seed_way = d, first, sw
            elif d < second:
                second = d
        first, second = math.sqrt(first), math.sqrt(second)
        along = (way - seed_way) / SCALE_RADIUS
        aside = math.sqrt(max((first / SCALE_RADIUS) ** 2 - along**2, 0))
        rim = smoothstep((second - first) / (0.45 * SCALE_RADIUS))
        keel = max(0.0, 1 - 2.5 * aside)
        heights.append(SCALE_HEIGHT * rim * (0.55 + 0.35 * min(max(along, -1.0), 1.0) + 0.5 * keel))
    return heights


def spikes_of(points, faces, normals):
    """Spikes as (foot, radius, axis times height)."""
    around = [set() for _ in points]
    for face in faces:
        for i in face:
            around[i].update(face)

    def curvature(i):
        """Mean curvature at a vertex, 1/m: > 0 where the surface is convex, 1/r on a ball of radius r."""
        x = points[i]
        ring = [points[j] for j in around[i] if j != i]
        inward = sum(n * sum(x[c] - y[c] for y in ring) for c, n in enumerate(normals[i]))
        return 2 * inward / sum(math.dist(x[:3], y[:3]) ** 2 for y in ring)

    def axis(i):
        """The normal, leaning towards the tail or the toes."""
        flow = [0.0, 0.0, 0.0]
        for j in around[i]:
            for c in range(3):
                flow[c] += (points[j][3] - points[i][3]) * (points[j][c] - points[i][c])
        n = normals[i]
        inward = sum(f * x for f, x in zip(flow, n))
        flow = [f - inward * x for f, x in zip(flow, n)]
        length = math.sqrt(sum(f * f for f in flow)) or 1.0
        a = [x + LEAN * f / length for x, f in zip(n, flow)]
        length = math.sqrt(sum(x * x for x in a))
        return [x / length for x in a]

    order = list(range(len(points)))
    random.Random(1).shuffle(order)
    bent = {i: curvature(i) for i in order}
    convex = [i for i in order if bent[i] > 0 and points[i][3] > 0.08]
    back = [i for i in convex if normals[i][1] > 0.55 and bent[i] < 25]  # no toes
    spikes, taken = [], []
    for (distance, radius, height), candidates in ((LARGE, back), (SMALL, [i for i in convex if normals[i][1] > -0.1])):
        free = [i for i in candidates
                if all(math.dist(points[i][:3], points[j][:3]) > 0.75 * (r + radius) + 0.01 for j, r in taken)]
        for i in spread(points, free, distance):
            taken.append((i, radius))
            spikes.append((points[i], radius, [height * x for x in axis(i)]))
    return spikes


def divide_near(points, faces, spikes):
    """Divides the edges around spikes; faces are split into two, three or four, so that the surface stays closed."""
    grid = Grid(0.03)
    for spike in spikes:
        grid.add(spike[0], spike)
    near = [any(math.dist(p[:3], foot[:3]) < 0.45 * radius for foot, radius, _ in grid.near(p)) for p in points]
    points, middle, divided = list(points), {}, []
    for a, b in edges_of(faces):
        if near[a] and near[b]:
            middle[a, b] = middle[b, a] = len(points)
            points.append(tuple((p + q) / 2 for p, q in zip(points[a], points[b])))
    for face in faces:
        cut = [(face[i], face[(i + 1) % 3]) in middle for i in range(3)]
        if not any(cut):
            divided.append(face)
            continue
        turn = cut.index(True) if sum(cut) < 2 else (cut.index(False) + 1) % 3 if sum(cut) == 2 else 0
        a, b, c = face[turn:] + face[:turn]  # edge ab is cut, and of two, bc as well
        ab = middle[a, b]
        if sum(cut) == 1:
            divided += [(a, ab, c), (ab, b, c)]
        elif sum(cut) == 2:
            bc = middle[b, c]
            divided += [(ab, b, bc), (a, ab, bc), (a, bc, c)]
        else:
            bc, ca = middle[b, c], middle[c, a]
            divided += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return points, divided


def displaced(points, normals, heights, spikes):
    """Points moved outward by the scales and by the spikes."""
    grid = Grid(0.03)
    for spike in spikes:
        grid.add(spike[0], spike)
    moved = []
    for p, n, h in zip(points, normals, heights):
        x, y, z = p[:3]
        lift = 0.0
        ax = ay = az = 0.0
        for foot, radius, (sx, sy, sz) in grid.near(p):
            d = math.sqrt((x - foot[0]) ** 2 + (y - foot[1]) ** 2 + (z - foot[2]) ** 2) / radius
            if d < 1:
                share = (1 - d) ** 1.7
                lift = max(lift, 1 - d)
                ax, ay, az = ax + share * sx, ay + share * sy, az + share * sz
        h *= 1 - 0.8 * lift
        moved.append((x + h * n[0] + ax, y + h * n[1] + ay, z + h * n[2] + az))
    return moved


def moloch():
    """Points and faces of the surface, closed and oriented outward; the longest side is 1, the centre 0."""
    points, faces = read_obj(GECKO)
    points = [p + (w,) for p, w in zip(points, way_from_snout(points, faces))]
    for round_ in range(LOOP_ROUNDS):
        if round_ == 2:  # fine enough to choose places
            normals = normals_of(points, faces)
            spikes = spikes_of(points, faces, normals)
            order = list(range(len(points)))
            random.Random(2).shuffle(order)
            seeds = spread(points, order, 2 * SCALE_RADIUS * 0.85)
            places = points
        points, faces = loop(points, faces)
    points, faces = divide_near(points, faces, spikes)
    seeds = [places[i] for i in seeds]
    heights = scale_heights(points + seeds, range(len(points), len(points) + len(seeds)))[: len(points)]
    points = displaced(points, normals_of(points, faces), heights, spikes)
    low, high = ([limit(p[c] for p in points) for c in range(3)] for limit in (min, max))
    size = max(h - l for l, h in zip(low, high))
    return [tuple((x - (l + h) / 2) / size for x, l, h in zip(p, low, high)) for p in points], faces


def main():
    if "--help" in sys.argv or "-h" in sys.argv:
        return print(__doc__)
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print("moloch.py: error: needs the name of one file to write; see assets/moloch.py --help", file=sys.stderr)
        sys.exit(2)
    path = pathlib.Path(sys.argv[1])
    points, faces = moloch()
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    with open(unfinished, "w") as file:
        file.write("# made by moloch.py, CC0\n")
        file.writelines("v %.6f %.6f %.6f\n" % p for p in points)
        file.writelines("f %d %d %d\n" % (a + 1, b + 1, c + 1) for a, b, c in faces)
    unfinished.replace(path)
    print(f"{path}: {len(points)} vertices, {len(faces)} faces")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError) as error:
        sys.exit(f"moloch.py: error: {error}")
