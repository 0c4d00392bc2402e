#!/usr/bin/env python3
"""Writes small files of every kind that nbdtree reads, with which fuzzing starts: seeds.py NBDTREE FOLDER.

Some are broken on purpose. Files of HDF5 are made by the program itself."""

import base64
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def lines(rows):
    return "\n".join(rows) + "\n"


def xyz(p):
    return " ".join(str(c) for c in p)


def surfaces():
    yield "obj/tet.obj", lines([f"v {xyz(p)}" for p in CORNERS] + ["f " + xyz([i + 1 for i in f]) for f in FACES])
    yield "obj/all.obj", lines(["mtllib none.mtl", "o a", "g b", "v 0 0 0 1 1 1", "vt 0 0", "vn 0 0 1", "v 1e0 0 -0.0",
                                "v 0 1 0", "v 1 1 .5", "usemtl m", "s 1", "f 1/1/1 2/1/1 4//1 3", "f -1 -2 -3", "l 1 2",
                                "p 1", "# end \\", "f 1 2 9"])
    yield "off/tet.off", lines(["OFF", "4 4 0"] + [xyz(p) for p in CORNERS] + ["3 " + xyz(f) for f in FACES])
    yield "off/colours.off", lines(["COFF", "3 2 1", "# c", "0 0 0 1 0 0 1", "1 0 0 0 1 0 1", "0 1 0 0 0 1 1", "3 0 1 2",
                                    "4 0 1 2 7"])
    ply = ["ply", "format {} 1.0", "comment c", "element vertex 4", "property float x", "property float y",
           "property float z", "element face 4", "property list uchar int vertex_indices", "end_header"]
    yield "ply/text.ply", lines(ply).format("ascii") + lines([xyz(p) for p in CORNERS] + ["3 " + xyz(f) for f in FACES])
    for order, sign in (("little", "<"), ("big", ">")):
        yield f"ply/{order}.ply", (lines(ply).format(f"binary_{order}_endian").encode() +
                                   b"".join(struct.pack(sign + "3f", *p) for p in CORNERS) +
                                   b"".join(struct.pack(sign + "B3i", 3, *f) for f in FACES))
    yield "ply/strips.ply", lines(["ply", "format ascii 1.0", "element vertex 4", "property double x", "property double y",
                                   "property double z", "property uchar red", "element tristrips 1",
                                   "property list int int vertex_indices", "end_header"] +
                                  [xyz(p) + " 7" for p in CORNERS] + ["5 0 1 2 -1 3"])
    facets = [[CORNERS[i] for i in f] for f in FACES]
    yield "stl/text.stl", lines(["solid s"] + [lines(["facet normal 0 0 1", "outer loop"] +
                                                     [f"vertex {xyz(p)}" for p in f] + ["endloop", "endfacet"])
                                               for f in facets] + ["endsolid s"])
    yield "stl/binary.stl", bytes(80) + struct.pack("<I", 4) + b"".join(
        struct.pack("<12fH", 0, 0, 1, *[c for p in f for c in p], 0) for f in facets)
    yield "stl/cut.stl", bytes(80) + struct.pack("<I", 2) + struct.pack("<12fH", *range(12), 0)
    yield "stl/capitals.stl", "\n \nSOLID S a\n" + "".join(
        lines(["FACET NORMAL 0 0 1", "OUTER LOOP"] + [f"VERTEX {xyz(p)}" for p in f] + ["ENDLOOP", "ENDFACET"]) for f in facets)
    yield "stl/trailing.stl", bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *range(12), 0) + b"more bytes"
    yield "off/wrapped.off", lines(["OFF 4", "2", "0"] + [xyz(p) for p in CORNERS] + ["3 0", "2 1 255 0 0", "4", "0 1", "3 2"])
    data = b"".join(struct.pack("<3f", *p) for p in CORNERS) + b"".join(struct.pack("<3H", *f) for f in FACES)
    scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
             "nodes": [{"mesh": 0, "translation": [1, 2, 3]}],
             "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
             "buffers": [{"byteLength": len(data)}],
             "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48},
                             {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
             "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0],
                            "max": [1, 1, 1]},
                           {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]}
    small = json.loads(json.dumps(scene))
    small["extensionsRequired"] = small["extensionsUsed"] = ["KHR_mesh_quantization"]
    small["accessors"][0].update({"componentType": 5121, "normalized": True, "sparse": {"count": 1, "indices": {
        "bufferView": 1, "componentType": 5123}, "values": {"bufferView": 1, "byteOffset": 2}}})
    small["bufferViews"][0]["byteStride"] = 12
    small["nodes"].append({"children": [0], "rotation": [0, 0, 0.6, 0.8], "scale": [1, 2, -3]})
    small["scenes"][0]["nodes"] = [1]
    inside = json.loads(json.dumps(scene))
    inside["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    inside["meshes"][0]["primitives"][0]["mode"] = 5
    unknown = {**scene, "extensionsRequired": ["KHR_draco_mesh_compression"]}
    for name, text in (("tet", json.dumps(scene)), ("broken", json.dumps(scene).replace('"count": 12', '"count": 99')),
                       ("quantized", json.dumps(small)), ("in_text", json.dumps(inside)), ("unknown", json.dumps(unknown))):
        text = text.encode() + b" " * (-len(text) % 4)
        yield f"glb/{name}.glb", (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) +
                                  struct.pack("<I4s", len(text), b"JSON") + text +
                                  struct.pack("<I4s", len(data), b"BIN\0") + data)


