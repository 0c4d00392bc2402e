"""Opens the output of `nbdtree simulate --vtu --obj` with VTK's own readers, as ParaView does, and compares it with the
recording.

Usage: read_with_vtk.py RECORDING BODY FOLDER OBJ_FOLDER FRAMES STEP_SECONDS

BODY is the file of both bodies.
"""
import pathlib
import sys
import xml.etree.ElementTree

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkIOGeometry import vtkOBJReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

folder, obj_folder, frames, dt = pathlib.Path(sys.argv[3]), pathlib.Path(sys.argv[4]), int(sys.argv[5]), float(sys.argv[6])
complaints = []


def read(reader, path):
    """Returns the reader's output and collects VTK's errors and warnings."""
    for event in (vtkCommand.ErrorEvent, vtkCommand.WarningEvent):
        reader.AddObserver(event, lambda *_: complaints.append(str(path)))
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def field(data, name, rows, columns):
    array = data.GetArray(name)
    assert array is not None, f"no field {name}"
    assert (array.GetNumberOfTuples(), array.GetNumberOfComponents()) == (rows, columns), name
    values = vtk_to_numpy(array)
    assert np.isfinite(values).all(), name
    return values


with h5py.File(sys.argv[1]) as recording:
    bodies = [t["positions"][:] for _, t in sorted(recording["trajectories"].items())]
    times = recording["trajectories/000000/times"][:]
with h5py.File(sys.argv[2]) as body:
    first, nodes, weights = (body["embedding"][name][:] for name in ("rows", "cols", "values"))
    faces = len(body["surface/faces"])
positions = np.concatenate(bodies, axis=1)
assert len(positions) == frames
assert len(bodies) == 2

collection = xml.etree.ElementTree.parse(folder / "scene.pvd").getroot()
assert collection.attrib["type"] == "Collection"
entries = [entry.attrib for entry in collection.iter("DataSet")]
assert [entry["file"] for entry in entries] == [f"scene_{f:06}.vtu" for f in range(frames)]
assert np.allclose([float(entry["timestep"]) for entry in entries], times)

largest_stress = largest_force = 0
for f, entry in enumerate(entries):
    grid = read(vtkXMLUnstructuredGridReader(), folder / entry["file"])
    n, cells = grid.GetNumberOfPoints(), grid.GetNumberOfCells()
    assert n == positions.shape[1] and cells > 0
    points = vtk_to_numpy(grid.GetPoints().GetData())
    assert np.array_equal(points, positions[f])
    displacement = field(grid.GetPointData(), "displacement", n, 3)
    assert np.allclose(displacement, positions[f] - positions[0], atol=1e-6)
    velocity = field(grid.GetPointData(), "velocity", n, 3)
    if f > 0:  # with one step per frame, the weights of the rule lead from velocities to ways
        way = positions[f] - positions[f - 1]
        mean = 5 / 9 * velocity + 7 / 18 * last[0] + 1 / 18 * last[-1]
        assert np.allclose(mean * dt, way, atol=2e-3 * np.abs(way).max())
    last = [velocity, last[0] if f > 0 else velocity]
    force = field(grid.GetPointData(), "contact_force", n, 3)
    body = field(grid.GetCellData(), "body", cells, 1)
    stress = field(grid.GetCellData(), "von_mises", cells, 1)
    assert stress.min() >= 0
    if f == 0:
        assert stress.max() < 1e-6 * 1e5 and not force.any()
    largest_stress, largest_force = max(largest_stress, stress.max()), max(largest_force, np.abs(force).max())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(cells, 4)
    owner = np.repeat([0, 1], [b.shape[1] for b in bodies])
    assert (owner[corners] == body[:, None]).all() and set(body) == {0, 1}
    x = points[corners].astype(float)
    assert (np.linalg.det(x[:, 1:] - x[:, :1]) > 0).all()
    for b, name in enumerate(("0_lower", "1_upper")):
        surface = read(vtkOBJReader(), obj_folder / f"{name}_{f:06}.obj")
        vertices = vtk_to_numpy(surface.GetPoints().GetData())
        assert surface.GetNumberOfPolys() == faces
        embedded = np.add.reduceat(weights[:, None] * bodies[b][f][nodes], first[:-1])
        assert np.allclose(vertices, embedded, atol=1e-6)
assert largest_stress > 10 and largest_force > 0.01, (largest_stress, largest_force)
assert not complaints, complaints
