#!/usr/bin/env python3
"""Writes the files of the corpus that nbdtree itself makes, whole and cut off, for when a format changes: seeds.py NBDTREE
FOLDER. The others are what they are; a new one needs no program."""

import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path


def run(program, folder, *arguments):
    return subprocess.run([program, *map(str, arguments), "--quiet"], cwd=folder, check=True)


def interrupt(program, folder, kept, state, *arguments):
    """Ends a command by Ctrl-C at a state, see apps/cli/test_points.hpp; returns the file that the next run continues from."""
    subprocess.run([program, *arguments, "--quiet"], cwd=folder, stderr=subprocess.DEVNULL,
                   env={**os.environ, "NBDTREE_AT": f"{state}|interrupt"})
    return folder / kept


def records(journal):
    """Begin and end of each record after the line with the format's number, see apps/simulate/journal.cpp."""
    begin = journal.index(b"\n") + 1
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
    corners = [f"{x} {y} {z} 0" for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    (folder / "block.mesh").write_text("\n".join(["MeshVersionFormatted 2", "Dimension 3", "Vertices", "8", *corners, "Tetrahedra",
        "5", "1 2 3 5 1", "2 4 3 8 1", "2 3 5 8 1", "2 6 5 8 1", "3 5 7 8 1", "End", ""]))
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


def main():
    program, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as temporary:
        for name, file in made_by_the_program(program, Path(temporary)):
            content = file if isinstance(file, bytes) else file.read_bytes()
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
            (folder / name).with_stem("cut").write_bytes(content[: len(content) * 2 // 3])


if __name__ == "__main__":
    main()
