"""The specification of the files, apps/docs/formats.md, against real files: each item of a file must be in it with
its type and shape, each item in it must be in a file, and a file has all items that go with those it has."""

import hashlib
import json
import pathlib
import re

import numpy as np
import pytest

h5py = pytest.importorskip("h5py")

import nbdtree as nbd

PAGE = pathlib.Path(__file__).resolve().parents[2] / "apps" / "docs" / "formats.md"

# Letters of shapes that belong to the group of their dataset, not to the file.
OF_GROUP = {"faces", "frames", "nodes", "tets", "edges", "train", "held_out", "bounds"}


def tables(heading):
    """The rows of the tables under a heading, as lists of cells."""
    rows, here = [], None
    for line in PAGE.read_text().splitlines():
        if line.startswith("#"):
            here = line.lstrip("# ")
        elif here == heading and re.match(r"\| (`|\w)", line) and not line.startswith(("| item ", "| file ")):
            rows.append([cell.strip() for cell in line.split("|")[1:-1]])
    return rows


def pattern(name):
    """Matches the name of an item or, with a slash at the end, of a group; a group of one capital letter stands for any."""
    return re.compile(re.sub(r"/([A-Z])(?=[/@])", r"/(?P<\1>[^/@]+)", re.escape(name)))


def filled(name, letters):
    """The name with its groups of one capital letter filled in."""
    return re.sub(r"/([A-Z])(?=[/@])", lambda letter: "/" + letters[letter[1]], name)


class Item:
    def __init__(self, cells):
        self.name, presence, self.type, self.shape = (cell.replace("`", "") for cell in cells[:4])
        self.presence, _, self.owner = presence.partition(" ")  # "with" its owner, an item or a group
        assert self.presence in ("always", "optional", "with") and bool(self.owner) == (self.presence == "with"), cells
        self.pattern = pattern(self.name)

    def dims(self):
        return [d.strip() for d in self.shape.strip("[]").split(",")] if self.shape else []


def items(*headings):
    return [Item(cells) for heading in headings for cells in tables(heading)]


def specified(kind):
    rules = items("Rules")
    if kind == "dataset":
        return rules + [i for i in items("Recording") if i.name.startswith("trajectories/")] + items("Dataset")
    return rules + items(kind.capitalize())


def type_name(dtype):
    return "text" if dtype.kind in "SO" else dtype.name


def contents(path):
    """All attributes and datasets of a file: name -> (type, shape); and its groups. Follows soft links."""
    found, groups = {}, []

    def walk(group, prefix):
        for name, value in group.attrs.items():
            found[f"{prefix.rstrip('/')}@{name}"] = type_name(group.attrs.get_id(name).dtype), ()
        for name, child in group.items():
            if isinstance(child, h5py.Group):
                groups.append(prefix + name)
                walk(child, prefix + name + "/")
            else:
                kind = type_name(child.dtype)
                assert kind != "text" or child.shape == (1,)
                found[prefix + name] = kind, () if kind == "text" else child.shape
                for attribute in child.attrs:
                    found[f"{prefix}{name}@{attribute}"] = type_name(child.attrs.get_id(attribute).dtype), ()

    with h5py.File(path) as file:
        walk(file, "")
    return found, groups


def bind(found, matched):
    """The numbers that letters stand for; each must stand for one."""
    letters = {}
    for name, item in matched.items():
        shape = found[name][1]
        assert len(shape) == len(item.dims()), f"{name}: {shape} is not {item.shape}"
        for size, dim in zip(shape, item.dims()):
            scope = name.rpartition("/")[0] if dim in OF_GROUP else ""
            if re.fullmatch(r"[A-Za-z_]+", dim):
                assert letters.setdefault((scope, dim), size) == size, f"{name}: {dim} is {size} and another number"
    return letters


def value(dim, scope, letters):
    """The number of a dimension such as 3 N or frames + 1."""
    def letter(name):
        return letters[(scope if name in OF_GROUP else "", name)]

    if dim.isdigit():
        return int(dim)
    if product := re.fullmatch(r"(\d+) (\w+)", dim):
        return int(product[1]) * letter(product[2])
    if total := re.fullmatch(r"(\w+) \+ (\d+)", dim):
        return letter(total[1]) + int(total[2])
    return letter(dim)


def check_owners(spec, there, path):
    """Each item that goes with another item or a group is there if that one is, and only then."""
    for item in spec:
        if item.presence != "with":
            continue
        for name in there:
            if owner := pattern(item.owner).fullmatch(name):
                wanted = filled(item.name, owner.groupdict())
                assert wanted in there, f"{path}: lacks {wanted}, which goes with {name}"
            if own := item.pattern.fullmatch(name):
                wanted = filled(item.owner, own.groupdict())
                assert wanted in there, f"{path}: has {name} without {wanted}"


