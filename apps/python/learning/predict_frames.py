"""Trains a graph network to predict the next frame of a body, and races it against extrapolation.

    python3 predict_frames.py FOLDER [--minutes 10] [--csv curve.csv] [--picture curve.png]

FOLDER keeps the body and the dataset, which are made on the first run. Needs python3-torch.
"""

import argparse
import pathlib
import time

import torch

import nbdtree as nbd
import nbdtree.torch
from graph_network import GraphNetwork

ASSETS = pathlib.Path(__file__).resolve().parents[3] / "assets"
WINDOW = 5  # four frames to see, one to predict


def make_data(folder, trajectories, frames):
    """The beam, and trajectories in which it is bent, stretched, pulled and let go, without contact."""
    body_file, data = folder / "beam.h5", folder / "poses.h5"
    if not body_file.exists():
        nbd.save_body(body_file, nbd.mesh_file(ASSETS / "beam.obj"))
    kinds = {kind: {"weight": 0} for kind in ("drop", "thrown", "grips")}
    nbd.make_dataset(nbd.load_body(body_file), data, trajectories=trajectories, frames=frames, seed=1,
                     recipe={"strength": 0.5, "kinds": kinds})
    return body_file, data


def extrapolations(x):
    """Predictions that need no training, from four frames."""
    velocity = x[:, 3] - x[:, 2]
    change = x[:, 3] - 2 * x[:, 2] + x[:, 1]
    return {"constant velocity": x[:, 3] + velocity, "constant acceleration": x[:, 3] + velocity + change}


def error(predicted, true):
    """Sum over windows of the mean squared distance of nodes, m2."""
    return ((predicted - true) ** 2).sum(dim=2).mean(dim=1).sum().item()


@torch.no_grad()
def errors(network, windows, batch=16):
    """Root mean squared errors of one frame, metres: of the network, and of the extrapolations."""
    sums = {}
    for begin in range(0, len(windows), batch):
        x = windows[begin : begin + batch]
        predictions = {"graph network": network.predict(x[:, :4]), **extrapolations(x)}
        for name, predicted in predictions.items():
            sums[name] = sums.get(name, 0) + error(predicted, x[:, 4])
    return {name: (total / len(windows)) ** 0.5 for name, total in sums.items()}


@torch.no_grad()
def rollout_errors(network, path, body_file, frames=10):
    """Root mean squared error after each of `frames` frames that are predicted from predictions, metres."""
    windows = nbdtree.torch.Dataset(path, body_file, window=4 + frames, part="held_out")
    starts = [i for i in range(len(windows)) if windows.place(i)[1] % frames == 0]
    x = torch.stack([windows[i]["x"] for i in starts])
    methods = {"graph network": network.predict,
               "constant velocity": lambda seen: extrapolations(seen)["constant velocity"]}
    found = {}
    for name, predict in methods.items():
        seen = x[:, :4]
        for step in range(frames):
            seen = torch.cat([seen[:, 1:], predict(seen)[:, None]], dim=1)
            found.setdefault(name, []).append((error(seen[:, 3], x[:, 4 + step]) / len(x)) ** 0.5)
    return found


def all_windows(dataset, most):
    step = max(1, len(dataset) // most)
    return torch.stack([dataset[i]["x"] for i in range(0, len(dataset), step)])


def train(network, windows, held_out, minutes, batch=8, noise=3e-4):
    """Adam, its rate falling to zero over the time. Yields (minutes, windows seen, held out errors).

    noise: metres added to the frames that are seen, so that the network learns to bear its own errors.
    """
    spread = (windows[:, 4] - extrapolations(windows)["constant acceleration"]).std()
    optimizer = torch.optim.Adam(network.parameters(), lr=2e-3)
    generator = torch.Generator().manual_seed(1)
    start, seen, reported = time.monotonic(), 0, 0.0
    yield 0.0, 0, errors(network, held_out)
    while (passed := (time.monotonic() - start) / 60) < minutes:
        for group in optimizer.param_groups:
            group["lr"] = 2e-3 * max(1 - passed / minutes, 0.02)
        x = windows[torch.randint(len(windows), (batch,), generator=generator)]
        given = x[:, :4] + noise * torch.randn(x[:, :4].shape, generator=generator)
        loss = (((network.predict(given) - x[:, 4]) / spread) ** 2).mean()
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        seen += batch
        if passed - reported >= minutes / 20:
            reported = passed
            yield passed, seen, errors(network, held_out)
    yield minutes, seen, errors(network, held_out)


def draw(curve, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for name in curve[0][2]:
        axes.plot([row[0] for row in curve], [1e3 * row[2][name] for row in curve], label=name)
    axes.set(xlabel="minutes of training", ylabel="error of the next frame, mm", yscale="log")
    axes.legend()
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--trajectories", type=int, default=60)
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--csv", type=pathlib.Path)
    parser.add_argument("--picture", type=pathlib.Path)
    options = parser.parse_args()
    torch.manual_seed(1)
    torch.set_num_threads(nbd.thread_count())
    options.folder.mkdir(parents=True, exist_ok=True)
    body_file, data = make_data(options.folder, options.trajectories, options.frames)

    parts = {part: nbdtree.torch.Dataset(data, body_file, WINDOW, part) for part in ("train", "held_out")}
    begin = time.monotonic()
    train_windows = all_windows(parts["train"], 4000)
    rate = len(train_windows) * WINDOW / (time.monotonic() - begin)
    held_out = all_windows(parts["held_out"], 100)
    print(f"{len(parts['train'])} windows to train on, {len(parts['held_out'])} held out; read {rate:.0f} frames a second")

    network = GraphNetwork(parts["train"].edges, parts["train"].rest)
    print(f"{sum(p.numel() for p in network.parameters())} weights, {network.ends.shape[1]} edges")
    curve = []
    for row in train(network, train_windows, held_out, options.minutes):
        curve.append(row)
        print(f"{row[0]:5.1f} min, {row[1]:6} windows: " +
              ", ".join(f"{name} {1e3 * value:.4f} mm" for name, value in row[2].items()), flush=True)
    for name, found in rollout_errors(network, data, body_file).items():
        print(f"{name}, error after 1, 5, 10 frames: " + ", ".join(f"{1e3 * found[i]:.3f}" for i in (0, 4, 9)) + " mm")
    torch.save(network.state_dict(), options.folder / "network.pt")
    if options.csv:
        names = list(curve[0][2])
        lines = [",".join(["minutes", "windows", *(f"{name} (m)" for name in names)])]
        lines += [",".join([f"{row[0]:.2f}", str(row[1]), *(f"{row[2][name]:.4g}" for name in names)]) for row in curve]
        options.csv.write_text("\n".join(lines) + "\n")
    if options.picture:
        draw(curve, options.picture)


if __name__ == "__main__":
    main()