def tetrahedra():
    nodes = CORNERS + [(1, 1, 1)]
    tets = [(0, 1, 2, 3), (1, 2, 3, 4)]
    msh = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "1", '3 7 "soft"', "$EndPhysicalNames", "$Nodes",
           "5"] + [f"{i + 1} {xyz(p)}" for i, p in enumerate(nodes)] + ["$EndNodes", "$Elements", "3",
           "1 2 2 0 1 1 2 3", "2 4 2 7 1 1 2 3 4", "3 4 2 7 1 2 3 4 5", "$EndElements"]
    yield "msh/two.msh", lines(msh)
    yield "msh/four.msh", lines(["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "0 0 0 1",
                                 "1 0 0 0 1 1 1 1 7 0", "$EndEntities", "$Nodes", "1 5 1 5", "3 1 0 5", "1", "2", "3", "4",
                                 "5"] + [xyz(p) for p in nodes] + ["$EndNodes", "$Elements", "1 2 1 2", "3 1 4 2",
                                 "1 1 2 3 4", "2 2 3 4 5", "$EndElements"])
    yield "msh/binary.msh", (b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n5\n" +
                             b"".join(struct.pack("<i3d", i + 1, *p) for i, p in enumerate(nodes)) +
                             b"\n$EndNodes\n$Elements\n2\n" + struct.pack("<3i", 4, 2, 2) +
                             b"".join(struct.pack("<7i", i + 1, 7, 1, *[n + 1 for n in t]) for i, t in enumerate(tets)) +
                             b"\n$EndElements\n")
    yield "msh/unknown.msh", lines(["$MeshFormat", "9.9 0 8", "$EndMeshFormat"])
    yield "mesh/two.mesh", lines(["MeshVersionFormatted 2", "Dimension 3", "Vertices", "5"] + [xyz(p) + " 0" for p in nodes] +
                                 ["Tetrahedra", "2"] + [xyz([n + 1 for n in t]) + " 3" for t in tets] + ["Triangles", "1",
                                 "1 2 3 0", "End"])
    yield "mesh/no_end.mesh", lines(["MeshVersionFormatted 1", "Dimension 3", "Vertices 4"] + [xyz(p) + " 0" for p in CORNERS] +
                                    ["Tetrahedra 1", "1 2 3 4 0"])
    yield "mesh/far.mesh", lines(["MeshVersionFormatted 1", "Dimension", "3", "Vertices", "1", "0 0 0 0", "Tetrahedra", "1",
                                  "1 2 3 4 0", "End"])
    head = ["# vtk DataFile Version {}", "t", "{}", "DATASET UNSTRUCTURED_GRID", "POINTS 5 double"]
    points, cells = [xyz(p) for p in nodes], ["4 " + xyz(t) for t in tets]
    yield "vtk/text.vtk", lines(head).format("3.0", "ASCII") + lines(points + ["CELLS 2 10"] + cells + ["CELL_TYPES 2",
                                                                                                       "10", "10"])
    yield "vtk/five.vtk", lines(head).format("5.1", "ASCII") + lines(points + ["CELLS 3 8", "OFFSETS vtktypeint64", "0 4 8",
                                "CONNECTIVITY vtktypeint64", "0 1 2 3 1 2 3 4", "CELL_TYPES 2", "10", "10"])
    yield "vtk/binary.vtk", (lines(head).format("3.0", "BINARY").encode() + b"".join(struct.pack(">3d", *p) for p in nodes) +
                             b"\nCELLS 2 10\n" + b"".join(struct.pack(">5i", 4, *t) for t in tets) +
                             b"\nCELL_TYPES 2\n" + struct.pack(">2i", 10, 10) + b"\n")
    yield "vtk/far.vtk", lines(head).format("3.0", "ASCII") + lines(points + ["CELLS 1 5", "4 0 1 2 9", "CELL_TYPES 1", "10"])


