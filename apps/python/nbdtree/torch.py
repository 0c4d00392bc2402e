"""Datasets for PyTorch: windows of frames of a recording, with the graph of the body and its contact with itself."""

import os

import numpy as np
import torch

from nbdtree import (
    Body,
    PosedTree,
    RecordingReader,
    SelfQuery,
    dataset_manifest,
    is_dataset,
    load_body,
    make_exact_tree,
    near_at_rest,
)

PARTS = ("train", "held_out", "all")


# Corners of tetrahedra between which Body.E has nodes, in its order.
ENDS_OF_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def mesh_edges(T, E=None):
    """Edges of tetrahedra, both ways: [2, edges], int64, sorted. E: nodes of the edges of quadratic ones, between
    whose ends they lie: then of each end and that node."""
    if E is None or len(E) == 0:
        pairs = np.vstack([T[:, [i, j]] for i in range(4) for j in range(4) if i != j])
    else:
        halves = [np.column_stack([T[:, i], E[:, k]]) for k, ends in enumerate(ENDS_OF_EDGES) for i in ends]
        pairs = np.vstack(halves + [half[:, ::-1] for half in halves])
    return torch.from_numpy(np.unique(pairs, axis=0).T.astype(np.int64))


class Dataset(torch.utils.data.Dataset):
    """Windows of consecutive frames of one body.

    path: a recording or dataset. body: the Body that it is of, or its file, which worker processes that are
    spawned rather than forked need. window: frames in a window. part: "train" or
    "held_out" trajectories of a dataset, or "all"; failed trajectories are in none. split: which of the dataset's
    splits has these parts, "trajectories" or "parameter". contact_distance: if given,
    an item also tells which faces of the surface touch others of it, metres; pairs that are as near at rest
    are left out. fields: what else of the file items have: contact_forces, first_piola_stress,
    deformation_gradients.

    Item i is a dictionary: x, positions [window, nodes, 3], float32, metres; times [window], seconds;
    trajectory and frame, where the window begins; with contact_distance, contacts, a list of [pairs, 2] rows
    of faces, one for each frame; each of the fields, [window, nodes, 3] or [window, tets, 3, 3], float32. Where
    the file has contact edges, contact_edges is a list of int64 [edges, 3] rows for each frame: face, partner
    (id of a trajectory, its own for the body itself; negative: another body or an obstacle, see
    RecordingReader.contact_edges), the partner's face. `edges` holds the graph of the mesh, `rest` the rest
    positions. Files are opened in each process that reads, so any number of workers may.
    """

    def __init__(
        self, path, body, window=3, part="train", contact_distance=None, split="trajectories", fields=()
    ):
        if part not in PARTS:
            raise ValueError(f'part: is "{part}"; allowed: {", ".join(PARTS)}')
        if window < 1:
            raise ValueError(f"window: is {window}; allowed: at least 1")
        self._body_file = None if isinstance(body, Body) else os.fspath(body)
        self.body = load_body(body) if self._body_file else body
        self.path, self.window, self.part, self.split = os.fspath(path), window, part, split
        self.contact_distance, self.fields = contact_distance, tuple(fields)
        self.edges = mesh_edges(self.body.T, self.body.E)
        self.rest = torch.from_numpy(self.body.X.astype(np.float32))
        self._reader, self._process = None, None
        self._windows = self._windows_of(part)

    def _windows_of(self, part):
        """Where the windows of a part begin, [windows, 2]: the trajectory's place in the recording, and the frame."""
        reader = self._open()
        chosen = None
        if part != "all":
            splits = dataset_manifest(self.path)["splits"]
            if self.split not in splits:
                raise ValueError(f'split: is "{self.split}"; allowed: {", ".join(splits)}')
            chosen = set(splits[self.split][part])
        windows = [np.empty((0, 2), int)]
        for index, info in enumerate(reader.trajectories):
            if info.failure or (chosen is not None and info.id not in chosen) or info.frames < self.window:
                continue
            if info.body_hash != self.body.hash:
                raise ValueError(f"{self.path}: trajectory {info.id} is of another body")
            missing = [name for name in self.fields if name not in reader.extras(index)]
            if missing:
                raise ValueError(f"{self.path}: trajectory {info.id} has no {missing[0]}")
            frames = np.arange(info.frames - self.window + 1)
            windows.append(np.stack([np.full_like(frames, index), frames], axis=1))
        return np.concatenate(windows)

    def _open(self):
        """The reader of this process: HDF5 files do not survive a fork."""
        if self._process != os.getpid():
            self._reader, self._process = RecordingReader(self.path), os.getpid()
            self._surface = None
        return self._reader

    def __getstate__(self):
        if not self._body_file:
            raise TypeError("Dataset: name the file of the body instead of a Body to send the dataset to a process")
        return {**self.__dict__, "body": None, "_reader": None, "_process": None, "_surface": None}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self.body = load_body(self._body_file)

    def __len__(self):
        return len(self._windows)

    def place(self, index):
        """Where window `index` begins: the trajectory's place in the recording, and the frame."""
        if not 0 <= index < len(self):
            raise IndexError(f"window {index}; the dataset has {len(self)}")
        trajectory, frame = self._windows[index].tolist()
        return trajectory, frame

    def __getitem__(self, index):
        trajectory, frame = self.place(index)
        reader = self._open()
        x = reader.read(trajectory, frame, self.window)
        item = {
            "x": torch.from_numpy(x),
            "times": torch.from_numpy(reader.times(trajectory)[frame : frame + self.window]),
            "trajectory": trajectory,
            "frame": frame,
        }
        for name in self.fields:
            item[name] = torch.from_numpy(reader.read_field(trajectory, name, frame, self.window))
        if "contact_edges" in reader.extras(trajectory):
            edges = reader.contact_edges(trajectory, frame, self.window)
            item["contact_edges"] = [torch.from_numpy(rows.astype(np.int64)) for rows in edges]
        if self.contact_distance is not None:
            item["contacts"] = [self._contacts(nodes) for nodes in x]
        return item

    def _contacts(self, nodes):
        """Pairs of faces that touch, [pairs, 2]."""
        if self._surface is None:
            X = self.body.surface_X.astype(np.float32)
            near = near_at_rest(X, self.body.F, self.contact_distance)
            self._surface = PosedTree(make_exact_tree(X, self.body.F)), SelfQuery(near)
        posed, query = self._surface
        posed.begin_pose(np.ascontiguousarray(self.body.surface_positions(nodes), np.float32))
        return torch.from_numpy(query.within(posed, self.contact_distance).astype(np.int64))

    def statistics(self, windows=1000):
        """Mean and standard deviation of velocities and accelerations, in metres per frame and frame squared.

        Of evenly spread windows of the split's training part alone, whatever part this is, so that what is
        held out never enters them. Only of a recording without splits, part "all", they are of all windows.
        """
        if self.window < 3:
            raise ValueError("statistics need a window of at least 3 frames")
        has_splits = self.part != "all" or is_dataset(self.path)
        chosen = self._windows_of("train" if has_splits else "all")
        if len(chosen) == 0:
            raise ValueError(f"{self.path}: has no window of {self.window} frames to train on")
        reader, spread = self._open(), chosen[:: max(1, len(chosen) // windows)].tolist()
        x = [torch.from_numpy(reader.read(trajectory, frame, 3)) for trajectory, frame in spread]
        x = torch.stack(x)
        v, a = x[:, 1:] - x[:, :-1], x[:, 2] - 2 * x[:, 1] + x[:, 0]
        return {
            "velocity_mean": v.mean().item(),
            "velocity_std": v.std().item(),
            "acceleration_mean": a.mean().item(),
            "acceleration_std": a.std().item(),
        }
