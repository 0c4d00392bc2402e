// A ring, axis y. Free to use: CC0.
SetFactory("OpenCASCADE");
Torus(1) = {0, 0, 0, 0.42, 0.08};
Rotate {{1, 0, 0}, {0, 0, 0}, Pi / 2} { Volume{1}; }
Mesh.MeshSizeMax = 0.036;
Mesh.Algorithm = 6;
