#!/usr/bin/env python3
"""Trains the networks of an nbdtree tree file in PyTorch, on a GPU where there is one.

    nbdtree train BODY.h5 DATA.h5 -o TREE.h5 --epochs 1      # topology, representatives and split; then
    training/torch/train.py TREE.h5 DATA.h5 -o BETTER.h5     # the networks, all nodes at once

train.py takes the training frames from TREE.h5, so `nbdtree evaluate` tests the result on the others. Needs
python3-torch and python3-h5py."""
import argparse
import os
import shutil
import sys
import tempfile

import h5py
import numpy as np
import torch


def counter_uniform(seed, stream, counter):
    """counter_uniform() of collision/base/counter_random.hpp, in [0, 1)."""
    mask = (1 << 64) - 1

    def mix(z):
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return z ^ (z >> 31)

    golden = 0x9E3779B97F4A7C15
    key = mix((seed + golden) & mask) ^ mix((stream + 0xD1B54A32D192ED03) & mask)
    return (mix((mix((key + golden * (counter + 1)) & mask) + stream) & mask) >> 11) * 2.0**-53


class Tree:
    """The body, modes and split of a tree file, as tensors."""

    def __init__(self, path, device):
        with h5py.File(path) as file:
            facts, modes = file["facts"], file["bd/modes"]
            self.train_trajectories = facts["train_trajectories"][:]
            self.frame_seed = int(facts.attrs["frame_seed"])
            self.troubled_frames = bool(facts.attrs.get("troubled_frames", 0))
            self.random_share = float(np.float32(facts.attrs["random_frame_share"]))
            self.body = file.attrs["body_sha256"]
            rows, cols, values = (file["embedding"][k][:] for k in ("rows", "cols", "values"))
            shape = (len(rows) - 1, int(file["embedding"].attrs["nodes"]))
            vertex = np.repeat(np.arange(shape[0]), np.diff(rows))
            self.W = torch.sparse_coo_tensor(np.stack([vertex, cols]), values, shape).to(device).coalesce()
            nodes, vertices = file["topology/nodes"][:], file["topology/vertices"][:]
            self.vertices = [torch.from_numpy(vertices[n[4] : n[5]]).long().to(device) for n in nodes]
            self.rest = torch.from_numpy(file["topology/rest_spheres"][:]).to(device)
            self.representatives = torch.from_numpy(modes["representatives"][:]).long().to(device)
            self.w, self.X, self.U = (torch.from_numpy(modes[k][:]).to(device) for k in ("weights", "X", "U"))

    def frames(self, data):
        """Training frames of a recording, one array [frames, nodes, 3] per trajectory."""
        for number in self.train_trajectories:
            trajectory = data[f"trajectories/{number:06d}"]
            if trajectory.attrs["body_sha256"] != self.body:
                sys.exit(f"train.py: trajectory {number} was recorded from another body than the tree's")
            count = trajectory["positions"].shape[0]
            troubled = np.zeros(count, int)
            if "troubled_steps" in trajectory and not self.troubled_frames:
                troubled = trajectory["troubled_steps"][:]
            kept = [
                f
                for f in range(count)
                if troubled[f] == 0 and counter_uniform(self.frame_seed, int(number), f) >= self.random_share
            ]
            yield trajectory["positions"][:][kept]

    def align(self, x):
        """Rigid motions (R, t) from the rest pose to representatives x [poses, k, 3]."""
        w, X, x = self.w.double() / self.w.sum(), self.X.double(), x.double()
        mean_X, mean_x = w @ X, torch.einsum("k,pki->pi", w, x)
        U, _, Vh = torch.linalg.svd(torch.einsum("k,pki,kj->pij", w, x - mean_x[:, None], X - mean_X))
        U = torch.cat([U[..., :2], U[..., 2:] * (torch.det(U) * torch.det(Vh)).sign()[:, None, None]], -1)
        R = U @ Vh
        return R.float(), (mean_x - R @ mean_X).float()

    def labels(self, nodes):
        """Modal coordinates [poses, m] and spheres minus rest spheres [poses, nodes, 4] of tet nodes [poses, N, 3]."""
        poses = nodes.shape[0]
        x = torch.sparse.mm(self.W, nodes.transpose(0, 1).reshape(nodes.shape[1], -1))
        x = x.reshape(-1, poses, 3).transpose(0, 1)
        y = x[:, self.representatives]
        R, t = self.align(y)
        Z = (((y - t[:, None]) @ R - self.X) * self.w[:, None]).flatten(1) @ self.U
        spheres = torch.empty(poses, len(self.vertices), 4, device=x.device)
        for i, vertices in enumerate(self.vertices):
            own = x[:, vertices]
            centre = own.mean(1)
            radius = (own - centre[:, None]).norm(dim=2).amax(1)
            spheres[:, i, :3] = ((centre - t)[:, None] @ R)[:, 0]
            spheres[:, i, 3] = radius
        return Z, spheres - self.rest


