"""Makes the meshes of tests/gmsh.rs: python make.py, with gmsh of PyPI (4.15.2).

A plate of 2 x 1 and a block of 2 x 1 x 0.5, with the regions "soft" (x < 1) and "hard", the
surfaces "left" and "top", and the point "corner" at the origin.
"""

import gmsh

KINDS = {  # name: (dimension, recombined, order, incomplete)
    "tri3": (2, False, 1, 0),
    "tri6": (2, False, 2, 0),
    "quad4": (2, True, 1, 0),
    "quad8": (2, True, 2, 1),
    "quad9": (2, True, 2, 0),
    "tet4": (3, None, 1, 0),
    "tet10": (3, None, 2, 0),
    "wedge6": (3, False, 1, 0),
    "wedge15": (3, False, 2, 1),
    "wedge18": (3, False, 2, 0),
    "hex8": (3, True, 1, 0),
    "hex20": (3, True, 2, 1),
    "hex27": (3, True, 2, 0),
    "xz": (2, True, 2, 0),
    "pyramid": (3, True, 1, 0),
}


def box(kind):
    dimension, recombined, order, incomplete = KINDS[kind]
    gmsh.clear()
    geo = gmsh.model.geo
    up = (lambda x, y: (x, 0, y)) if kind == "xz" else (lambda x, y: (x, y, 0))
    p = {(x, y): geo.addPoint(*up(x, y), 1.0) for x in (0, 1, 2) for y in (0, 1)}
    line = lambda a, b: geo.addLine(p[a], p[b])
    bottom = [line((0, 0), (1, 0)), line((1, 0), (2, 0))]
    right, middle, left = line((2, 0), (2, 1)), line((1, 0), (1, 1)), line((0, 0), (0, 1))
    top = [line((0, 1), (1, 1)), line((1, 1), (2, 1))]
    soft = geo.addPlaneSurface([geo.addCurveLoop([bottom[0], middle, -top[0], -left])])
    hard = geo.addPlaneSurface([geo.addCurveLoop([bottom[1], right, -top[1], -middle])])
    regions, sides = [soft, hard], [[left], top]
    if dimension == 3:
        layers = [] if recombined is None else [2]
        out = [geo.extrude([(2, s)], 0, 0, 0.5, numElements=layers, recombine=recombined is not None)
               for s in regions]
        regions = [o[1][1] for o in out]
        # Sides in the order of the loop, behind top and volume.
        sides = [[out[0][5][1]], [out[0][0][1], out[1][0][1]]]
    geo.synchronize()
    if recombined:
        for surface in (soft, hard):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            gmsh.model.mesh.setRecombine(2, surface)
    for name, tag in zip(("soft", "hard"), regions):
        gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
    for name, tags in zip(("left", "top"), sides):
        gmsh.model.addPhysicalGroup(dimension - 1, tags, name=name)
    gmsh.model.addPhysicalGroup(0, [p[0, 0]], name="corner")
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    gmsh.model.mesh.generate(dimension)
    gmsh.model.mesh.setOrder(order)


def pyramid():
    gmsh.clear()
    gmsh.model.addDiscreteEntity(3, 1)
    nodes = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 1]
    gmsh.model.mesh.addNodes(3, 1, [1, 2, 3, 4, 5], nodes)
    gmsh.model.mesh.addElementsByType(1, 7, [1], [1, 2, 3, 4, 5])
    gmsh.model.addPhysicalGroup(3, [1], name="soft")


gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 1)
for kind in KINDS:
    pyramid() if kind == "pyramid" else box(kind)
    all_formats = kind in ("tri6", "wedge15", "hex27")
    for version, binary in ((4.1, 1), (4.1, 0), (2.2, 1), (2.2, 0)) if all_formats else ((4.1, 1),):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(f"{kind}-{version}-{'binary' if binary else 'text'}.msh")
gmsh.finalize()
