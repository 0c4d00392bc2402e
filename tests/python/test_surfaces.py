import numpy as np
import pytest
from conftest import refused

import nbdtree as nbd

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


def test_a_surface_is_filled_and_keeps_its_vertices(assets):
    surface = nbd.read_surface(assets / "gear.obj")
    solid, about = nbd.make_solid_boundary(surface)
    tets = nbd.tetrahedralize(solid)
    assert "faces" in about
    assert len(tets.T) > len(solid.F) / 2
    assert np.array_equal(tets.X[: len(solid.X)], solid.X)
    edges = tets.X[tets.T[:, 1:]] - tets.X[tets.T[:, :1]]
    assert np.linalg.det(edges).min() > 0


def test_written_surfaces_are_read_back(tmp_path):
    mesh = nbd.TriMesh(*TETRAHEDRON)
    nbd.write_surface(tmp_path / "t.obj", mesh)
    again = nbd.read_surface(tmp_path / "t.obj")
    # Vertices are numbered as the faces name them.
    assert np.array_equal(again.X[again.F], mesh.X[mesh.F])


def test_subdivision_makes_four_of_each_face():
    fine = nbd.subdivide(nbd.TriMesh(*TETRAHEDRON), levels=2)
    assert len(fine.F) == 16 * 4


def test_a_body_of_cubes_has_the_right_weights(beam):
    data, indices, indptr = beam.W
    assert len(indptr) == len(beam.surface_X) + 1
    x = beam.surface_positions(beam.X + [1, 2, 3])
    assert np.allclose(x, beam.surface_X + [1, 2, 3], atol=1e-9)
    assert np.allclose(np.add.reduceat(data, indptr[:-1]), 1)
    assert indices.max() < len(beam.X)


def test_modes_are_orthonormal_in_the_mass_matrix(beam):
    modes = nbd.vibration_modes(beam, 10)
    assert modes.U.shape == (3 * len(beam.X), 10)
    assert np.all(np.diff(modes.frequencies) >= 0) and modes.frequencies[0] > 1
    assert modes.max_residual < 1e-6
    assert beam.modes is None
    U, frequencies = beam.with_modes(modes).modes
    assert np.array_equal(U, modes.U) and np.array_equal(frequencies, modes.frequencies)


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: nbd.TriMesh([[0, 0]], [[0, 0, 0]]), "X: is "),
        (lambda: nbd.TriMesh("abc", [[0, 0, 0]]), "X: is "),
        (lambda: nbd.TriMesh(TETRAHEDRON[0], [[0, 1, 4]]), "F: index 4 is not in 0..3"),
        (lambda: nbd.TriMesh(TETRAHEDRON[0], [[0, 1, 2.5]]), "F: is float64"),
        (lambda: nbd.TriMesh(TETRAHEDRON[0], [[0, 1, 2**40]]), "F: 1099511627776 is too large"),
        (lambda: nbd.make_solid_boundary(nbd.TriMesh(TETRAHEDRON[0], TETRAHEDRON[1][:3])), "open"),
        (lambda: nbd.subdivide(nbd.TriMesh(*TETRAHEDRON), scheme="butterfly"), 'scheme: is "butterfly"'),
        (lambda: nbd.Material(young=-1), "Young's modulus is -1"),
        (lambda: nbd.Material(law="steel"), 'law: is "steel"'),
    ],
)
def test_bad_input_is_refused_with_one_line(make, text):
    with refused(ValueError, text):
        make()


@pytest.mark.parametrize(
    "options, text",
    [
        ({"cage": 200, "nodes": 5000}, "cage: excludes nodes, grading, edge and error"),
        ({"edge": 0.1, "nodes": 5000}, "edge: excludes nodes and error"),
        ({"edge": -1.0}, "edge: is -1; allowed: more than 0"),
        ({"elements": "cubic"}, 'elements: is "cubic"; allowed: linear, quadratic'),
        ({"cage": -3}, "cage: is -3"),
        ({"cage": 200, "inside": "x.h5"}, "cage: excludes inside"),
        ({"inside": "x.h5", "material": nbd.Material(young=5)}, "a body that has a material: excludes material"),
    ],
)
def test_options_of_meshing_that_contradict_are_refused(assets, options, text):
    with refused(ValueError, text):
        nbd.mesh_file(assets / "beam.obj", **options)


def test_materials_are_compared():
    assert nbd.Material(young=2e5) == nbd.Material(young=2e5) != nbd.Material()
    assert nbd.Material() != 3 and nbd.Material() is not None


