"""Builds the gecko, an implicit surface of smoothly joined rounded cones, as a closed triangle mesh.

Surface nets [Gibson98] on a regular grid give the triangles. Rounds of edge flips, tangential relaxation and projection
onto the surface improve their shape. Needs only numpy; every run gives the same bits.
"""

import numpy as np

CELL = 0.0245  # grid spacing; edges become slightly shorter
BLEND = 0.012  # rounding distance of the joints

# Rounded cones along polylines with one radius per point. x points to the head, y up, z to the right.
PARTS = {
    "trunk": ([(-0.17, 0.08, -0.03), (-0.06, 0.085, 0.005), (0.06, 0.085, 0.02), (0.17, 0.09, 0.0)],
              [0.060, 0.080, 0.078, 0.058]),
    "tail": ([(-0.17, 0.08, -0.03), (-0.27, 0.07, -0.055), (-0.37, 0.06, -0.05), (-0.46, 0.05, -0.005),
              (-0.53, 0.042, 0.065), (-0.57, 0.04, 0.14)], [0.060, 0.057, 0.052, 0.045, 0.036, 0.024]),
    "head": ([(0.17, 0.09, 0.0), (0.275, 0.105, -0.03), (0.37, 0.092, -0.05)], [0.054, 0.072, 0.042]),
    "front right leg": ([(0.13, 0.08, 0.05), (0.185, 0.095, 0.175), (0.285, 0.035, 0.235)],
                        [0.044, 0.037, 0.032]),
    "front left leg": ([(0.12, 0.08, -0.04), (0.065, 0.095, -0.175), (0.125, 0.035, -0.265)],
                       [0.044, 0.037, 0.032]),
    "hind right leg": ([(-0.13, 0.075, 0.02), (-0.185, 0.09, 0.15), (-0.285, 0.035, 0.205)],
                       [0.046, 0.039, 0.032]),
    "hind left leg": ([(-0.13, 0.075, -0.07), (-0.07, 0.09, -0.205), (-0.135, 0.035, -0.29)],
                      [0.046, 0.039, 0.032]),
    "right eye": ([(0.295, 0.152, 0.022), (0.295, 0.152, 0.022)], [0.029, 0.029]),
    "left eye": ([(0.280, 0.152, -0.082), (0.280, 0.152, -0.082)], [0.029, 0.029]),
}
# Two toes at the end of each leg: direction in the ground plane, degrees from the x axis towards z.
TOES = {"front right leg": (5, 70), "front left leg": (-20, -85), "hind right leg": (95, 160),
        "hind left leg": (-105, -170)}
TOE_LENGTH, TOE_RADII = 0.07, [0.031, 0.027]


def cones():
    """All rounded cones as arrays: start points [n, 3], end points [n, 3], radii at both ends [n, 2]."""
    lines = list(PARTS.values())
    for leg, directions in TOES.items():
        ankle = np.array(PARTS[leg][0][-1])
        for angle in np.radians(directions):
            tip = ankle + TOE_LENGTH * np.array([np.cos(angle), -0.1, np.sin(angle)])
            lines.append(([ankle, tip], TOE_RADII))
    pieces = [(p[i], p[i + 1], r[i : i + 2]) for p, r in lines for i in range(len(p) - 1)]
    start, end, radii = (np.array(column, float) for column in zip(*pieces))
    return start, end, radii


def field(x, shape):
    """Implicit function at points [n, 3]: negative inside, approximately a signed distance."""
    start, end, radii = shape
    axis = end - start
    along = np.einsum("nkc,kc->nk", x[:, None] - start, axis) / np.maximum((axis**2).sum(1), 1e-30)
    along = np.clip(along, 0, 1)
    near = start + along[..., None] * axis
    distance = np.linalg.norm(x[:, None] - near, axis=2) - (radii[:, 0] + along * (radii[:, 1] - radii[:, 0]))
    least = distance.min(1, keepdims=True)
    return least[:, 0] - BLEND * np.log(np.exp((least - distance) / BLEND).sum(1))


def gradient(x, shape, h=1e-5):
    return np.stack([(field(x + d, shape) - field(x - d, shape)) / (2 * h) for d in np.eye(3) * h], 1)


def project(x, shape, steps=3):
    for _ in range(steps):
        g = gradient(x, shape)
        x = x - (field(x, shape) / (g**2).sum(1))[:, None] * g
    return x


