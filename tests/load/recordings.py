#!/usr/bin/env python3
"""Reads and makes recordings of nbdtree with h5py, for load.py, whose own memory stays small without it.

    recordings.py span RECORDING          prints, as JSON, the numbers of bodies and frames, whether all positions are
                                          finite, and the lowest and highest coordinates of the last frames
    recordings.py long DATA OUT BYTES     repeats the trajectories of a dataset, each moved to another place, up to so many
                                          bytes of positions, as 40 trajectories
"""

import json
import sys

import h5py
import numpy as np

TRAJECTORIES = 40
CHUNK_BYTES = 1 << 20


def span(path):
    """What load.py checks of a run."""
    with h5py.File(path) as file:
        bodies = [body["positions"] for body in file["trajectories"].values()]
        finite = all(np.isfinite(frames).all() for positions in bodies for frames in chunks(positions))
        last = np.concatenate([positions[-1] for positions in bodies])
        return {"bodies": len(bodies), "frames": len(bodies[0]), "finite": bool(finite),
                "low": last.min(axis=0).tolist(), "high": last.max(axis=0).tolist()}


def chunks(positions):
    return (positions[i:i + 64] for i in range(0, len(positions), 64))


def make_long(source, path, size):
    with h5py.File(source) as data, h5py.File(path, "w") as file:
        groups = list(data["trajectories"].values())
        for name in ("format", "program_version", "units"):
            file.attrs[name] = data.attrs[name]
        file.attrs["format_version"] = 1
        file.attrs["body_sha256"] = groups[0].attrs["body_sha256"]
        frame_bytes = groups[0]["positions"][0].nbytes
        for i in range(TRAJECTORIES):
            add_trajectory(file, i, groups[i % len(groups)], max(2, size // TRAJECTORIES // frame_bytes))


def add_trajectory(file, number, source, frames):
    """Adds a trajectory of so many frames: those of the source, again and again, with a shift of its own each time."""
    group = file.create_group(f"trajectories/{number:06}")
    for name, value in source.attrs.items():
        group.attrs[name] = value
    group.attrs["id"] = np.int64(number)
    group.create_dataset("recipe", data=source["recipe"][:], fletcher32=True)
    group.create_dataset("times", data=0.001 * np.arange(frames), fletcher32=True)
    poses = source["positions"][:]
    per_chunk = max(1, min(64, CHUNK_BYTES // poses[0].nbytes))
    positions = group.create_dataset("positions", (frames, *poses.shape[1:]), "<f4", fletcher32=True,
                                     chunks=(min(per_chunk, frames), *poses.shape[1:]))
    for begin in range(0, frames, per_chunk):
        numbers = np.arange(begin, min(begin + per_chunk, frames))
        positions[begin:begin + len(numbers)] = poses[numbers % len(poses)] + 1e-3 * (numbers // len(poses))[:, None, None]


if __name__ == "__main__":
    if sys.argv[1] == "span":
        print(json.dumps(span(sys.argv[2])))
    else:
        make_long(sys.argv[2], sys.argv[3], int(sys.argv[4]))
