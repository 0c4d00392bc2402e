"""`nbdtree inspect --check` on files with seeded defects: one clear line each, exit status 1."""

import os
import shutil
import subprocess

import numpy as np
import pytest
from conftest import refused

h5py = pytest.importorskip("h5py")

import nbdtree as nbd


@pytest.fixture(scope="module")
def whole(program, beam, tree_file, tmp_path_factory):
    """A folder with a body, a dataset with everything that frames can hold, and a tree."""
    folder = tmp_path_factory.mktemp("whole")
    nbd.save_body(folder / "beam.h5", beam)
    nbd.make_dataset(
        beam, folder / "data.h5", trajectories=10, frames=6, per_shard=5, seed=2, hold_out="kind=thrown",
        contact_forces=True, stress=True, deformation_gradients=True, contact_edges=True,
    )
    nbd.save_tree(folder / "tree.h5", tree_file)
    return folder


@pytest.fixture
def check(program):
    def run(path, *options):
        return subprocess.run([program, "inspect", "--check", path, *options], capture_output=True, text=True)

    return run


SHARD = "data.shards/000000-000004.h5"
THREE = "trajectories/000003"


def edit(name, change):
    """A defect: `change` of the open file of this name."""

    def seed(folder):
        with h5py.File(folder / name, "r+") as file:
            change(file)

    return seed


def put(group, name, values):
    """Stores a dataset anew, with the attributes that it had."""
    attributes = dict(group[name].attrs)
    del group[name]
    group[name] = values
    group[name].attrs.update(attributes)


def set_value(name, dataset, place, value):
    return edit(name, lambda file: file[dataset].__setitem__(place, value))


def replace(name, dataset, change):
    return edit(name, lambda file: put(file, dataset, change(file[dataset][:])))


def set_text(name, dataset, old, new):
    def change(text):
        assert old in text[0].decode()
        return np.array([text[0].decode().replace(old, new, 1).encode()])

    return replace(name, dataset, change)


def set_attribute(name, item, attribute, value):
    return edit(name, lambda file: file[item].attrs.modify(attribute, value))


def remove(name, item):
    return edit(name, lambda file: file.pop(item))


