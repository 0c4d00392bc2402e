"""The paper's networks in PyTorch, loaded from a file that `nbdtree export TREE.h5 --torch FILE.h5` wrote."""
import h5py
import torch


class NbdTree(torch.nn.Module):
    """Maps surfaces [poses, vertices, 3] to spheres of all nodes, [poses, nodes, 4] (centre, radius; metres)."""

    def __init__(self, path):
        super().__init__()
        with h5py.File(path) as file:
            for name, numbers in file["nbd"].items():
                tensor = torch.from_numpy(numbers[:])
                if name in ("W1", "b1", "W2", "b2", "W3", "b3"):
                    self.register_parameter(name, torch.nn.Parameter(tensor))
                else:
                    self.register_buffer(name, tensor.long() if name == "representatives" else tensor)

    def align(self, x):
        """The rigid motion (R, t) from the rest pose to the representatives x [poses, k, 3]."""
        w = self.w.double() / self.w.sum()
        X, x = self.X.double(), x.double()
        mean_X, mean_x = w @ X, torch.einsum("k,pki->pi", w, x)
        moments = torch.einsum("k,pki,kj->pij", w, x - mean_x[:, None], X - mean_X)
        U, _, Vh = torch.linalg.svd(moments)
        U = torch.cat([U[..., :2], U[..., 2:] * (torch.det(U) * torch.det(Vh)).sign()[:, None, None]], -1)
        R = U @ Vh
        return R.float(), (mean_x - R @ mean_X).float()

    def coordinates(self, x, R, t):
        """The scaled modal coordinates [poses, modes] of representatives x."""
        offset = ((x - t[:, None]) @ R - self.X) * self.w[:, None]
        return (offset.flatten(1) @ self.U - self.z_centre) * self.z_scale

    def networks(self, zn):
        """Scaled outputs [poses, nodes, 4] from scaled modal coordinates [poses, modes]."""
        h = torch.relu(torch.einsum("nhm,pm->pnh", self.W1, zn) + self.b1)
        h = torch.relu(torch.einsum("nkh,pnh->pnk", self.W2, h) + self.b2)
        return torch.einsum("noh,pnh->pno", self.W3, h) + self.b3

    def forward(self, x):
        x = x[:, self.representatives]
        R, t = self.align(x)
        zn = self.coordinates(x, R, t)
        spheres = self.networks(zn) * self.out_scale + self.out_centre + self.rest
        centres = spheres[..., :3] + torch.einsum("nam,pm->pna", self.centre_map, zn)
        centres = centres @ R.transpose(1, 2) + t[:, None]
        return torch.cat([centres, spheres[..., 3:].clamp(min=0)], -1)
