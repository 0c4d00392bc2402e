"""What frames of datasets and runs hold on request: stress, deformation gradients, contact forces and edges."""

import json

import numpy as np
import pytest

h5py = pytest.importorskip("h5py")

import nbdtree as nbd

FIELDS = ("contact_forces", "first_piola_stress", "deformation_gradients")
OPTIONS = ("--contact-forces", "--stress", "--deformation-gradients", "--contact-edges")
CONTACT = {"kinds": {"forces": {"weight": 0}, "grips": {"weight": 0}, "free": {"weight": 0}}}


@pytest.fixture(scope="module")
def data(command, beam, tmp_path_factory):
    """A dataset made by the command in shards, with everything."""
    folder = tmp_path_factory.mktemp("extras")
    nbd.save_body(folder / "beam.h5", beam)
    (folder / "contact.json").write_text(json.dumps(CONTACT))
    for name, options in (("data.h5", OPTIONS), ("plain.h5", ())):
        command("dataset", "beam.h5", "--recipe", "contact.json", "--trajectories", 5, "--per-shard", 2, "--frames", 8,
                "-o", name, *options, cwd=folder)
    return folder / "data.h5"


def rotations(F):
    U, _, Vt = np.linalg.svd(F)
    U[..., -1] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    return U @ Vt


def test_extras_change_nothing_else(data):
    plain = data.parent / "plain.h5"
    with h5py.File(data) as more, h5py.File(plain) as less:
        assert len(less["trajectories"]) == 5
        for name, trajectory in less["trajectories"].items():
            for item in trajectory:
                assert np.array_equal(trajectory[item][()], more["trajectories"][name][item][()]), item
        assert np.array_equal(less["dataset/split/train"], more["dataset/split/train"])
        assert "extras" not in json.loads(less["dataset/plan"][0]) and "hold_out" not in json.loads(less["dataset/plan"][0])
    assert nbd.RecordingReader(plain).extras(0) == []


def test_merged_datasets_have_what_their_shards_have(data):
    reader, merged = nbd.RecordingReader(data), h5py.File(data)
    assert reader.extras(0) == [*FIELDS, "contact_edges"]
    shards = sorted((data.parent / "data.shards").glob("*.h5"))
    assert len(shards) == 3
    for shard in shards:
        with h5py.File(shard) as file:
            for name, trajectory in file["trajectories"].items():
                view = merged["trajectories"][name]
                for field in (*FIELDS, "contact_edges"):
                    assert view[field].is_virtual and np.array_equal(view[field], trajectory[field])
                    assert trajectory[field].chunks is not None
                assert dict(view["contact_edges"].attrs) == dict(trajectory["contact_edges"].attrs)
                assert np.array_equal(view["contact_edge_offsets"], trajectory["contact_edge_offsets"])
                place = [t.id for t in reader.trajectories].index(int(name))
                for field in FIELDS:
                    assert np.array_equal(reader.read_field(place, field, 3, 5), trajectory[field][3:8])
    forces = np.concatenate([merged[f"trajectories/{t.id:06}/contact_forces"] for t in reader.trajectories])
    assert np.isfinite(forces).all() and np.abs(forces).max() > 0


def test_gradients_and_stresses_are_those_of_the_positions(data, beam):
    """F = dx/dX and, of the corotated law, P = 2 mu (F - R) + lambda tr(R^T F - I) R, from positions in float32."""
    reader = nbd.RecordingReader(data)
    young, poisson = 1e5, 0.4
    mu, lam = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    X, T = beam.X, beam.T
    rest = np.linalg.inv((X[T[:, 1:]] - X[T[:, :1]]).transpose(0, 2, 1))
    strained = 0
    for place in range(2):
        x = reader.read(place).astype(float)
        F = (x[:, T[:, 1:]] - x[:, T[:, :1]]).transpose(0, 1, 3, 2) @ rest
        found = reader.read_field(place, "deformation_gradients")
        assert np.abs(found - F).max() < 2e-4
        found = found.astype(float)
        R = rotations(found)
        trace = np.trace(R.swapaxes(-1, -2) @ found, axis1=-2, axis2=-1) - 3
        P = 2 * mu * (found - R) + lam * trace[..., None, None] * R
        upright = np.linalg.det(found) > 0.1
        stress = reader.read_field(place, "first_piola_stress")
        assert np.abs(stress - P)[upright].max() < 1e-4 * young
        strained += (np.abs(P).max(axis=(-1, -2)) > 0.05 * young).sum()
    assert strained > 100


