// A block of two layers, 8 x 8 x 4 mm: 1 mm of dermis below 3 mm of subcutaneous tissue.
// gmsh -3 -format msh41 -o two-layer.msh two-layer.geo
n = 10;
Point(1) = {-4, -4, 0};
line[] = Extrude {8, 0, 0} { Point{1}; Layers{n}; };
face[] = Extrude {0, 8, 0} { Line{line[1]}; Layers{n}; Recombine; };
skin[] = Extrude {0, 0, 1} { Surface{face[1]}; Layers{3}; Recombine; };
fat[] = Extrude {0, 0, 3} { Surface{skin[0]}; Layers{4}; Recombine; };
Physical Volume("dermis") = {skin[1]};
Physical Volume("subcutaneous") = {fat[1]};
Physical Surface("touched") = {face[1]};
Physical Surface("held") = {fat[0]};