def check(path, kind):
    """Holds a file against the specification; returns the names of the items that it has."""
    spec = specified(kind)
    found, groups = contents(path)
    matched = {}
    for name, (type_, _) in found.items():
        fits = [item for item in spec if item.pattern.fullmatch(name)]
        assert len(fits) == 1, f"{path}: {name} is in the file, and in the specification {len(fits)} times"
        assert fits[0].type == type_, f"{name}: is {type_}, not {fits[0].type}"
        matched[name] = fits[0]
    letters = bind(found, matched)
    for name, item in matched.items():
        for size, dim in zip(found[name][1], item.dims()):
            assert dim == "?" or value(dim, name.rpartition("/")[0], letters) == size, f"{name}: {item.shape}"
    check_owners(spec, {*found, *(group + "/" for group in groups)}, path)
    for item in spec:
        if item.presence != "always":
            continue
        parents = {""}
        if item.name.startswith("trajectories/N"):
            parents = {group + re.match(r"[/@]", item.name[len("trajectories/N"):])[0]
                       for group in groups if re.fullmatch(r"trajectories/[^/]+", group)}
            assert parents, f"{path}: no trajectory"
            for parent in parents:
                assert parent + item.name[len("trajectories/N") + 1:] in found, f"{path}: lacks {item.name}"
        else:
            assert item.name in found, f"{path}: lacks {item.name}"
    return {item.name for item in matched.values()}


@pytest.fixture(scope="module")
def files(command, assets, tmp_path_factory):
    """Files of every kind, with as much in them as can be."""
    folder = tmp_path_factory.mktemp("formats")

    def run(*arguments):
        command(*arguments, cwd=folder)

    run("mesh", assets / "beam.obj", "-o", "beam.h5")
    run("mesh", assets / "block.mesh", "-o", "block.h5", "--region", "group 2:young=3e5")
    run("modes", "beam.h5", "-m", 16)
    run("mesh", assets / "beam.obj", "-o", "plain.h5", "--elements", "linear")
    run("mesh", assets / "beam.obj", "-o", "quadratic.h5", "--edge", 0.1, "--elements", "quadratic")
    run("mesh", assets / "beam.obj", "-o", "caged.h5", "--cage", 60)
    extras = ["--contact-forces", "--stress", "--deformation-gradients", "--contact-edges"]
    run("dataset", "plain.h5", "-o", "less.h5", "--trajectories", 5, "--frames", 3)
    run("dataset", "beam.h5", "-o", "more.h5", "--trajectories", 12, "--frames", 24, "--per-shard", 7,
        "--hold-out", "kind=drop", *extras)
    run("mesh", assets / "beam.obj", "-o", "finer.h5", "--elements", "linear", "--subdivide", 1)
    far = "".join(f"v {500_000 + float(words[1])} {words[2]} {words[3]}\n" if words[0] == "v" else line + "\n"
                  for line in (assets / "beam.obj").read_text().splitlines() if (words := line.split()))
    first = far.index("\nf ") + 1
    second = far.index("\nf ", first + 400) + 1
    (folder / "far.obj").write_text(far[:first] + "g front\n" + far[first:second] + "g back\n" + far[second:])
    run("mesh", "far.obj", "-o", "far.h5")
    run("dataset", "far.h5", "-o", "far_poses.h5", "--trajectories", 3, "--frames", 3)
    run("remap", "less.h5", "--from", "plain.h5", "--to", "finer.h5", "-o", "remapped.h5")
    scene = {
        "bodies": [{"surface": str(assets / "beam.obj"), "transform": {"translate": [0, 0, 0.061]}}],
        "obstacles": [{"plane": {"normal": [0, 0, 1]}}],
        "time": {"dt": 0.005, "frames": 3, "steps_per_frame": 1},
    }
    (folder / "scene.json").write_text(json.dumps(scene))
    run("simulate", "scene.json", "-o", "scene.h5", *extras)
    run("train", "beam.h5", "more.h5", "-o", "tree.h5", "--bounds", "nbd,learned_affine", "--depth", 4,
        "-m", 16, "-k", 32, "--epochs", 3)
    run("train", "plain.h5", "less.h5", "-o", "small.h5", "--bounds", "learned_affine", "--depth", 3,
        "--calibration", 0)
    run("export", "--flat", "tree.h5", "-o", "tree.nbd")
    return folder


FILES = {
    "body": ["beam.h5", "plain.h5", "block.h5", "far.h5", "quadratic.h5", "caged.h5"],
    "recording": ["scene.h5", "remapped.h5", "more.shards/000000-000006.h5", "less.shards/000000-000004.h5",
                  "far_poses.shards/000000-000002.h5"],
    "dataset": ["more.h5", "less.h5", "far_poses.h5"],
    "tree": ["tree.h5", "small.h5"],
}


