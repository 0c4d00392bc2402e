#!/usr/bin/env python3
"""Reads the clips of `nbdtree export` by their specifications alone and compares them with the recording.

    clip_files_test.py NBDTREE ASSETS

Exit status 77, for ctest: h5py or numpy is not there.
"""
import json
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

NBDTREE, ASSETS = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
WIDTHS = {"SCALAR": 1, "VEC3": 3}
NUMBERS = {5125: np.dtype("<u4"), 5126: np.dtype("<f4")}


class Glb:
    """A binary glTF file, checked against the specification as far as our files use it."""

    def __init__(self, path, check):
        data = Path(path).read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        check.assertEqual((magic, version, length), (b"glTF", 2, len(data)))
        json_length, json_kind = struct.unpack_from("<I4s", data, 12)
        check.assertEqual((json_kind, json_length % 4), (b"JSON", 0))
        self.gltf = json.loads(data[20:20 + json_length])
        bin_length, bin_kind = struct.unpack_from("<I4s", data, 20 + json_length)
        check.assertEqual((bin_kind, bin_length % 4), (b"BIN\0", 0))
        self.bin = data[28 + json_length:]
        check.assertEqual(len(self.bin), bin_length)
        check.assertEqual(self.gltf["asset"]["version"], "2.0")
        check.assertEqual([buffer["byteLength"] for buffer in self.gltf["buffers"]], [bin_length])
        self.arrays = [self.array(accessor, check) for accessor in self.gltf["accessors"]]
        # The views follow each other without gaps, and each has one accessor.
        ends = 0
        for view in self.gltf["bufferViews"]:
            check.assertEqual(view["byteOffset"], ends)
            ends += view["byteLength"]
        check.assertEqual(ends, bin_length)
        check.assertEqual([a["bufferView"] for a in self.gltf["accessors"]], list(range(len(self.gltf["bufferViews"]))))

    def array(self, accessor, check):
        view, number, width = self.gltf["bufferViews"][accessor["bufferView"]], NUMBERS[accessor["componentType"]], WIDTHS[accessor["type"]]
        check.assertEqual(view["byteOffset"] % number.itemsize, 0)
        check.assertEqual(view["byteLength"], accessor["count"] * width * number.itemsize)
        array = np.frombuffer(self.bin, number, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        for bound, reduce in (("min", np.min), ("max", np.max)):
            if bound in accessor:  # exactly the numbers of the buffer
                check.assertEqual(accessor[bound], [float(x) for x in reduce(array, axis=0)])
        return array


class ClipTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="nbdtree_clip_"))
        cls.make("mesh", ASSETS / "beam.obj", "-o", "beam.h5", "--elements", "linear", "-q")
        cls.make("modes", "beam.h5", "-m", 8, "-q")
        scene = {"bodies": [{"body": "beam.h5", "name": "low / beam", "transform": {"translate": [0, 0, 0.12]}},
                            {"body": "beam.h5", "name": "high", "velocity": [0, 0.3, -1],
                             "transform": {"translate": [0, 0.02, 0.4], "rotate": {"axis": [0, 0, 1], "degrees": 40}}}],
                 "obstacles": [{"plane": {}}], "time": {"dt": 0.004, "frames": 30}}
        (cls.folder / "beams.json").write_text(json.dumps(scene))
        cls.make("simulate", "beams.json", "-o", "run.h5", "-q")
        cls.make("dataset", "beam.h5", "-o", "poses.h5", "--trajectories", 2, "--frames", 12, "--seed", 1, "-q")
        with h5py.File(cls.folder / "beam.h5") as body:
            rows, columns, weights = (body[f"embedding/{part}"][:] for part in ("rows", "cols", "values"))
            cls.faces, cls.rest = body["surface/faces"][:], body["surface/vertices"][:]
            cls.W = np.zeros((len(cls.rest), len(body["tets/nodes"])), np.float32)
            for v in range(len(cls.rest)):
                cls.W[v, columns[rows[v]:rows[v + 1]]] = weights[rows[v]:rows[v + 1]]

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def run_program(cls, *arguments):
        return subprocess.run([NBDTREE, *map(str, arguments)], cwd=cls.folder, capture_output=True, text=True)

    @classmethod
    def make(cls, *arguments):
        ran = cls.run_program(*arguments)
        assert ran.returncode == 0, ran.stderr
        return ran.stdout

    def recorded(self, file, trajectory):
        """Surfaces in all frames, by the body's embedding in double precision, and times from the first frame on."""
        with h5py.File(self.folder / file) as recording:
            group = recording[f"trajectories/{trajectory:06}"]
            return self.W.astype(float) @ group["positions"][:].astype(float), group["times"][:] - group["times"][0]

    def assert_close(self, a, b):
        """Within the rounding of a few operations in single precision."""
        self.assertEqual(a.shape, b.shape)
        self.assertLess(np.abs(a - b).max(), 8 * np.finfo(np.float32).eps * np.abs(b).max())

    def check_glb(self, path, expected, times):
        """expected: [bodies][frames, vertices, 3]."""
        glb = Glb(self.folder / path, self)
        gltf, frames = glb.gltf, len(times)
        self.assertEqual(len(gltf["meshes"]), len(expected))
        for mesh, surfaces in zip(gltf["meshes"], expected):
            (primitive,) = mesh["primitives"]
            np.testing.assert_array_equal(glb.arrays[primitive["indices"]].reshape(-1, 3), self.faces)
            shapes = [primitive["attributes"], *primitive.get("targets", [])]
            self.assertEqual(len(shapes), frames)
            self.assertEqual(mesh["weights"], [0] * (frames - 1))
            first = {name: glb.arrays[accessor].astype(float) for name, accessor in shapes[0].items()}
            self.assertEqual(set(first), {"POSITION", "NORMAL"})
            for frame, shape in enumerate(shapes):
                self.assertEqual(set(shape), {"POSITION", "NORMAL"})
                self.assertIn("min", gltf["accessors"][shape["POSITION"]])
                base = {name: numbers if frame else 0 * numbers for name, numbers in first.items()}
                self.assert_close(base["POSITION"] + glb.arrays[shape["POSITION"]], surfaces[frame])
                normals = base["NORMAL"] + glb.arrays[shape["NORMAL"]]
                self.assertLess(np.abs(np.linalg.norm(normals, axis=1) - 1).max(), 1e-5)
                # No vertex has a normal against all of its faces.
                corners = surfaces[frame][self.faces]
                of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                along = np.einsum("fc,fkc->fk", of_faces, normals[self.faces])
                best = np.full(len(normals), -1.0)
                np.maximum.at(best, self.faces.ravel(), along.ravel())
                self.assertGreater(best.min(), 0)
        (animation,) = gltf["animations"]
        (sampler,) = animation["samplers"]
        self.assertEqual([channel["target"]["path"] for channel in animation["channels"]], ["weights"] * len(expected))
        self.assertEqual([gltf["nodes"][channel["target"]["node"]]["mesh"] for channel in animation["channels"]], list(range(len(expected))))
        np.testing.assert_allclose(glb.arrays[sampler["input"]].ravel(), times, rtol=1e-6, atol=1e-9)
        self.assertIn("max", gltf["accessors"][sampler["input"]])
        weights = glb.arrays[sampler["output"]].reshape(frames, frames - 1)
        np.testing.assert_array_equal(weights, np.eye(frames)[:, 1:])
        return gltf

    def test_gltf_holds_all_bodies_of_a_scene(self):
        self.make("export", "run.h5", "--gltf", "run.glb")
        surfaces, times = zip(*(self.recorded("run.h5", body) for body in (0, 1)))
        self.assertGreater(np.abs(surfaces[1][-1] - surfaces[1][0]).max(), 0.05)  # it moves
        gltf = self.check_glb("run.glb", surfaces, times[0])
        self.assertEqual([mesh["name"] for mesh in gltf["meshes"]], ["low / beam", "high"])
        self.assertEqual(gltf["scenes"][gltf["scene"]]["nodes"], [0])
        self.assertEqual(gltf["nodes"][0]["children"], [1, 2])
        x, y, z, w = gltf["nodes"][0]["rotation"]  # turns z, which is up, to y
        np.testing.assert_allclose([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], [0, 1, 0], atol=1e-9)

    def test_gltf_of_a_trajectory_and_of_some_frames(self):
        self.make("export", "poses.h5:1", "--body", "beam.h5", "--gltf", "poses.glb", "-q")
        surfaces, times = self.recorded("poses.h5", 1)
        self.check_glb("poses.glb", [surfaces], times)
        self.make("export", "run.h5", "--gltf", "some.glb", "--frames", 4, "-q")
        surfaces, times = zip(*(self.recorded("run.h5", body) for body in (0, 1)))
        self.check_glb("some.glb", [s[[0, 10, 20, 30]] for s in surfaces], times[0][[0, 10, 20, 30]])

    def read_mdd(self, path):
        data = (self.folder / path).read_bytes()
        frames, points = struct.unpack_from(">ii", data)
        self.assertEqual(len(data), 8 + 4 * frames + 12 * frames * points)
        return (np.frombuffer(data, ">f4", frames * points * 3, 8 + 4 * frames).reshape(frames, points, 3).astype(float),
                np.frombuffer(data, ">f4", frames, 8))

    def read_pc2(self, path):
        data = (self.folder / path).read_bytes()
        magic, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
        self.assertEqual((magic, version, start, rate), (b"POINTCACHE2\0", 1, 0, 1))
        self.assertEqual(len(data), 32 + 12 * samples * points)
        return np.frombuffer(data, "<f4", samples * points * 3, 32).reshape(samples, points, 3).astype(float)

    def check_obj(self, path):
        """The surface at rest, with the vertices and faces in the body's order."""
        words = [line.split() for line in (self.folder / path).read_text().splitlines()]
        vertices = np.array([list(map(float, word[1:])) for word in words if word[0] == "v"])
        faces = np.array([list(map(int, word[1:])) for word in words if word[0] == "f"]) - 1
        self.assert_close(vertices, self.rest)
        np.testing.assert_array_equal(faces, self.faces)

    def test_point_caches_hold_each_body_with_its_surface_at_rest(self):
        told = json.loads(self.make("export", "run.h5", "--mdd", "run.mdd", "--json"))
        self.assertEqual(told["files"], ["run_0_low___beam.mdd", "run_0_low___beam_rest.obj", "run_1_high.mdd", "run_1_high_rest.obj"])
        self.make("export", "run.h5", "--pc2", "run.pc2", "-q")
        for body, name in enumerate(("run_0_low___beam", "run_1_high")):
            surfaces, times = self.recorded("run.h5", body)
            shown, shown_times = self.read_mdd(f"{name}.mdd")
            self.assert_close(shown, surfaces)
            np.testing.assert_allclose(shown_times, times, rtol=1e-6, atol=1e-9)
            self.assert_close(self.read_pc2(f"{name}.pc2"), surfaces)
            self.check_obj(f"{name}_rest.obj")

    def test_a_point_cache_of_a_trajectory_has_the_name_asked_for(self):
        self.make("export", "poses.h5:0", "--body", "beam.h5", "--mdd", "pose.mdd", "-q")
        self.assert_close(self.read_mdd("pose.mdd")[0], self.recorded("poses.h5", 0)[0])
        self.check_obj("pose_rest.obj")

    def test_wrong_use_is_one_line_and_writes_nothing(self):
        self.make("simulate", "beams.json", "-o", "long.h5", "--frames", 240, "-q")
        shutil.copy(ASSETS / "beam.obj", self.folder / "mine_rest.obj")
        (self.folder / "named.json").write_text(json.dumps({"bodies": [{"surface": "mine_rest.obj"}], "time": {"frames": 1}}))
        self.make("simulate", "named.json", "-o", "named.h5", "-q")
        before = sorted(self.folder.iterdir())
        for arguments, expected in [
            (["long.h5", "--gltf", "no.glb"], "long.h5: 241 frames are too many for glTF, where each is a morph target; allowed: at "
             "most 240; --frames picks some, a point cache (--mdd, --pc2) holds all"),
            (["poses.h5:0", "--gltf", "no.glb"], "poses.h5:0: a trajectory alone does not have a surface"),
            (["beam.h5", "--gltf", "no.glb"], "beam.h5: "),
            (["mine_rest.obj", "--mdd", "no.mdd"], "mine_rest.obj: is not a recording; allowed: "),
            (["poses.h5:9", "--body", "beam.h5", "--pc2", "no.pc2"], "poses.h5: no trajectory 9, it has 2"),
            (["run.h5", "--gltf", "absent/no.glb"], "absent"),
            (["run.h5", "--gltf", "run.h5"], "run.h5"),
            (["named.h5", "--mdd", "mine.mdd"], "mine_rest.obj"),
            (["run.h5", "--gltf", "no.glb", "--mdd", "no.mdd"], "Exactly 1 option from ["),
            (["run.h5", "--gltf", "no.glb", "--frames", 0], "--frames"),
        ]:
            with self.subTest(arguments):
                ran = self.run_program("export", *arguments)
                self.assertIn(ran.returncode, (1, 2))
                self.assertEqual(ran.stdout, "")
                self.assertEqual(ran.stderr.count("\n"), 1, ran.stderr)
                self.assertIn(expected, ran.stderr)
        self.assertEqual(sorted(self.folder.iterdir()), before)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
