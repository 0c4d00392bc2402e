"""Datasets for PyTorch: windows of frames of a recording, with the graph of the body and its contact with itself."""

import bisect
import os

import numpy as np
import torch

from nbdtree import Body, PosedTree, RecordingReader, SelfQuery, dataset_manifest, load_body, make_exact_tree, near_at_rest

PARTS = ("train", "held_out", "all")


def mesh_edges(T):
    """Edges of tetrahedra, both ways: [2, edges], int64, sorted."""
    pairs = np.vstack([T[:, [i, j]] for i in range(4) for j in range(4) if i != j])
    return torch.from_numpy(np.unique(pairs, axis=0).T.astype(np.int64))


class Dataset(torch.utils.data.Dataset):
    """Windows of consecutive frames of one body.

    path: a recording or dataset. body: the Body that it is of, or its file, which worker processes that are
    spawned rather than forked need. window: frames in a window. part: "train" or
    "held_out" trajectories of a dataset, or "all"; failed trajectories are in none. contact_distance: if given,
    an item also tells which faces of the surface touch others of it, metres; pairs that are as near at rest
    are left out.

    Item i is a dictionary: x, positions [window, nodes, 3], float32, metres; times [window], seconds;
    trajectory and frame, where the window begins; with contact_distance, contacts, a list of [pairs, 2] rows
    of faces, one for each frame. `edges` holds the graph of the mesh, `rest` the rest positions. Files are
    opened in each process that reads, so any number of workers may.
    """

    def __init__(self, path, body, window=3, part="train", contact_distance=None):
        if part not in PARTS:
            raise ValueError(f'part: is "{part}"; allowed: {", ".join(PARTS)}')
        if window < 1:
            raise ValueError(f"window: is {window}; allowed: at least 1")
        self._body_file = None if isinstance(body, Body) else os.fspath(body)
        self.body = load_body(body) if self._body_file else body
        self.path, self.window, self.part = os.fspath(path), window, part
        self.contact_distance = contact_distance
        self.edges = mesh_edges(self.body.T)
        self.rest = torch.from_numpy(self.body.X.astype(np.float32))
        self._reader, self._process = None, None
        self._select()

    def _select(self):
        reader = self._open()
        chosen = None
        if self.part != "all":
            chosen = set(dataset_manifest(self.path)[f"{self.part}_trajectories"])
        self._trajectories, self._ends = [], []
        for index, info in enumerate(reader.trajectories):
            if info.failure or (chosen is not None and info.id not in chosen) or info.frames < self.window:
                continue
            if info.body_hash != self.body.hash:
                raise ValueError(f"{self.path}: trajectory {info.id} is of another body")
            self._trajectories.append(index)
            self._ends.append(len(self) + info.frames - self.window + 1)

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
        return self._ends[-1] if self._ends else 0

    def place(self, index):
        """Where window `index` begins: the trajectory's place in the recording, and the frame."""
        if not 0 <= index < len(self):
            raise IndexError(f"window {index}; the dataset has {len(self)}")
        at = bisect.bisect_right(self._ends, index)
        return self._trajectories[at], index - (self._ends[at - 1] if at else 0)

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
        """Mean and standard deviation of velocities and accelerations, of evenly spread windows of this dataset.

        In metres per frame and frame squared; take them of the training part alone.
        """
        if self.window < 3:
            raise ValueError("statistics need a window of at least 3 frames")
        step = max(1, len(self) // windows)
        x = torch.stack([self[i]["x"][:3] for i in range(0, len(self), step)])
        v, a = x[:, 1:] - x[:, :-1], x[:, 2] - 2 * x[:, 1] + x[:, 0]
        return {
            "velocity_mean": v.mean().item(),
            "velocity_std": v.std().item(),
            "acceleration_mean": a.mean().item(),
            "acceleration_std": a.std().item(),
        }