def truncate(name):
    return lambda folder: os.truncate(folder / name, (folder / name).stat().st_size * 2 // 3)


def flip_a_byte(folder):
    """Of the stored positions of a trajectory."""
    with h5py.File(folder / SHARD) as file:
        place = file[f"{THREE}/positions"].id.get_chunk_info(0).byte_offset + 100
    data = bytearray((folder / SHARD).read_bytes())
    data[place] ^= 1
    (folder / SHARD).write_bytes(data)


def hold_out_a_training_trajectory(file):
    """In both parts."""
    split = file["dataset/split"]
    put(split, "held_out", np.sort(np.append(split["held_out"][:], split["train"][0])).astype(np.int32))


def train_on_what_the_rule_holds_out(file):
    split = file["dataset/splits/parameter"]
    held, train = split["held_out"][:], split["train"][:]
    put(split, "held_out", held[1:])
    put(split, "train", np.sort(np.append(train, held[0])).astype(np.int32))


def with_another_first_digit(text):
    digits = text[0].decode()
    return np.array([(("1" if digits[0] == "0" else "0") + digits[1:]).encode()])


def add_edge(row, last=True):
    """Replaces the last or the first contact edge of the first trajectory that has any."""

    def seed(folder):
        for shard in sorted((folder / "data.shards").glob("*.h5")):
            with h5py.File(shard, "r+") as file:
                for trajectory in file["trajectories"].values():
                    if len(trajectory["contact_edges"]):
                        trajectory["contact_edges"][-1 if last else 0] = row
                        return
        raise AssertionError("nothing touches")

    return seed


DATASET = [
    ("a position that is not a number", set_value(SHARD, f"{THREE}/positions", (2, 7, 1), np.nan),
     "node 7 in frame 2 of trajectory 3 is not finite"),
    ("a stress that is not finite", set_value(SHARD, f"{THREE}/first_piola_stress", (1, 9, 0, 0), np.inf),
     "first_piola_stress of tetrahedron 9 in frame 1 of trajectory 3 is not finite"),
    ("a contact force that is not finite", set_value(SHARD, f"{THREE}/contact_forces", (3, 4, 2), -np.inf),
     "contact_forces of node 4 in frame 3 of trajectory 3 is not finite"),
    ("a deformation gradient that is not a number",
     set_value(SHARD, f"{THREE}/deformation_gradients", (5, 8, 2, 1), np.nan),
     "deformation_gradients of tetrahedron 8 in frame 5 of trajectory 3 is not finite"),
    ("times that do not grow", set_value("data.h5", f"{THREE}/times", 4, 0.0), f"frame 4 of '{THREE}' has time 0 s"),
    ("times that are not those of the shard", set_value("data.h5", f"{THREE}/times", 5, 1e6),
     "trajectory 3 differs from its shard"),
    ("another body", set_attribute("data.h5", THREE, "body_sha256", np.bytes_("0" * 64)),
     "trajectory 3 is of body 0000000000000000"),
    ("a distance of edges that is not the shard's",
     set_attribute("data.h5", f"{THREE}/contact_edges", "distance", 0.5), "trajectory 3 differs from its shard"),
    ("a field that only the shard has", remove("data.h5", f"{THREE}/contact_forces"),
     "trajectory 3 differs from its shard"),
    ("a rule that is no text", set_text("data.h5", "dataset/splits/parameter/rule", '"rule":"kind=thrown"', '"rule":5'),
     "is not as nbdtree writes it"),
    ("a shard elsewhere", set_text("data.h5", "dataset/shards", "  data.shards", "  ../data.shards"),
     "outside of the folder of the file"),
    ("a shard of another dataset", set_attribute(SHARD, "/", "dataset", np.bytes_("0" * 64)),
     "belongs to another dataset"),
    ("a missing shard", lambda folder: (folder / SHARD).unlink(), "no such file"),
    ("a wrong checksum in the manifest", replace("data.h5", "dataset/shards", with_another_first_digit),
     "as in the manifest"),
    ("a damaged chunk", flip_a_byte, f"dataset '/{THREE}/positions' is damaged"),
    ("a truncated dataset", truncate("data.h5"), "is truncated or damaged"),
    ("a truncated shard", truncate(SHARD), "is truncated or damaged"),
    ("an id twice", set_attribute("data.h5", THREE, "id", 2), "has id 2, which another trajectory has too"),
    ("an id that is not the group's", set_attribute("data.h5", THREE, "id", 33), f"group '{THREE}' has trajectory 33"),
    ("a trajectory in both parts", edit("data.h5", hold_out_a_training_trajectory), "twice; allowed: each in one part"),
    ("a split that names no trajectory", set_value("data.h5", "dataset/split/train", -1, 99), "names trajectory 99"),
    ("a split that lacks one", replace("data.h5", "dataset/split/train", lambda ids: ids[1:]), "' lacks trajectory"),
    ("a split against its rule", edit("data.h5", train_on_what_the_rule_holds_out), "which its rule kind=thrown holds out"),
    ("another rule", set_text("data.h5", "dataset/splits/parameter/rule", "kind=thrown", "kind=drop"),
     "split 'parameter'"),
    ("another plan", set_text("data.h5", "dataset/plan", '"frames": 6', '"frames": 7'),
     "the key of the dataset"),
    ("positions of the wrong shape", replace(SHARD, f"{THREE}/positions", lambda x: x[:, :, :2]), "; allowed: 6 x "),
    ("times of the wrong type", replace("data.h5", f"{THREE}/times", np.float32), "holds float32; allowed: float64"),
    ("edges of a negative face", add_edge((-1, -1, 0), last=False), "contact edge (-1, -1, 0); allowed: faces from 0"),
    ("edges of an unknown trajectory", add_edge((10**6, 77, 0)), "allowed: trajectories of the file"),
    ("edges of an unknown obstacle", add_edge((10**6, -9, -1)), "touches obstacle 7"),
    ("offsets of edges that fall", set_value("data.h5", f"{THREE}/contact_edge_offsets", 1, 10**9), "ascend"),
    ("a newer version", set_attribute("data.h5", "/", "format_version", 9), "version 9"),
    ("a shard of a newer version", set_attribute(SHARD, "/", "format_version", 9), "version 9"),
    ("another format", set_attribute("data.h5", "/", "format", np.bytes_("somebody's")), "format 'somebody's'"),
]


BODY = [
    ("connectivity out of range", set_value("beam.h5", "tets/cells", (5, 2), 10**6), "tetrahedron 5 refers to node 1000000"),
    ("a face out of range", set_value("beam.h5", "surface/faces", (7, 0), -1), "face 7 refers to vertex -1"),
    ("an inverted tetrahedron", replace("beam.h5", "tets/cells", lambda T: np.vstack([T[:1, [1, 0, 2, 3]], T[1:]])),
     "tetrahedron 0 has volume -"),
    ("a negative mass", set_attribute("beam.h5", "material", "density", -1000.0), "density"),
    ("a node that is not a number", set_value("beam.h5", "tets/nodes", (3, 0), np.nan), "node 3 is not finite"),
    ("a moved node", set_value("beam.h5", "surface/vertices", (3, 0), 99.0), "surface vertex 3 lies"),
    ("another hash", set_attribute("beam.h5", "/", "body_sha256", np.bytes_("0" * 64)), "SHA-256 of the content"),
]

TREE = [
    ("a face out of range", set_value("tree.h5", "topology/faces", 0, 10**6),
     "lists face 1000000, but the surface has 1504 faces"),
    ("a negative margin", set_value("tree.h5", "calibration/learned_affine/margins", 0, -1.0), "margin"),
    ("weights that do not sum to 1", set_value("tree.h5", "embedding/values", 0, 9.0), "weights of vertex"),
]


@pytest.mark.parametrize("file,what,seed,text",
                         [(file, *case) for file, cases in (("data.h5", DATASET), ("beam.h5", BODY), ("tree.h5", TREE))
                          for case in cases], ids=lambda value: value if isinstance(value, str) else "")
def test_a_defect_is_one_clear_line(whole, check, tmp_path, file, what, seed, text):
    folder = tmp_path / "seeded"
    shutil.copytree(whole, folder)
    seed(folder)
    with refused(RuntimeError, text) as error:
        nbd.check_file(folder / file)
    assert str(error.value).startswith(str(folder))
    if what in (DATASET[0][0], BODY[0][0], TREE[0][0]):  # the command says the same
        ran = check(folder / file)
        assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", f"nbdtree: error: {error.value}\n")


def test_whole_files_pass(whole, check, poses):
    for name, text in [("beam.h5", "this body: "), ("data.h5", "this dataset: 10 trajectories of 60 frames, 2 shards, 2 splits"),
                       (SHARD, "this recording: 5 trajectories"), ("tree.h5", "this tree: ")]:
        ran = check(whole / name, "--body", whole / "beam.h5")
        assert ran.returncode == 0, ran.stderr
        assert f"{whole / name}: no defect found in {text}" in ran.stdout
    assert nbd.check_file(poses).count("1 split") == 1


def test_files_of_another_body_are_refused(whole, check, assets, tmp_path):
    other, flat = tmp_path / "block.h5", tmp_path / "tree.nbd"
    nbd.save_body(other, nbd.mesh_file(assets / "block.mesh"))
    nbd.save_flat_tree(flat, nbd.load_tree(whole / "tree.h5").tree)
    assert check(flat, "--body", whole / "beam.h5").returncode == 0
    for path, text in [*((whole / name, f"which is {other}") for name in ("data.h5", "tree.h5", "beam.h5")),
                       (flat, f"allowed: that of {other}")]:
        ran = check(path, "--body", other)
        assert ran.returncode == 1 and text in ran.stderr, ran.stderr


def test_faces_beyond_the_body_are_refused(whole, check, beam, tmp_path):
    """A face out of range shows only beside the body."""
    shutil.copytree(whole, tmp_path / "seeded")
    add_edge((len(beam.F), -1, len(beam.F)))(tmp_path / "seeded")
    ran = check(tmp_path / "seeded" / "data.h5", "--body", whole / "beam.h5")
    assert ran.returncode == 1 and f"allowed: faces 0 to {len(beam.F) - 1}" in ran.stderr
