"""Uses learned bounds in another simulator: a mass-spring body in numpy, which nbdtree knows nothing of.

    python3 5_own_simulator.py [folder]
"""

import pathlib
import sys
import time

import numpy as np
import numpy.typing as npt

import nbdtree as nbd

Doubles = npt.NDArray[np.float64]

assets = pathlib.Path(__file__).resolve().parents[3] / "assets"
folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "springs")
folder.mkdir(exist_ok=True)

# The body: nodes with masses, springs along all edges of its tetrahedra. Its surface hangs on the nodes.
beam = nbd.mesh_file(assets / "beam.obj")
edges = np.unique(np.sort(np.vstack([beam.T[:, [i, j]] for i in range(4) for j in range(i)]), 1), axis=0)
rest = np.linalg.norm(beam.X[edges[:, 0]] - beam.X[edges[:, 1]], axis=1)
MASS, STIFFNESS, DAMPING, DT = 0.02, 600.0, 0.3, 5e-4
incidence = np.concatenate([edges[:, 0], edges[:, 1]])


class Springs:
    """A mass-spring body, stepped by symplectic Euler."""

    def __init__(self, x: Doubles, v: Doubles) -> None:
        self.x, self.v = x.copy(), v.copy()

    def step(self, outer: Doubles) -> None:
        along = self.x[edges[:, 1]] - self.x[edges[:, 0]]
        length = np.linalg.norm(along, axis=1)
        pull = (STIFFNESS * (length - rest) / length)[:, None] * along
        pull += DAMPING * (self.v[edges[:, 1]] - self.v[edges[:, 0]])
        both = np.concatenate([pull, -pull])
        force = outer + np.stack([np.bincount(incidence, both[:, k], len(self.x)) for k in range(3)], 1)
        self.v += DT / MASS * force
        self.x += DT * self.v


def random_start(rng: np.random.Generator) -> Springs:
    """Bent, sheared and spinning."""
    x = beam.X - beam.X.mean(axis=0)
    return Springs(beam.X, x @ rng.normal(0, 1.5, (3, 3)) + rng.normal(0, 2, 3) * x[:, :1] ** 2)


# 1. Record poses of this simulator, in the format that training reads.
rng = np.random.default_rng(1)
nothing = np.zeros_like(beam.X)
with nbd.RecordingWriter(folder / "springs.h5") as writer:
    for trajectory in range(30):
        handle = writer.begin_trajectory(len(beam.X), trajectory, body_hash=beam.hash)
        body = random_start(rng)
        for frame in range(20):
            for _ in range(20):
                body.step(nothing)
            writer.add_frame(handle, 20 * DT * (frame + 1), body.x)
        writer.end_trajectory(handle)

# 2. Train bounds that read a few vertices of the surface instead of all.
tree = nbd.train(beam, folder / "springs.h5", ["learned_affine"], seed=1)
print(tree.tree)

# 3. Two bodies collide; penalty forces push near vertices apart. Exact boxes check the learned ones.
bodies = [Springs(beam.X, nothing), Springs(beam.X + [0.1, 0.05, 0.45], nothing + [0, 0, -2.0])]
learned = [nbd.PosedTree(tree.tree, "learned_affine") for _ in bodies]
exact = [nbd.PosedTree(tree.tree, "boxes") for _ in bodies]
query = nbd.PairQuery()
data, indices, indptr = beam.W
rows = np.repeat(np.arange(len(indptr) - 1), np.diff(indptr))
THICKNESS, PENALTY = 0.02, 60.0
found = missed = 0
seconds = 0.0
for step in range(600):
    surfaces = [tree.surface_positions(body.x) for body in bodies]
    begin = time.perf_counter()
    for posed, surface in zip(learned, surfaces):
        posed.begin_pose(surface)
    near = query.within(learned[0], learned[1], THICKNESS)
    seconds += time.perf_counter() - begin
    if step % 10 == 0:
        for posed, surface in zip(exact, surfaces):
            posed.begin_pose(surface)
        all_near = query.within(exact[0], exact[1], THICKNESS)
        found += len(all_near)
        missed += len({tuple(p) for p in all_near} - {tuple(p) for p in near})
    forces = [nothing.copy(), nothing.copy()]
    if len(near):
        centres = [surfaces[b][beam.F[near[:, b]]].mean(axis=1) for b in (0, 1)]
        way = centres[1] - centres[0]
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-9)[:, None]
        for b, sign in ((0, -PENALTY), (1, PENALTY)):
            on_surface = np.zeros(surfaces[b].shape)
            np.add.at(on_surface, beam.F[near[:, b]].ravel(), np.repeat(sign * THICKNESS * way / 3, 3, axis=0))
            np.add.at(forces[b], indices, data[:, None] * on_surface[rows])  # the transpose of W
    for body, force in zip(bodies, forces):
        body.step(force)
print(f"queries with learned bounds: {1e6 * seconds / 600:.0f} us a step")
print(f"missed {missed} of {found} near face pairs in 60 checked poses")
speeds = [float(body.v[:, 2].mean()) for body in bodies]
print(f"mean velocities along z afterwards: {speeds[0]:.2f} and {speeds[1]:.2f} m/s")
if found == 0 or not speeds[0] < -0.3:
    sys.exit("the bodies did not meet")