def surface_nets(shape, h):
    """Vertices and quads of the zero set: one vertex per crossed grid cell, one quad per crossed grid edge."""
    low = (np.minimum(shape[0], shape[1]) - shape[2].max(1)[:, None]).min(0) - 3 * h
    high = (np.maximum(shape[0], shape[1]) + shape[2].max(1)[:, None]).max(0) + 3 * h
    size = np.ceil((high - low) / h).astype(int)
    grid = np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), -1)
    value = np.concatenate([field(low + h * part.reshape(-1, 3), shape) for part in grid]).reshape(size)
    inside = value < 0
    total, count = np.zeros((*size, 3)), np.zeros(size)
    quads = []
    for axis in range(3):
        u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        first = np.moveaxis(inside, axis, 0)[:-1]
        crossing = np.moveaxis(first != np.moveaxis(inside, axis, 0)[1:], 0, axis)
        cell = np.argwhere(crossing)
        step = np.eye(3, dtype=int)[axis]
        a, b = value[tuple(cell.T)], value[tuple((cell + step).T)]
        point = cell + (a / (a - b))[:, None] * step
        around = [cell - u - v, cell - v, cell, cell - u]
        for c in around:
            np.add.at(total, tuple(c.T), point)
            np.add.at(count, tuple(c.T), 1)
        ids = np.stack([np.ravel_multi_index(tuple(c.T), size) for c in around], 1)
        quads.append(np.where((a < 0)[:, None], ids, ids[:, ::-1]))
    quads = np.concatenate(quads)
    used, corners = np.unique(quads, return_inverse=True)
    x = total.reshape(-1, 3)[used] / count.reshape(-1)[used][:, None]
    return low + h * x, corners.reshape(-1, 4)


def triangulate(x, quads):
    a, b, c, d = quads.T
    short = np.linalg.norm(x[a] - x[c], axis=1) <= np.linalg.norm(x[b] - x[d], axis=1)
    return np.where(short[:, None, None], np.stack([[a, b, c], [a, c, d]]).transpose(2, 0, 1),
                    np.stack([[a, b, d], [b, c, d]]).transpose(2, 0, 1)).reshape(-1, 3)


def flip_edges(x, faces):
    """Flips edges with opposite angles of more than 180 degrees in sum, if the mesh stays manifold."""
    faces = [list(map(int, f)) for f in faces]
    side = {(f[i], f[(i + 1) % 3]): n for n, f in enumerate(faces) for i in range(3)}
    queue = sorted({tuple(sorted(e)) for e in side})

    def angle(p, q, r):
        u, v = x[q] - x[p], x[r] - x[p]
        return np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v)

    while queue:
        a, b = queue.pop()
        if (a, b) not in side or (b, a) not in side:
            continue
        left, right = side[a, b], side[b, a]
        c = sum(faces[left]) - a - b
        d = sum(faces[right]) - a - b
        if (c, d) in side or (d, c) in side or angle(c, a, b) + angle(d, a, b) <= np.pi + 1e-6:
            continue
        del side[a, b], side[b, a]
        faces[left], faces[right] = [a, d, c], [d, b, c]
        for n in (left, right):
            side.update({(faces[n][i], faces[n][(i + 1) % 3]): n for i in range(3)})
        queue += [tuple(sorted(e)) for e in ((a, d), (d, b), (b, c), (c, a))]
    return np.array(faces)


def relax(x, faces, shape, weight=0.6):
    """Moves vertices tangentially towards the area-weighted mean of the centroids of their triangles."""
    centre = x[faces].mean(1)
    area = np.linalg.norm(np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]]), axis=1)
    total, mass = np.zeros_like(x), np.zeros(len(x))
    for c in range(3):
        np.add.at(total, faces[:, c], centre * area[:, None])
        np.add.at(mass, faces[:, c], area)
    step = total / mass[:, None] - x
    normal = gradient(x, shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return project(x + weight * (step - (step * normal).sum(1)[:, None] * normal), shape, 1)


def gecko():
    shape = cones()
    x, quads = surface_nets(shape, CELL)
    x = project(x, shape)
    faces = triangulate(x, quads)
    for _ in range(8):
        faces = flip_edges(x, faces)
        for _ in range(6):
            x = relax(x, faces, shape)
    return project(x, shape), flip_edges(x, faces)
