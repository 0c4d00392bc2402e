"""Reads a body, a recording, the dataset that contains it, and a tree as a user would, and checks their content.

Usage: read_with_h5py.py BODY RECORDING DATASET TREE BODY_SHA256 NBD_U_7_2 BD_UBAR_1_3
"""
import hashlib
import json
import sys

import h5py
import numpy as np

body_path, recording_path, dataset_path, tree_path, body_sha256 = sys.argv[1:6]
nbd_u, bd_ubar = map(np.float32, sys.argv[6:8])


def text(item, name):
    """Decodes an attribute; texts have a fixed length in the file, so h5py returns bytes."""
    return item.attrs[name].decode()


with h5py.File(body_path) as body:
    assert text(body, "format") == "nbdtree body"
    assert body.attrs["format_version"] == 2 and text(body, "units") == "m, s, kg"
    assert text(body, "body_sha256") == body_sha256
    assert body["tets/nodes"].dtype == np.float64 and body["tets/cells"][:].tolist() == [[0, 1, 2, 3]]
    assert body["tets/nodes"].fletcher32 and body["tets/cells"].fletcher32
    assert body["material"].attrs["density"] == 1000 and text(body["material"], "law") == "corotated"
    indptr, indices, weights = (body["embedding"][k][:] for k in ("rows", "cols", "values"))
    for v, (begin, end) in enumerate(zip(indptr, indptr[1:])):
        x = weights[begin:end] @ body["tets/nodes"][:][indices[begin:end]]
        assert np.allclose(x, body["surface/vertices"][v])
    digest = hashlib.sha256()
    for name in text(body, "body_sha256_of").split():
        data = body[name]
        digest.update(f"{name} {data.dtype} {' x '.join(map(str, data.shape))}\n".encode())
        digest.update(data[:].tobytes())
    assert digest.hexdigest() == body_sha256


def check_trajectory(recording):
    assert text(recording, "format") == "nbdtree recording"
    (trajectory,) = recording["trajectories"].values()
    assert trajectory.name == "/trajectories/000004"
    assert (trajectory.attrs["id"], trajectory.attrs["seed"]) == (4, 9)
    assert text(trajectory, "body_sha256") == body_sha256
    assert text(trajectory, "failure") == "exploded"
    assert json.loads(trajectory["recipe"][0]) == {"drop": 1}
    positions = trajectory["positions"]
    assert positions.shape == (70, 4, 3) and positions.dtype == np.float32
    assert positions[66, 3].tolist() == [0, 0, 66]
    assert trajectory["times"][:].tolist() == [0.5 * i for i in range(70)]
    assert trajectory["contacts"][:].tolist() == [5] * 70
    return positions


with h5py.File(recording_path) as recording:
    assert text(recording, "body_sha256") == body_sha256
    assert check_trajectory(recording).fletcher32

with h5py.File(dataset_path) as dataset:
    positions = check_trajectory(dataset)
    assert positions.is_virtual and positions.virtual_sources()[0].file_name == "shard.h5"
    assert json.loads(dataset["dataset/plan"][0])["frames"] == 70
    assert dataset["dataset/shards"][0].decode() == "e" * 64 + "  shard.h5\n"
    assert dataset["dataset/split/train"][:].tolist() == [4]

with h5py.File(tree_path) as tree:
    assert text(tree, "format") == "nbdtree tree"
    assert tree["nbd/modes/U"][7, 2] == nbd_u
    assert tree["bd/modes/U"][7, 2] == nbd_u  # a link to the same dataset
    assert tree["bd/Ubar"][1, 3] == bd_ubar
    assert tree["topology/nodes"].shape == (15, 6) and tree["topology/nodes"][0, 0] == 1
    assert json.loads(tree["facts/config"][0])["modes"] == 128
    assert tree["facts"].attrs["poses"] == 1234
