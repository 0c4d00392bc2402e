"""Deformable solids with learned collision culling.

Surfaces are filled with tetrahedra (mesh_file), simulated (World), recorded (recording), and collided with
each other (CollisionTree, PosedTree, PairQuery). Networks learn the bounds of a tree (make_dataset, train).
Names are those of the C++ library.
"""

from nbdtree._nbdtree import *  # noqa: F401,F403
from nbdtree._nbdtree import __version__, _check_interpreter
from nbdtree._recording import recording

_check_interpreter()
__all__ = [name for name in globals() if not name.startswith("_")]