def test_files_that_are_not_there_are_named(tmp_path):
    for read in (nbd.read_surface, nbd.read_tets, nbd.load_body, nbd.load_tree, nbd.load_flat_tree,
                 nbd.RecordingReader, nbd.mesh_file):
        with refused(RuntimeError, "none.obj"):
            read(tmp_path / "none.obj")


@pytest.fixture(scope="module")
def scan(assets):
    """A beam with a hole, a face twice, a flat face and a vertex that no face uses."""
    beam = nbd.read_surface(assets / "beam.obj")
    return nbd.TriMesh(np.vstack([beam.X, [[9, 9, 9]]]), np.vstack([beam.F[1:], beam.F[1:2], [[5, 5, 6]]]))


def test_a_scan_is_caged_and_its_defects_are_told(scan):
    body, report = nbd.make_cage_body("scan", scan, 300, nbd.Material(young=2e5))
    assert len(body.X) == pytest.approx(300, rel=0.1) and body.name == "scan" and body.material.young == 2e5
    defects = report.defects
    assert defects["open_edges"] > 0 and defects["duplicate_faces"] == 1 and defects["repeating_faces"] == 1
    assert defects["unreferenced_vertices"] == 1 and 0 < report.distance < 1 and report.tets_optimised >= 0
    quality = nbd.tet_quality(body.tets)
    edges = body.X[body.T[:, 1:]] - body.X[body.T[:, :1]]
    assert report.volume == pytest.approx(quality.volume) == pytest.approx(np.linalg.det(edges).sum() / 6)
    assert quality.tets == len(body.T) == sum(quality.radius_ratio_histogram)
    assert quality.poor == quality.radius_ratio_histogram[0] or quality.poor > 0
    assert 0 < quality.radius_ratio_min <= quality.radius_ratio_mean <= 1
    assert "cage:" in str(report) and len(str(quality).splitlines()) > 3
    # The surface lies in the cage: rigid motions carry it, and all weights are >= 0.
    assert np.allclose(body.surface_positions(body.X + 1), body.surface_X + 1, atol=1e-9)
    assert body.W[0].min() >= 0 and len(body.F) == len(scan.F) - 1


def test_cages_that_cannot_be_are_refused(scan):
    for nodes, surface, text in [(10, scan, "a cage of 10 nodes; allowed: 50 to 200000"),
                                 (100, nbd.TriMesh(np.zeros((3, 3)), [[0, 1, 2]]), "")]:
        with refused(ValueError, text):
            nbd.make_cage_body("x", surface, nodes)
    with refused(ValueError, "name: has a control character; allowed: one line of text", whole=True):
        nbd.make_cage_body("a\nb", scan, 100)


def test_devices_and_folders_are_not_written_over(beam, tree_file, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to("/dev/null")
    saves = [lambda path: nbd.save_body(path, beam), lambda path: nbd.save_tree(path, tree_file),
             lambda path: nbd.save_flat_tree(path, tree_file.tree), nbd.RecordingWriter,
             lambda path: nbd.write_surface(path, beam.surface)]
    for save in saves:
        for path, text in [("folder", "it is a folder"), ("link", "it is not an ordinary file"), ("no/x", "there is no folder")]:
            with refused(RuntimeError, text):
                save(tmp_path / path)
    assert (tmp_path / "link").is_symlink() and not (tmp_path / "folder").is_file()


def test_quadratic_tetrahedra_have_nodes_of_edges_and_carry_a_world(assets):
    body = nbd.mesh_file(assets / "beam.obj", edge=0.1, elements="quadratic")
    assert body.E.shape == (len(body.T), 6) and len(body.X) == body.tets.E.max() + 1 or len(body.X) == body.T.max() + 1
    middles = (body.X[body.T[:, 0]] + body.X[body.T[:, 1]]) / 2
    assert np.allclose(body.X[body.E[:, 0]], middles)
    linear = nbd.tetrahedralize(nbd.TriMesh(body.surface_X, body.F))
    assert linear.E.shape == (0, 6) and len(nbd.make_quadratic(linear).E) == len(linear.T)
    world = nbd.World({"bodies": [{"body": body}], "time": {"dt": 1e-2}})
    start = world.positions()[:, 2].mean()
    for _ in range(10):
        world.step()
    assert np.isclose(world.positions()[:, 2].mean() - start, -9.81 * 0.1**2 / 2, rtol=0.1)
