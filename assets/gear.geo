// A gear of 12 straight teeth with a bore, axis z. Free to use: CC0.
SetFactory("OpenCASCADE");
teeth = 12;
root = 0.37;       // radius between the teeth
tip = 0.50;
bore = 0.14;
thickness = 0.20;
For k In {0 : teeth - 1}
  turn = 2 * Pi * k / teeth;
  // A tooth narrows from 56 % of its pitch at the root to 32 % at the tip.
  For c In {0 : 3}
    radius = (c == 0 || c == 3) ? root : tip;
    share = (c == 0) ? -0.28 : (c == 1) ? -0.16 : (c == 2) ? 0.16 : 0.28;
    Point(1 + 4 * k + c) = {radius * Cos(turn + share * 2 * Pi / teeth),
                            radius * Sin(turn + share * 2 * Pi / teeth), -thickness / 2};
  EndFor
EndFor
For i In {1 : 4 * teeth}
  Line(i) = {i, i % (4 * teeth) + 1};
EndFor
Curve Loop(1) = {1 : 4 * teeth};
Circle(1000) = {0, 0, -thickness / 2, bore};
Curve Loop(2) = {1000};
Plane Surface(1) = {1, 2};
Extrude {0, 0, thickness} { Surface{1}; }
MeshSize {:} = 0.042;
Mesh.MeshSizeMax = 0.042;
Mesh.Algorithm = 6;
