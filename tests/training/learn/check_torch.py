"""Compares the exported networks in PyTorch with the spheres that nbdtree computes.

Usage: check_torch.py FOLDER_OF_THE_MODULE EXPORTED POSES
"""
import sys

import h5py
import torch

sys.path.insert(0, sys.argv[1])
from nbd_tree import NbdTree  # noqa: E402

tree = NbdTree(sys.argv[2])
with h5py.File(sys.argv[3]) as file:
    x, expected = torch.from_numpy(file["x"][:]), torch.from_numpy(file["spheres"][:])
# The tolerance allows for nbdtree rounding hidden layers to 8 bits.
with torch.no_grad():
    spheres = tree(x.view(len(x), -1, 3)).flatten(1)
error = (spheres - expected).abs().max().item()
assert expected.std() > 0.1 and error < 1e-2 * expected.abs().max().item(), error
# The networks remain trainable.
tree.networks(torch.rand(3, tree.W1.shape[2])).square().mean().backward()
assert tree.W1.grad.abs().max() > 0 and len(list(tree.parameters())) == 6