def scaled(x, together=False):
    """Scales x element by element to [-1, 1]; returns it with its centre and half range. together: uses the largest
    half range of the last axis for all its elements."""
    low, high = x.amin(0), x.amax(0)
    centre, half = (low + high) / 2, (high - low) / 2
    if together:
        half = half.amax(-1, keepdim=True).expand_as(half)
    return (x - centre) * torch.where(half > 1e-38, 1 / half, torch.zeros_like(half)), centre, half


def linear_centres(Z, spheres):
    """Ridge regression of the centres on scaled modal coordinates: the map [m, 3 nodes], and spheres minus its part."""
    Z = Z.double()
    Z = Z - Z.mean(0)
    moments = Z.t() @ Z
    moments.diagonal().add_(1e-4 * moments.trace() / len(moments) + 1e-30)
    found = torch.linalg.solve(moments, Z.t() @ spheres[..., :3].double().flatten(1))
    rest = spheres.clone()
    rest[..., :3] -= (Z @ found).float().view(*spheres.shape[:2], 3)
    return found.float(), rest


class Networks(torch.nn.Module):
    """One m-h-h-4 network per node, all evaluated at once."""

    def __init__(self, nodes, m, hidden):
        super().__init__()
        sizes = [(hidden, m), (hidden, hidden), (4, hidden)]
        gain = [6.0, 6.0, 3.0]
        self.W = torch.nn.ParameterList(
            [torch.nn.Parameter((torch.rand(nodes, o, i) * 2 - 1) * (g / i) ** 0.5) for (o, i), g in zip(sizes, gain)]
        )
        self.b = torch.nn.ParameterList([torch.nn.Parameter(torch.zeros(nodes, o, 1)) for o, _ in sizes])

    def forward(self, Z):
        h = Z.t().expand(self.W[0].shape[0], -1, -1)
        h = torch.relu(torch.baddbmm(self.b[0], self.W[0], h))
        h = torch.relu(torch.baddbmm(self.b[1], self.W[1], h))
        return torch.baddbmm(self.b[2], self.W[2], h).permute(2, 0, 1)  # [poses, nodes, 4]

    def flat(self):
        """Weights as in a tree file: one row per node, W1, b1, W2, b2, W3, b3, matrices column by column."""
        parts = []
        for W, b in zip(self.W, self.b):
            parts += [W.transpose(1, 2).flatten(1), b.flatten(1)]
        return torch.cat(parts, 1)


def train(Z, targets, options):
    """Adam on the mean squared error; each node's learning rate falls on its own plateaus."""
    poses, nodes = targets.shape[:2]
    networks = Networks(nodes, Z.shape[1], options.hidden).to(Z.device)
    parameters = list(networks.parameters())
    optimizer = torch.optim.Adam(parameters, lr=1.0)  # each node's rate is applied to the step below
    rate = torch.full((nodes,), options.rate, device=Z.device)
    best = torch.full((nodes,), float("inf"), device=Z.device)
    idle = torch.zeros(nodes, device=Z.device)
    for epoch in range(options.epochs):
        order, sums = torch.randperm(poses, device=Z.device), torch.zeros(nodes, device=Z.device)
        for batch in order.split(options.batch):
            loss = (networks(Z[batch]) - targets[batch]).square().mean((0, 2))
            optimizer.zero_grad()
            loss.sum().backward()
            before = [p.detach().clone() for p in parameters]
            optimizer.step()
            with torch.no_grad():
                for p, old in zip(parameters, before):
                    p.copy_(old + rate.view(-1, 1, 1) * (p - old - options.weight_decay * old))
            sums += loss.detach() * len(batch)
        loss = sums / poses
        better = loss < 0.99 * best
        best = torch.where(better, loss, best)
        idle = torch.where(better, torch.zeros_like(idle), idle + 1)
        rate, idle = torch.where(idle > 20, rate / 2, rate), torch.where(idle > 20, torch.zeros_like(idle), idle)
        if epoch % 10 == 0:
            print(f"epoch {epoch}: mean loss {loss.mean():.3e}", flush=True)
        if (rate < 2e-5).all():
            break
    with torch.no_grad():
        loss = sum((networks(c) - t).square().mean((0, 2)) * len(c) for c, t in
                   zip(Z.split(1024), targets.split(1024))) / poses
    return networks.flat().detach(), loss


