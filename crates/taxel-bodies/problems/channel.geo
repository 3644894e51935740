// A block with a microchannel of odd shape: gmsh -2 channel.geo -o channel.msh
// mm.
w = 1.2; t = 0.8; h = 0.12;
Point(1) = {-w / 2, 0, 0, h};
Point(2) = {w / 2, 0, 0, h};
Point(3) = {w / 2, t, 0, h};
Point(4) = {-w / 2, t, 0, h};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
// Around the microchannel: a bean that a laser cut.
k = 0.03;
Point(11) = {-0.22, 0.34, 0, k};
Point(12) = {-0.12, 0.28, 0, k};
Point(13) = {0.02, 0.32, 0, k};
Point(14) = {0.18, 0.29, 0, k};
Point(15) = {0.24, 0.38, 0, k};
Point(16) = {0.14, 0.47, 0, k};
Point(17) = {-0.02, 0.45, 0, k};
Point(18) = {-0.17, 0.48, 0, k};
Spline(11) = {11, 12, 13, 14, 15};
Spline(12) = {15, 16, 17, 18, 11};
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {11, 12};
Plane Surface(1) = {1, 2};
Physical Surface("rubber") = {1};
Physical Curve("base") = {1};
Physical Curve("sides") = {2, 4};
Physical Curve("top") = {3};
Physical Curve("wall") = {11, 12};
Mesh.ElementOrder = 2;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
