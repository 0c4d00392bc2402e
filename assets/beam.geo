// A square beam along x. Free to use: CC0.
SetFactory("OpenCASCADE");
Box(1) = {-0.5, -0.06, -0.06, 1, 0.12, 0.12};
Mesh.MeshSizeMax = 0.03;
Mesh.Algorithm = 6;
