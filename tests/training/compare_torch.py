#!/usr/bin/python3
"""CPU time of training per pose and node on one core, compared with the same loop in PyTorch.

The networks (128-32-32-4, ReLU), the batch (128), the loss (L2) and the optimiser (Adam) are the same. PyTorch
trains all nodes as one model with batched products, as the paper does. Both run alternately on one thread; the script
prints medians.
"""
import argparse
import statistics
import subprocess
import time

import torch

NODES, POSES, BATCH, MODES, HIDDEN, OUTPUTS = 255, 4096, 128, 128, 32, 4


def layer(rows, columns):
    bound = (6 / rows) ** 0.5
    weight = ((2 * torch.rand(NODES, rows, columns) - 1) * bound).requires_grad_()
    return weight, torch.zeros(NODES, 1, columns, requires_grad=True)


def torch_microseconds(steps=12, warm=3):
    inputs, targets = torch.rand(POSES, MODES) * 2 - 1, torch.rand(NODES, POSES, OUTPUTS) * 2 - 1
    layers = [layer(MODES, HIDDEN), layer(HIDDEN, HIDDEN), layer(HIDDEN, OUTPUTS)]
    optimiser = torch.optim.Adam([p for pair in layers for p in pair], lr=5e-3)
    order = torch.randperm(POSES)
    for step in range(warm + steps):
        if step == warm:
            start = time.process_time()
        rows = order[step * BATCH % POSES:][:BATCH]
        h = inputs[rows].expand(NODES, BATCH, MODES)
        for i, (weight, bias) in enumerate(layers):
            h = torch.baddbmm(bias, h, weight)
            if i < 2:
                h = torch.relu(h)
        # Means over each node's batch, summed over nodes, keep the gradients of the nodes independent.
        loss = ((h - targets[:, rows]) ** 2).mean(dim=(1, 2)).sum()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return 1e6 * (time.process_time() - start) / (steps * BATCH * NODES)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="build/release/tests/training/time_training")
    program = parser.parse_args().program
    torch.manual_seed(1)
    torch.set_num_threads(1)
    ours, theirs = [], []
    for _ in range(5):
        ours.append(float(subprocess.run([program, str(POSES), "30"], check=True, capture_output=True,
                                         text=True).stdout))
        theirs.append(torch_microseconds())
    print(f"ours    {statistics.median(ours):.3f} us per pose and node  (runs: {' '.join(f'{t:.3f}' for t in ours)})")
    print(f"PyTorch {statistics.median(theirs):.3f} us per pose and node  "
          f"(runs: {' '.join(f'{t:.3f}' for t in theirs)}), version {torch.__version__}")


if __name__ == "__main__":
    main()
