"""Makes a dataset, trains a tree with learned bounds on it, and counts where they miss.

    python3 3_train_a_tree.py [folder]
"""

import pathlib
import sys

import nbdtree as nbd

assets = pathlib.Path(__file__).resolve().parents[3] / "assets"
folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "trained")
folder.mkdir(exist_ok=True)

beam = nbd.mesh_file(assets / "beam.obj")
nbd.save_body(folder / "beam.h5", beam)

# Each trajectory drops, throws, pulls or bends the body in its own way; the seed fixes all of them.
nbd.make_dataset(beam, folder / "poses.h5", trajectories=24, frames=12, seed=1)
poses = nbd.RecordingReader(folder / "poses.h5")
print(f"{poses.frames} poses in {len(poses.trajectories)} trajectories")

# Trains on most trajectories, calibrates margins on others, and never looks at the held out ones.
tree = nbd.train(beam, folder / "poses.h5", ["learned_affine"], seed=1)
nbd.save_tree(folder / "tree.h5", tree)
print(tree.tree)
for name, stated in tree.tree.calibrations.items():
    print(f"{name}: {100 * stated['confidence']:.0f} % of trajectories are to miss at most {stated['miss_rate']:.1%}")

# Of poses that training did not see: how far off the boxes are, and how many nodes miss.
print("bounds           level  radius error  nodes that miss, without margins")
for row in nbd.evaluate(tree, folder / "poses.h5", ["learned_affine"], margins=[0.0]):
    if row.frames == "held-out trajectories":
        print(f"{row.bound:16} {row.depth:5}  {row.radius_error:12.2%}  {row.nodes_missing:8.2%}")

# With margins, in collisions between pairs of held out poses: which face pairs do learned bounds miss?
held_out = [i for i, t in enumerate(poses.trajectories) if t.id in tree.facts["held_out_trajectories"]]
query = nbd.PairQuery()
touching = missed = 0
for i in held_out:
    for j in held_out:
        if i == j:
            continue
        xa, xb = (tree.surface_positions(poses.read(k, 10, 1)[0]) for k in (i, j))
        pairs = []
        for bounds in ("boxes", "learned_affine"):
            a, b = nbd.PosedTree(tree.tree, bounds), nbd.PosedTree(tree.tree, bounds)
            a.begin_pose(xa)
            b.begin_pose(xb)
            pairs.append({tuple(pair) for pair in query.intersecting(a, b)})
        touching += len(pairs[0])
        missed += len(pairs[0] - pairs[1])
print(f"learned_affine missed {missed} of {touching} intersecting face pairs")