def vtu_arrays(points, corners, ends, types, write):
    """write: a tag's attributes and content for a type of number and the numbers."""
    for name, kind, code, numbers in (("points", "Float64", "d", points), ("connectivity", "Int32", "i", corners),
                                      ("offsets", "Int64", "q", ends), ("types", "UInt8", "B", types)):
        attributes, content = write(struct.pack(f"<{len(numbers)}{code}", *numbers), numbers)
        tag = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{3 if name == "points" else 1}" {attributes}>{content}</DataArray>'
        yield f"<Points>{tag}</Points><Cells>" if name == "points" else tag
    yield "</Cells>"


def vtu():
    nodes = CORNERS + [(1, 1, 1)]
    numbers = [c for p in nodes for c in p], [0, 1, 2, 3, 1, 2, 3, 4], [4, 8], [10, 10]
    appended = bytearray()

    def text(_, values):
        return 'format="ascii"', " ".join(map(str, values))

    def inline(data, _):
        return 'format="binary"', base64.b64encode(struct.pack("<I", len(data)) + data).decode()

    def packed(data, _):
        parts = [zlib.compress(data[:16]), zlib.compress(data[16:])] if len(data) > 16 else [zlib.compress(data)]
        last = len(data) - 16 if len(data) > 16 else 0
        head = struct.pack(f"<{3 + len(parts)}I", len(parts), 16 if len(data) > 16 else len(data), last, *map(len, parts))
        return 'format="binary"', (base64.b64encode(head) + base64.b64encode(b"".join(parts))).decode()

    def raw(data, _):
        offset = len(appended)
        appended.extend(struct.pack("<I", len(data)) + data)
        return f'format="appended" offset="{offset}"', ""

    for name, write in (("text", text), ("inline", inline), ("packed", packed), ("raw", raw)):
        more = ' compressor="vtkZLibDataCompressor"' if name == "packed" else ""
        body = (f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"{more}>\n<UnstructuredGrid>'
                f'<Piece NumberOfPoints="5" NumberOfCells="2">{"".join(vtu_arrays(*numbers, write))}</Piece></UnstructuredGrid>\n')
        tail = b'<AppendedData encoding="raw">_' + bytes(appended) + b"</AppendedData>" if name == "raw" else b""
        yield f"vtu/{name}.vtu", body.encode() + tail + b"</VTKFile>\n"


def texts(assets):
    for kind, folder in (("scene", "scenes"), ("recipe", "recipes")):
        for file in sorted((assets / folder).glob("*.json")):
            yield f"{kind}/{file.name}", file.read_bytes()
    yield "scene/deep.json", "[" * 60 + "]" * 60
    yield "recipe/wrong.json", '{"strength": -1, "kinds": {"drop": {"weight": "much"}}}'


def run(program, folder, *arguments):
    return subprocess.run([program, *map(str, arguments), "--quiet"], cwd=folder, check=True)


def interrupt(program, folder, kept, state, *arguments):
    """Ends a command by Ctrl-C at a state, see apps/cli/test_points.hpp; returns the file that the next run continues from."""
    subprocess.run([program, *arguments, "--quiet"], cwd=folder, stderr=subprocess.DEVNULL,
                   env={**os.environ, "NBDTREE_AT": f"{state}|interrupt"})
    return folder / kept


