"""Records a world while it is stepped."""

import os
from contextlib import contextmanager

from nbdtree._nbdtree import RecordingWriter


class WorldRecording:
    """Frames of a world on their way to a file; see recording()."""

    def __init__(self, world, writer):
        self._world = world
        self._writer = writer
        self._handles = [
            writer.begin_trajectory(
                nodes=len(world.positions(body)),
                id=body,
                body_hash=world.bodies[body].hash,
                seed=world.seed,
                recipe=world.scene,
            )
            for body in range(len(world))
        ]

    def add_frame(self):
        """Adds the world as it is now."""
        for body, handle in enumerate(self._handles):
            self._writer.add_frame(handle, self._world.time, self._world.positions(body))


@contextmanager
def recording(world, path, scene_file=None):
    """Records a world: call add_frame() of what this gives for every frame.

    The file is the one that `nbdtree simulate` writes: a trajectory for each body, of float32 positions. It
    has its name only when the block ends; an exception removes it. scene_file: where the world's scene was
    read, so that `nbdtree view` finds the bodies.
    """
    with RecordingWriter(path) as writer:
        if scene_file is not None:
            writer.label("scene_file", os.path.relpath(scene_file, os.path.dirname(os.path.abspath(path))))
        yield WorldRecording(world, writer)
