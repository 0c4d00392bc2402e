"""A small graph network that predicts the next frame of a deformable body."""

import torch
from torch import nn


def layers(inputs, hidden, outputs):
    return nn.Sequential(
        nn.Linear(inputs, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU(), nn.Linear(hidden, outputs)
    )


class GraphNetwork(nn.Module):
    """Predicts accelerations by messages along the edges of the mesh.

    The networks see what does not change under rigid motions: lengths and stretches of edges, and how fast
    their ends part, now and a frame ago. They weigh vectors that turn with the body: the edge, and the
    relative velocity and acceleration of its ends. What an edge does to one end it does to the other in the
    opposite direction. Lengths are in mean edges, times in frames.
    """

    def __init__(self, edges, rest, hidden=32, rounds=3):
        """edges: [2, edges], both ways, as Dataset has them; rest: positions [nodes, 3]."""
        super().__init__()
        self.register_buffer("ends", edges[:, edges[0] < edges[1]])
        lengths = (rest[self.ends[1]] - rest[self.ends[0]]).norm(dim=1)
        self.register_buffer("scale", lengths.mean())
        self.register_buffer("lengths", lengths / self.scale)
        self.register_buffer("degree", torch.bincount(edges[0], minlength=len(rest)).float())
        self.encode = layers(5, hidden, hidden)
        self.messages = nn.ModuleList(layers(3 * hidden, hidden, hidden) for _ in range(rounds))
        self.updates = nn.ModuleList(layers(2 * hidden, hidden, hidden) for _ in range(rounds))
        self.weigh = layers(3 * hidden, hidden, 3)
        self.keep = layers(hidden, hidden, 1)  # share of a node's acceleration that lasts

    def gather(self, of_edges, sign=1):
        """Means over the edges of each node, [batch, nodes, ...]; sign: of what the second end gets."""
        a, b = self.ends
        sums = of_edges.new_zeros(of_edges.shape[0], len(self.degree), of_edges.shape[2])
        sums = sums.index_add(1, a, of_edges).index_add(1, b, sign * of_edges)
        return sums / self.degree[None, :, None]

    def beside(self, of_edges, of_nodes):
        """What edges have, with what their ends have, whichever is the first."""
        first, second = of_nodes[:, self.ends[0]], of_nodes[:, self.ends[1]]
        return torch.cat([of_edges, first + second, (first - second).abs()], dim=2)

    def forward(self, x):
        """x: [batch, 4 frames, nodes, 3], metres. Returns accelerations [batch, nodes, 3], metres per frame squared."""
        x = x / self.scale
        a, b = self.ends

        def across(field):
            return field[:, b] - field[:, a]

        edge, relative = across(x[:, 3]), across(x[:, 3] - x[:, 2])
        change = across(x[:, 3] - 2 * x[:, 2] + x[:, 1])
        before = across(x[:, 2] - 2 * x[:, 1] + x[:, 0])
        length = edge.norm(dim=2)
        direction = edge / length.clamp_min(1e-6)[:, :, None]

        def along(field):
            return (field * direction).sum(dim=2)

        rest = self.lengths.expand_as(length)
        stretch = length / rest - 1
        # Limited, so that frames unlike any of the training do not send predictions far off.
        seen = [rest, 10 * stretch, 10 * along(relative), 30 * along(change), 30 * along(before)]
        of_edges = self.encode(3 * torch.tanh(torch.stack(seen, dim=2) / 3))
        of_nodes = self.gather(of_edges)
        for message, update in zip(self.messages, self.updates):
            of_edges = of_edges + message(self.beside(of_edges, of_nodes))
            of_nodes = of_nodes + update(torch.cat([of_nodes, self.gather(of_edges)], dim=2))
        weights = torch.tanh(self.weigh(self.beside(of_edges, of_nodes)))
        pulls = 0.1 * weights[:, :, :1] * direction + weights[:, :, 1:2] * relative + weights[:, :, 2:] * change
        lasting = torch.sigmoid(2 + self.keep(of_nodes)) * (x[:, 3] - 2 * x[:, 2] + x[:, 1])
        return self.scale * (lasting + self.gather(pulls, sign=-1))

    def predict(self, x):
        """The next frame, [batch, nodes, 3], from four frames [batch, 4, nodes, 3]."""
        return 2 * x[:, 3] - x[:, 2] + self(x)