def test_plain_h5py_finds_the_numbers_that_we_do(files):
    body, tree, reader = nbd.load_body(files / "beam.h5"), nbd.load_tree(files / "tree.h5"), nbd.RecordingReader(files / "more.h5")
    with h5py.File(files / "beam.h5") as file:
        assert file.attrs["units"].decode() == "m, s, kg" and file["material"].attrs["density"] == body.material.density
        for name, array in (("tets/nodes", body.X), ("tets/cells", body.T), ("surface/faces", body.F),
                            *zip(("embedding/values", "embedding/cols", "embedding/rows"), body.W)):
            assert file[name].dtype == array.dtype and np.array_equal(file[name], array), name
        assert file["tets/nodes"].fletcher32 and np.allclose(file["surface/vertices"], body.surface_positions(body.X))
        digest = hashlib.sha256()
        for name in file.attrs["body_sha256_of"].decode().split():
            data = file[name]
            digest.update(f"{name} {data.dtype} {' x '.join(map(str, data.shape))}\n".encode() + data[:].tobytes())
        assert digest.hexdigest() == file.attrs["body_sha256"].decode() == body.hash
    with h5py.File(files / "more.h5") as file:
        for place, info in enumerate(reader.trajectories):
            trajectory = file[f"trajectories/{info.id:06}"]
            assert (trajectory.attrs["id"], trajectory.attrs["seed"]) == (info.id, info.seed)
            assert trajectory.attrs["failure"].decode() == info.failure and trajectory["recipe"][0].decode() == info.recipe
            assert trajectory["positions"].is_virtual and np.array_equal(trajectory["positions"], reader.read(place))
            assert np.array_equal(trajectory["times"], reader.times(place))
        assert json.loads(file["dataset/plan"][0])["frames"] == 24
    with h5py.File(files / "tree.h5") as file:
        assert file["bd/modes/U"] == file["nbd/modes/U"]  # a link to the same dataset
        assert np.array_equal(file["topology/rest_spheres"], tree.tree.rest_spheres)
        assert np.array_equal(file["calibration/nbd/margins"], tree.tree.calibrations["nbd"]["margins"])
        assert json.loads(file["facts/config"][0])["modes"] == 16 and file["facts"].attrs["poses"] == tree.facts["poses"]


@pytest.mark.parametrize("kind", FILES)
def test_files_and_specification_hold_the_same_items(files, kind):
    seen = set()
    for name in FILES[kind]:
        seen |= check(files / name, kind)
    never = {item.name for item in specified(kind)} - seen
    assert not never, f"in the specification, but in no file: {sorted(never)}"


def test_formats_and_versions_are_those_of_the_table(files):
    rows = {cells[0]: cells for cells in tables("File formats")}
    for kind, names in FILES.items():
        row = rows["recording, shard" if kind == "recording" else kind]
        for name in names:
            with h5py.File(files / name) as file:
                assert (file.attrs["format"].decode(), int(file.attrs["format_version"])) == (row[1].strip('`"'), int(row[2]))
    flat = (files / "tree.nbd").read_bytes()
    assert flat.startswith(rows["flat tree"][1].strip("`").encode() + b"\n")
    assert int(np.frombuffer(flat[12:16], "<u4")[0]) == int(rows["flat tree"][2])


def test_the_comparison_finds_what_differs(files, tmp_path):
    """A file with one item more, one less, of another type or of another shape is not as specified."""

    def refused(change, text, source="scene.h5", kind="recording", group="trajectories/000000"):
        copy = tmp_path / "copy.h5"
        copy.write_bytes((files / source).read_bytes())
        with h5py.File(copy, "r+") as file:
            change(file[group])
        with pytest.raises(AssertionError) as error:
            check(copy, kind)
        assert text in str(error.value)

    def replace(group, name, values):
        del group[name]
        group[name] = values

    refused(lambda t: t.create_dataset("extra", data=np.zeros(3)), "trajectories/000000/extra is in the file, and")
    refused(lambda t: t.pop("times"), "lacks trajectories/N/times")
    refused(lambda t: replace(t, "times", np.float32(t["times"][:])), "is float32, not float64")
    refused(lambda t: replace(t, "times", t["times"][:2]), "frames is")
    refused(lambda t: replace(t, "contact_edge_offsets", t["contact_edge_offsets"][:-1]), "[frames + 1]")
    refused(lambda t: t.pop("contact_edge_offsets"),
            "lacks trajectories/000000/contact_edge_offsets, which goes with trajectories/000000/contact_edges")
    refused(lambda t: t.pop("contact_edges"), "has trajectories/000000/contact_edge")
    tree = {"source": "tree.h5", "kind": "tree", "group": "/"}
    refused(lambda t: t.pop("nbd/out_scale"), "lacks nbd/out_scale, which goes with nbd/", **tree)
    refused(lambda t: t.pop("nbd/z_whitening"), "lacks nbd/z_whitening, which goes with nbd/z_mean", **tree)
    refused(lambda t: t.pop("calibration/nbd/margins"),
            "lacks calibration/nbd/margins, which goes with calibration/nbd/", **tree)
