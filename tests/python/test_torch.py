"""Datasets for PyTorch, and the graph network of the worked example."""

import json
import pathlib
import pickle
import sys

import numpy as np
import pytest
from conftest import folded, refused

torch = pytest.importorskip("torch")

import nbdtree as nbd
import nbdtree.torch

LEARNING = pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "learning"


def test_windows_are_the_frames_of_the_recording(beam, poses):
    reader, manifest = nbd.RecordingReader(poses), nbd.dataset_manifest(poses)
    sizes = {}
    for part in ("train", "held_out", "all"):
        data = nbdtree.torch.Dataset(poses, beam, window=4, part=part)
        sizes[part] = len(data)
        ids = {reader.trajectories[data[i]["trajectory"]].id for i in range(len(data))}
        assert part == "all" or ids == set(manifest[f"{part}_trajectories"])
        for i in (0, len(data) // 2, len(data) - 1):
            item = data[i]
            expected = reader.read(item["trajectory"], item["frame"], 4)
            assert item["x"].dtype == torch.float32 and np.array_equal(item["x"].numpy(), expected)
            assert np.array_equal(item["times"], reader.times(item["trajectory"])[item["frame"] :][:4])
    complete = [t for t in reader.trajectories if not t.failure]
    assert sizes["all"] == sum(t.frames - 3 for t in complete) == sizes["train"] + sizes["held_out"]
    assert sizes["held_out"] > 0


def test_edges_are_those_of_the_tetrahedra(beam, poses):
    edges = nbdtree.torch.Dataset(poses, beam).edges
    found = {tuple(edge) for edge in edges.T.tolist()}
    assert found == {(int(t[i]), int(t[j])) for t in beam.T for i in range(4) for j in range(4) if i != j}


def test_contacts_are_those_of_the_surface(assets, tmp_path):
    """A beam that is folded until its halves touch, in the second of two frames."""
    body = nbd.mesh_file(assets / "beam.obj")
    with nbd.RecordingWriter(tmp_path / "fold.h5") as writer:
        handle = writer.begin_trajectory(len(body.X), 0, body_hash=body.hash)
        for time, frame in enumerate((body.X, folded(body.X))):
            writer.add_frame(handle, time, frame)
    data = nbdtree.torch.Dataset(tmp_path / "fold.h5", body, window=2, part="all", contact_distance=0.01)
    none, some = data[0]["contacts"]
    assert len(none) == 0 and len(some) > 0
    surface = body.surface_positions(folded(body.X))
    a, b = (surface[body.F[some[:, k]]].mean(axis=1) for k in (0, 1))
    assert np.linalg.norm(a - b, axis=1).max() < 0.3


def test_workers_read_the_same(beam, beam_file, poses):
    data = nbdtree.torch.Dataset(poses, beam_file, window=3)
    direct = [data[i]["x"].sum().item() for i in range(len(data))]
    for context in ("fork", "spawn"):
        loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=2, multiprocessing_context=context)
        assert [item["x"].sum().item() for item in loader] == direct, context
    with refused(TypeError, "name the file of the body"):
        pickle.dumps(nbdtree.torch.Dataset(poses, beam))