JOURNAL = b"nbdtree journal 5\n"


def records(journal):
    """Begin and end of each record, see apps/simulate/journal.cpp."""
    begin = len(JOURNAL)
    while begin < len(journal):
        end = begin + 72 + struct.unpack_from("<Q", journal, begin)[0]
        yield begin, end
        begin = end


def record(journal, number):
    begin, end = list(records(journal))[number]
    return journal[begin + 72:end]


def first_records(journal, count):
    return journal[: list(records(journal))[count - 1][1]]


def made_by_the_program(program, folder):
    (folder / "block.mesh").write_text(lines(
        ["MeshVersionFormatted 2", "Dimension 3", "Vertices", "8"] +
        [f"{x} {y} {z} 0" for z in (0, 1) for y in (0, 1) for x in (0, 1)] + ["Tetrahedra", "5", "1 2 3 5 1", "2 4 3 8 1",
        "2 3 5 8 1", "2 6 5 8 1", "3 5 7 8 1", "End"]))
    run(program, folder, "mesh", "block.mesh", "-o", "body.h5")
    run(program, folder, "modes", "body.h5", "-m", "6")
    run(program, folder, "dataset", "body.h5", "-o", "poses.h5", "--trajectories", "4", "--frames", "2")
    run(program, folder, "dataset", "body.h5", "-o", "many.h5", "--trajectories", "12", "--frames", "30")
    run(program, folder, "train", "body.h5", "many.h5", "-o", "tree.h5", "--bounds", "nbd,learned_affine",
        "--epochs", "1", "--depth", "1", "-k", "4", "-m", "4")
    run(program, folder, "export", "tree.h5", "--flat", "-o", "tree.nbd")
    run(program, folder, "mesh", Path(__file__).resolve().parents[2] / "assets" / "ring.obj", "-o", "ring.h5")
    run(program, folder, "modes", "ring.h5", "-m", "6")
    run(program, folder, "dataset", "ring.h5", "-o", "rings.h5", "--trajectories", "12", "--frames", "30")
    checkpoint = interrupt(program, folder, "long.h5.checkpoint", "networks|1", "train", "ring.h5", "rings.h5", "-o", "long.h5", "--depth",
                           "2", "-k", "4", "-m", "4", "--bounds", "nbd", "--threads", "1")
    (folder / "scene.json").write_text('{"bodies": [{"body": "body.h5"}], "obstacles": [{"plane": {"normal": [0, 0, 1]}}]}')
    journal = interrupt(program, folder, "run.h5.journal", "frames|3", "simulate", "scene.json", "-o", "run.h5", "--frames",
                        "1000000").read_bytes()
    yield "journal/run.journal", first_records(journal, 2)
    yield "frame/start.bin", record(journal, 1)
    yield "checkpoint/long.h5", checkpoint
    yield "body/body.h5", folder / "body.h5"
    for shard in sorted((folder / "poses.shards").glob("*.h5")):
        yield f"recording/{shard.name}", shard
    yield "dataset/poses.h5", folder / "poses.h5"
    yield "tree/tree.h5", folder / "tree.h5"
    yield "inspect/body.h5", folder / "body.h5"
    yield "flat/tree.nbd", folder / "tree.nbd"


def broken(folder):
    """Every kind gets a file that is cut off and one of another kind."""
    for kind in sorted(p for p in folder.iterdir() if p.is_dir()):
        first = sorted(kind.iterdir())[0]
        (kind / f"cut{first.suffix}").write_bytes(first.read_bytes()[: first.stat().st_size * 2 // 3])
        (kind / f"foreign{first.suffix}").write_bytes(b"something else\n")


def main():
    program, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    assets = Path(__file__).resolve().parents[2] / "assets"
    for name, content in (*surfaces(), *tetrahedra(), *vtu(), *texts(assets)):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with tempfile.TemporaryDirectory() as temporary:
        for name, file in made_by_the_program(program, Path(temporary)):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(file if isinstance(file, bytes) else file.read_bytes())
    broken(folder)


if __name__ == "__main__":
    main()