def write(template, output, numbers, hidden, facts):
    """Writes a copy of the tree with new networks; renames it to `output` once it is complete."""
    folder = os.path.dirname(os.path.abspath(output))
    handle, temporary = tempfile.mkstemp(dir=folder, prefix="." + os.path.basename(output) + ".", suffix=".tmp")
    os.close(handle)
    try:
        shutil.copyfile(template, temporary)
        with h5py.File(temporary, "a") as file:
            if file.attrs["format_version"] < 2:
                sys.exit(f"{template}: is a tree of release 0.1; write it anew with `nbdtree calibrate` first")
            if "nbd" in file:
                modes = file["bd"].get("modes", getlink=True)
                if isinstance(modes, h5py.SoftLink):  # the modes are stored with the old networks
                    del file["bd/modes"]
                    file.move("nbd/modes", "bd/modes")
                del file["nbd"]
            if "calibration/nbd" in file:  # holds only for the old networks; run `nbdtree calibrate` again
                del file["calibration/nbd"]
            group = file.create_group("nbd")
            group["modes"] = h5py.SoftLink("/bd/modes")
            group.attrs["hidden"] = np.int64(hidden)
            for name, values in numbers.items():
                group.create_dataset(name, data=values, fletcher32=True)
            del file["facts/node_loss"]
            file["facts"].create_dataset("node_loss", data=facts["node_loss"], fletcher32=True)
            file["facts"].attrs["poses"] = np.int64(facts["poses"])
        os.replace(temporary, output)
    except BaseException:
        os.unlink(temporary)
        raise


def main():
    parser = argparse.ArgumentParser(description="Trains the networks of an nbdtree tree file in PyTorch.")
    parser.add_argument("tree", help="tree file with topology, representatives and split")
    parser.add_argument("data", help="the recording that the tree was trained on")
    parser.add_argument("-o", "--output", required=True, help="tree file to write")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--epochs", type=int, default=600, help="maximum; training ends earlier when converged")
    parser.add_argument("--hidden", type=int, default=32)
    parser.add_argument("--batch", type=int, default=128)
    parser.add_argument("--rate", type=float, default=5e-3)
    parser.add_argument("--weight-decay", type=float, default=0.1, help="as in nbdtree train; the paper: 0")
    parser.add_argument("--linear-centre", type=int, choices=[0, 1], default=1,
                        help="1: fit a linear part of the centres besides the networks; the paper: 0")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    torch.manual_seed(options.seed)

    tree = Tree(options.tree, options.device)
    Z, spheres = [], []
    with h5py.File(options.data) as data:
        for frames in tree.frames(data):
            for part in torch.from_numpy(frames).split(64):
                c, s = tree.labels(part.to(options.device))
                Z.append(c)
                spheres.append(s)
    Z, z_centre, z_half = scaled(torch.cat(Z))
    spheres = torch.cat(spheres)
    if options.linear_centre:
        centre_map, spheres = linear_centres(Z, spheres)
    targets, out_centre, out_half = scaled(spheres, together=options.linear_centre)
    print(f"{len(Z)} training poses, {targets.shape[1]} nodes, on {options.device}", flush=True)
    weights, loss = train(Z, targets, options)
    numbers = {
        "z_centre": z_centre,
        "z_scale": torch.where(z_half > 1e-38, 1 / z_half, torch.zeros_like(z_half)),
        "weights": weights,
        "out_centre": out_centre.t().contiguous(),
        "out_scale": out_half.t().contiguous(),
    }
    if options.linear_centre:
        numbers["centre_map"] = centre_map
    numbers = {name: values.cpu().numpy() for name, values in numbers.items()}
    write(options.tree, options.output, numbers, options.hidden,
          {"node_loss": loss.cpu().numpy(), "poses": len(Z)})
    print(f"{options.output}: mean loss {loss.mean():.3e}")


if __name__ == "__main__":
    main()