def test_statistics_are_of_the_training_part_alone(beam, tmp_path):
    """What is held out may change: the statistics do not, whatever part asks for them."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "data.h5"
    nbd.make_dataset(beam, path, trajectories=8, frames=3, seed=4, hold_out="kind=drop,thrown")
    for split in ("trajectories", "parameter"):
        manifest = nbd.dataset_manifest(path)["splits"][split]

        def found(part):
            return nbdtree.torch.Dataset(path, beam, part=part, split=split).statistics(windows=10**6)

        data = nbdtree.torch.Dataset(path, beam, part="train", split=split)
        x = torch.stack([data[i]["x"] for i in range(len(data))])
        before = found("train")
        assert before["velocity_std"] == pytest.approx((x[:, 1:] - x[:, :-1]).std().item(), rel=1e-5)
        assert before == found("held_out") == found("all")

        def disturb(ids):
            for shard in (tmp_path / "data.shards").glob("*.h5"):
                with h5py.File(shard, "r+") as file:
                    for id in ids:
                        file[f"trajectories/{id:06}/positions"][1::2] += 1

        disturb(manifest["held_out"])
        assert found("train") == before == found("held_out")
        disturb(manifest["train"][:1])
        assert found("train") != before


def test_parts_of_a_split_by_a_parameter_share_nothing(beam, tmp_path):
    path = tmp_path / "data.h5"
    nbd.make_dataset(beam, path, trajectories=12, frames=3, seed=5, hold_out="velocity_gradient=top:0.25")
    reader = nbd.RecordingReader(path)
    strains = {t.id: np.linalg.norm(json.loads(t.recipe)["velocity_gradient"]) for t in reader.trajectories}
    ids = {}
    for part in ("train", "held_out"):
        data = nbdtree.torch.Dataset(path, beam, part=part, split="parameter")
        ids[part] = {reader.trajectories[data[i]["trajectory"]].id for i in range(len(data))}
    assert ids["train"] and ids["held_out"] and not ids["train"] & ids["held_out"]
    weakest = min(strains[i] for i in ids["held_out"])
    assert max(strains[i] for i in ids["train"]) < weakest
    rule = nbd.dataset_manifest(path)["splits"]["parameter"]["rule"]
    assert rule["parameter"] == "velocity_gradient" and rule["to"] is None and rule["from"] == pytest.approx(weakest)
    card = (tmp_path / "data.shards" / "README.md").read_text()
    assert f"{len(ids['held_out'])} are held out, whose `velocity_gradient` is at least" in card
    tree = nbd.train(beam, path, ["learned_affine"], depth=3, split="parameter", calibration=0)
    assert set(tree.facts["held_out_trajectories"]) == ids["held_out"]
    with refused(RuntimeError, 'has no split "kinds"; allowed: trajectories, parameter'):
        nbd.train(beam, path, ["learned_affine"], depth=3, split="kinds")


def test_items_have_the_fields_and_contact_edges_of_the_file(beam, tmp_path):
    path = tmp_path / "data.h5"
    recipe = {"kinds": {"forces": {"weight": 0}, "grips": {"weight": 0}, "free": {"weight": 0}}}
    names = ("contact_forces", "first_piola_stress", "deformation_gradients")
    nbd.make_dataset(beam, path, trajectories=4, frames=8, seed=1, recipe=recipe, contact_forces=True, stress=True,
                     deformation_gradients=True, contact_edges=True)
    data = nbdtree.torch.Dataset(path, beam, window=3, part="all", fields=names)
    reader, touching = nbd.RecordingReader(path), 0
    for i in range(len(data)):
        item = data[i]
        for name in names:
            expected = reader.read_field(item["trajectory"], name, item["frame"], 3)
            assert item[name].dtype == torch.float32 and np.array_equal(item[name].numpy(), expected)
        assert item["first_piola_stress"].shape == (3, len(beam.T), 3, 3)
        edges = reader.contact_edges(item["trajectory"], item["frame"], 3)
        assert len(item["contact_edges"]) == 3
        for found, expected in zip(item["contact_edges"], edges):
            assert found.dtype == torch.int64 and np.array_equal(found.numpy(), expected)
            touching += len(found)
    assert touching > 100
    with refused(ValueError, "has no stress"):
        nbdtree.torch.Dataset(path, beam, fields=["stress"])


def test_bad_arguments_are_refused(assets, beam, poses):
    other = nbd.mesh_file(assets / "block.mesh")
    for call, text in [
        (lambda: nbdtree.torch.Dataset(poses, beam, part="test"), 'part: is "test"'),
        (lambda: nbdtree.torch.Dataset(poses, beam, window=0), "window: is 0"),
        (lambda: nbdtree.torch.Dataset(poses, other), "is of another body"),
        (lambda: nbdtree.torch.Dataset(poses, beam, split="kinds"), 'split: is "kinds"; allowed: trajectories'),
    ]:
        with refused(ValueError, text):
            call()
    data = nbdtree.torch.Dataset(poses, beam)
    with pytest.raises(IndexError):
        data[len(data)]


def test_the_graph_network_turns_with_the_body(beam, poses):
    sys.path.insert(0, str(LEARNING))
    from graph_network import GraphNetwork

    torch.manual_seed(1)
    data = nbdtree.torch.Dataset(poses, beam, window=5)
    network = GraphNetwork(data.edges, data.rest, hidden=8, rounds=2)
    x = torch.stack([data[i]["x"] for i in (0, len(data) // 2)])[:, :4]
    turn, _ = torch.linalg.qr(torch.randn(3, 3))
    moved = network.predict(x @ turn.T + torch.tensor([1.0, 2.0, 3.0]))
    expected = network.predict(x) @ turn.T + torch.tensor([1.0, 2.0, 3.0])
    assert torch.allclose(moved, expected, atol=1e-4)
    assert not torch.allclose(network.predict(x), x[:, 3], atol=1e-3)
    loss = network.predict(x).square().mean()
    loss.backward()
    assert all(p.grad is not None and torch.isfinite(p.grad).all() for p in network.parameters())


def test_the_graph_of_quadratic_tetrahedra_has_all_nodes(assets):
    """A node lies in the middle of each edge: the graph goes from there to both ends, so each pair once each way."""
    body = nbd.mesh_file(assets / "beam.obj")
    edges = nbdtree.torch.mesh_edges(body.T, body.E).numpy()
    assert set(edges.ravel()) == set(range(len(body.X)))
    assert edges.shape[1] == 4 * len(set(body.E.ravel()))
    middles = np.isin(edges[0], body.E)
    assert (middles != np.isin(edges[1], body.E)).all()
    to = {node: edges[1][edges[0] == node] for node in set(body.E.ravel())}
    assert all(np.allclose(body.X[ends].mean(axis=0), body.X[node], atol=1e-9) for node, ends in to.items())