def test_edges_name_what_touches(data, beam):
    """Floors are touched by faces with a vertex near them, the thrown copy by partner -1."""
    reader, kinds, partners = nbd.RecordingReader(data), set(), set()
    with h5py.File(data) as file:
        distance = file["trajectories/000000/contact_edges"].attrs["distance"]
    diagonal = np.linalg.norm(beam.surface_X.max(axis=0) - beam.surface_X.min(axis=0))
    assert distance == pytest.approx(0.001 * diagonal)
    floors = 0
    for place, info in enumerate(reader.trajectories):
        recipe = json.loads(info.recipe)
        kinds.add(recipe["kind"])
        for nodes, edges in zip(reader.read(place), reader.contact_edges(place)):
            partners |= set(edges[:, 1].tolist())
            assert "thrown" in recipe or -1 not in edges[:, 1]
            if "floor" not in recipe:
                assert not (edges[:, 1] < -1).any()
                continue
            z = beam.surface_positions(nodes)[beam.F][:, :, 2].min(axis=1) - recipe["floor"]
            found = np.isin(np.arange(len(beam.F)), edges[edges[:, 1] == -2, 0])
            sure = np.abs(z - distance) > 1e-5 * diagonal
            assert np.array_equal(found[sure], (z <= distance)[sure])
            floors += found.sum()
    assert kinds == {"drop", "thrown"} and {-1, -2} <= partners and floors > 0


def test_another_surface_keeps_all_but_the_edges(data, assets, command):
    """Stress and forces belong to the tetrahedra, edges to the faces of the surface."""
    command("mesh", assets / "beam.obj", "-o", "finer.h5", "--elements", "linear", "--subdivide", 1, cwd=data.parent)
    command("remap", "data.h5", "--from", "beam.h5", "--to", "finer.h5", "-o", "remapped.h5", cwd=data.parent)
    before, after = nbd.RecordingReader(data), nbd.RecordingReader(data.parent / "remapped.h5")
    for place in range(len(before.trajectories)):
        assert after.extras(place) == list(FIELDS)
        for field in FIELDS:
            assert np.array_equal(after.read_field(place, field), before.read_field(place, field))


def test_runs_of_scenes_have_them_too(command, assets, tmp_path):
    scene = {
        "bodies": [
            {"surface": str(assets / "beam.obj"), "transform": {"translate": [0, 0, z]}} for z in (0.061, 0.3)
        ],
        "obstacles": [{"plane": {"normal": [0, 0, 1]}}],
        "time": {"dt": 0.01, "frames": 25, "steps_per_frame": 1},
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    command("simulate", "scene.json", "-o", "run.h5", *OPTIONS, cwd=tmp_path)
    reader = nbd.RecordingReader(tmp_path / "run.h5")
    assert all(reader.extras(b) == [*FIELDS, "contact_edges"] for b in (0, 1))
    lower, upper = reader.contact_edges(0), reader.contact_edges(1)
    met = 0
    for a, b in zip(lower, upper):
        of_a = {(face, other) for face, partner, other in a.tolist() if partner == 1}
        of_b = {(other, face) for face, partner, other in b.tolist() if partner == 0}
        assert of_a == of_b
        met += len(of_a)
    assert met > 0 and any((a[:, 1] == -2).any() for a in lower)
    assert "no defect found" in nbd.check_file(tmp_path / "run.h5")
