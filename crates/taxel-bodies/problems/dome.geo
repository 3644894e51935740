// Half of the section of a soft dome: gmsh -2 dome.geo -o dome.msh
// Radius first, axis second; mm.
R = 5; lower = 3; upper = 2.5; depth = 1.5; h = 0.6;
Point(1) = {0, 0, 0, h};
Point(2) = {lower, 0, 0, h / 2};
Point(3) = {R, 0, 0, h / 2};
Point(4) = {0, R, 0, h / 2};
Point(5) = {0, R - depth, 0, h};
Point(6) = {upper, R - depth, 0, h / 2};
Line(1) = {1, 2};
Line(2) = {2, 3};
Circle(3) = {3, 1, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Line(6) = {5, 6};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};
// The upper electrode lies inside.
Curve{6} In Surface{1};
Physical Surface("silicone") = {1};
Physical Curve("base") = {1, 2};
Physical Curve("lower_electrode") = {1};
Physical Curve("upper_electrode") = {6};
Physical Curve("skin") = {3};
Physical Curve("axis") = {4, 5};
Physical Point("tip") = {4};
Mesh.ElementOrder = 2;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
