"""Uses the Python package that lies beside nothing of its own: portable_wheel.py ASSETS; tests/portable runs it."""

import pathlib
import re
import sys

import numpy as np

import nbdtree as nbd

beam = nbd.mesh_file(pathlib.Path(sys.argv[1]) / "beam.obj")
world = nbd.World({"bodies": [{"body": beam, "transform": {"translate": [0, 0, 1]}}]})
before = world.positions(0).copy()
for _ in range(10):
    world.step(0.01)
fall = np.mean(world.positions(0)[:, 2] - before[:, 2])
assert -0.06 < fall < -0.04, fall  # 9.81 * 0.1**2 / 2 = 0.049

# Nothing but glibc, the compiler's libraries and Python comes from outside of the package.
loaded = sorted(set(re.findall(r"/\S+\.so[.\d]*", pathlib.Path("/proc/self/maps").read_text())))
folder = pathlib.Path(nbd.__file__).resolve().parent
ours = [path for path in loaded if pathlib.Path(path).is_relative_to(folder)]
assert len(ours) > 100, ours
[chosen] = [path for path in ours if "libnbdtree-cpython" in path]
print(f"Python {sys.version.split()[0]}, numpy {np.__version__}: {len(ours)} libraries, {pathlib.Path(chosen).relative_to(folder)}")
