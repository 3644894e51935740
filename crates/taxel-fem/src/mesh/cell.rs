//! Shapes of cells and of their sides: nodes, shape functions, quadrature.

/// Shape of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CellShape {
    /// Quadrilateral, 9 nodes.
    Quad9,
    /// Triangle with a node in its middle, 7 nodes.
    Tri7,
    /// Hexahedron, 27 nodes.
    Hex27,
    /// Tetrahedron with nodes in the middles of its faces and in its own, 15 nodes.
    Tet15,
}

/// Shape of a side of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FacetShape {
    /// Edge with its ends first and its middle last.
    Line3,
    /// Side of a hexahedron.
    Quad9,
    /// Side of a tetrahedron.
    Tri7,
}

/// A point of the reference cell with its weight.
#[derive(Clone, Copy, Debug)]
pub struct QuadraturePoint {
    /// Reference coordinates: -1..1 on quadrilaterals and hexahedra, barycentric
    /// (first, second, third) on triangles and tetrahedra.
    pub at: [f64; 3],
    /// Weight; the weights add up to the measure of the reference cell.
    pub weight: f64,
}

/// Values and reference gradients of the shape functions at a point.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// Value for each node.
    pub values: Vec<f64>,
    /// Gradient for each node in reference coordinates.
    pub gradients: Vec<[f64; 3]>,
}

/// Six Gauss points of a line.
const GAUSS6: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_35),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_35),
];

const GAUSS3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

/// Gauss and Lobatto's five points, exact to degree 7.
const LOBATTO5: [(f64, f64); 5] = [
    (-1.0, 0.1),
    (-0.654_653_670_707_977_1, 49.0 / 90.0),
    (0.0, 32.0 / 45.0),
    (0.654_653_670_707_977_1, 49.0 / 90.0),
    (1.0, 0.1),
];

/// Nine points, exact to degree 15.
const LOBATTO9: [(f64, f64); 9] = [
    (-1.0, 1.0 / 36.0),
    (-0.899_757_995_411_460_2, 0.165_495_361_560_805_5),
    (-0.677_186_279_510_737_7, 0.274_538_712_500_161_7),
    (-0.363_117_463_826_178_2, 0.346_428_510_973_046_3),
    (0.0, 0.371_519_274_376_417_2),
    (0.363_117_463_826_178_2, 0.346_428_510_973_046_3),
    (0.677_186_279_510_737_7, 0.274_538_712_500_161_7),
    (0.899_757_995_411_460_2, 0.165_495_361_560_805_5),
    (1.0, 1.0 / 36.0),
];

/// Places (-1, 0, 1) of the nodes of the 27-node hexahedron in VTK's order.
const HEX: [[i8; 3]; 27] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
    [0, -1, 1],
    [1, 0, 1],
    [0, 1, 1],
    [-1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
    [-1, 0, 0],
    [1, 0, 0],
    [0, -1, 0],
    [0, 1, 0],
    [0, 0, -1],
    [0, 0, 1],
    [0, 0, 0],
];

/// Places of the nodes of the 9-node quadrilateral.
const QUAD: [[i8; 3]; 9] = [
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
    [0, -1, 0],
    [1, 0, 0],
    [0, 1, 0],
    [-1, 0, 0],
    [0, 0, 0],
];

/// Edges of triangle and tetrahedron in VTK's order.
const TRI_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// Faces of the tetrahedron, outward.
const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

impl CellShape {
    /// Number of nodes.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Quad9 => 9,
            Self::Tri7 => 7,
            Self::Hex27 => 27,
            Self::Tet15 => 15,
        }
    }

    /// Number of space dimensions.
    pub const fn dimension(self) -> usize {
        match self {
            Self::Quad9 | Self::Tri7 => 2,
            Self::Hex27 | Self::Tet15 => 3,
        }
    }

    /// Number of corners; they come first among the nodes.
    pub const fn corner_count(self) -> usize {
        match self {
            Self::Tri7 => 3,
            Self::Quad9 | Self::Tet15 => 4,
            Self::Hex27 => 8,
        }
    }

    /// Shape of the sides.
    pub const fn facet_shape(self) -> FacetShape {
        match self {
            Self::Quad9 | Self::Tri7 => FacetShape::Line3,
            Self::Hex27 => FacetShape::Quad9,
            Self::Tet15 => FacetShape::Tri7,
        }
    }

    /// Local nodes of each side, in the order of the side's own shape, outward.
    pub const fn sides(self) -> &'static [&'static [u8]] {
        match self {
            Self::Quad9 => &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]],
            Self::Tri7 => &[&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]],
            Self::Hex27 => &[
                &[0, 4, 7, 3, 16, 15, 19, 11, 20],
                &[1, 2, 6, 5, 9, 18, 13, 17, 21],
                &[0, 1, 5, 4, 8, 17, 12, 16, 22],
                &[3, 7, 6, 2, 19, 14, 18, 10, 23],
                &[0, 3, 2, 1, 11, 10, 9, 8, 24],
                &[4, 5, 6, 7, 12, 13, 14, 15, 25],
            ],
            Self::Tet15 => &[
                &[0, 2, 1, 6, 5, 4, 10],
                &[0, 1, 3, 4, 8, 7, 11],
                &[1, 2, 3, 5, 9, 8, 12],
                &[0, 3, 2, 7, 9, 6, 13],
            ],
        }
    }

    /// Reference coordinates of a node.
    pub fn node_at(self, node: usize) -> [f64; 3] {
        let middle = |corners: &[usize]| {
            let mut at = [0.0; 3];
            for &corner in corners {
                if corner > 0 {
                    at[corner - 1] += 1.0 / corners.len() as f64;
                }
            }
            at
        };
        match self {
            Self::Quad9 => QUAD[node].map(f64::from),
            Self::Hex27 => HEX[node].map(f64::from),
            Self::Tri7 => match node {
                0..3 => middle(&[node]),
                3..6 => middle(&TRI_EDGES[node - 3]),
                _ => middle(&[0, 1, 2]),
            },
            Self::Tet15 => match node {
                0..4 => middle(&[node]),
                4..10 => middle(&TET_EDGES[node - 4]),
                10..14 => middle(&TET_FACES[node - 10]),
                _ => middle(&[0, 1, 2, 3]),
            },
        }
    }

    /// Shape functions at a point of the reference cell.
    pub fn shapes(self, at: [f64; 3]) -> Shapes {
        match self {
            Self::Quad9 => tensor_shapes(&QUAD, 2, at),
            Self::Hex27 => tensor_shapes(&HEX, 3, at),
            Self::Tri7 => simplex_shapes(2, &TRI_EDGES, &[], at),
            Self::Tet15 => simplex_shapes(3, &TET_EDGES, &TET_FACES, at),
        }
    }

    /// Quadrature with points at the corners of the cell and more of them within, for cells whose
    /// deformation varies strongly: an energy that grows without bound as the volume vanishes
    /// then keeps them from turning inside out between its points. Of two such rules `finer` has
    /// more points.
    pub fn closed_quadrature(self, finer: bool) -> Vec<QuadraturePoint> {
        let line: &[(f64, f64)] = if finer { &LOBATTO9 } else { &LOBATTO5 };
        let parts = if finer { 4 } else { 2 };
        match self {
            Self::Quad9 => products(line, 2),
            Self::Hex27 => products(line, 3),
            Self::Tri7 => closed_simplex(&TRIANGLE_PARTS, &[[0, 1, 2]], parts),
            Self::Tet15 => closed_simplex(&TETRAHEDRON_PARTS, &TET_FACES, parts),
        }
    }

    /// Quadrature of the stiffness: exact for it on an undistorted cell.
    pub fn quadrature(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Quad9 => tensor_points(2),
            Self::Hex27 => tensor_points(3),
            Self::Tri7 => triangle_points(),
            Self::Tet15 => tetrahedron_points(),
        }
    }
}

impl FacetShape {
    /// Number of corners; they are the first nodes.
    pub const fn corner_count(self) -> usize {
        match self {
            Self::Line3 => 2,
            Self::Tri7 => 3,
            Self::Quad9 => 4,
        }
    }

    /// Number of nodes.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Line3 => 3,
            Self::Quad9 => 9,
            Self::Tri7 => 7,
        }
    }

    /// Shape functions at a point of the reference side.
    pub fn shapes(self, at: [f64; 3]) -> Shapes {
        match self {
            Self::Line3 => tensor_shapes(&[[-1, 0, 0], [1, 0, 0], [0, 0, 0]], 1, at),
            Self::Quad9 => CellShape::Quad9.shapes(at),
            Self::Tri7 => CellShape::Tri7.shapes(at),
        }
    }

    /// Quadrature of what begins somewhere within a side, such as a fold.
    pub fn fine_quadrature(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Line3 => products(&GAUSS6, 1),
            Self::Quad9 => products(&GAUSS6, 2),
            Self::Tri7 => self.quadrature(),
        }
    }

    /// Quadrature of surface loads.
    pub fn quadrature(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Line3 => tensor_points(1),
            Self::Quad9 => tensor_points(2),
            Self::Tri7 => triangle_points(),
        }
    }
}

/// Products of the three quadratic functions of a line.
fn tensor_shapes(nodes: &[[i8; 3]], dimension: usize, at: [f64; 3]) -> Shapes {
    let value = |place: i8, x: f64| match place {
        -1 => x * (x - 1.0) / 2.0,
        0 => 1.0 - x * x,
        _ => x * (x + 1.0) / 2.0,
    };
    let slope = |place: i8, x: f64| match place {
        -1 => x - 0.5,
        0 => -2.0 * x,
        _ => x + 0.5,
    };
    let product = |node: &[i8; 3], derived: Option<usize>| {
        (0..dimension)
            .map(|d| {
                if derived == Some(d) {
                    slope(node[d], at[d])
                } else {
                    value(node[d], at[d])
                }
            })
            .product()
    };
    let mut shapes = Shapes {
        values: nodes.iter().map(|node| product(node, None)).collect(),
        gradients: vec![[0.0; 3]; nodes.len()],
    };
    for (gradient, node) in shapes.gradients.iter_mut().zip(nodes) {
        for (d, component) in gradient.iter_mut().enumerate().take(dimension) {
            *component = product(node, Some(d));
        }
    }
    shapes
}

/// A value with its gradient in barycentric coordinates.
#[derive(Clone, Copy)]
struct Jet(f64, [f64; 4]);

impl Jet {
    fn times(self, other: Self) -> Self {
        Self(
            self.0 * other.0,
            std::array::from_fn(|k| self.1[k] * other.0 + self.0 * other.1[k]),
        )
    }
    fn plus(self, factor: f64, other: Self) -> Self {
        Self(
            self.0 + factor * other.0,
            std::array::from_fn(|k| self.1[k] + factor * other.1[k]),
        )
    }
    fn scaled(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1.map(|x| x * factor))
    }
}

/// Quadratic functions of a simplex, with bubbles on its faces and inside, made nodal.
fn simplex_shapes(
    dimension: usize,
    edges: &[[usize; 2]],
    faces: &[[usize; 3]],
    at: [f64; 3],
) -> Shapes {
    let corners = dimension + 1;
    let l: Vec<Jet> = (0..corners)
        .map(|corner| {
            let mut gradient = [0.0; 4];
            gradient[corner] = 1.0;
            let value = if corner == 0 {
                1.0 - at[..dimension].iter().sum::<f64>()
            } else {
                at[corner - 1]
            };
            Jet(value, gradient)
        })
        .collect();
    let product = |of: &[usize]| of[1..].iter().fold(l[of[0]], |jet, &k| jet.times(l[k]));
    let inside: Vec<usize> = (0..corners).collect();
    let whole = product(&inside).scaled((corners as f64).powi(corners as i32));
    // Faces: 27 La Lb Lc, less its value (27/64) in the middle of the tetrahedron.
    let on_faces: Vec<Jet> = faces
        .iter()
        .map(|face| product(face).scaled(27.0).plus(-27.0 / 64.0, whole))
        .collect();
    let share = |jet: Jet, of: &[usize], value_on_face: f64, value_inside: f64| {
        let mut jet = jet;
        for (face, bubble) in faces.iter().zip(&on_faces) {
            if of.iter().all(|corner| face.contains(corner)) {
                jet = jet.plus(-value_on_face, *bubble);
            }
        }
        jet.plus(-value_inside, whole)
    };
    // Values of the plain quadratic functions in the middles: L (2 L - 1), 4 La Lb.
    let third = 1.0 / 3.0;
    let at_corner = |l: f64| l * (2.0 * l - 1.0);
    let inner = 1.0 / corners as f64;
    let mut jets = Vec::new();
    for corner in 0..corners {
        let plain = l[corner].times(l[corner]).scaled(2.0).plus(-1.0, l[corner]);
        jets.push(share(plain, &[corner], at_corner(third), at_corner(inner)));
    }
    for edge in edges {
        let plain = product(edge).scaled(4.0);
        jets.push(share(plain, edge, 4.0 * third * third, 4.0 * inner * inner));
    }
    jets.extend(on_faces.iter().copied());
    jets.push(whole);
    Shapes {
        values: jets.iter().map(|jet| jet.0).collect(),
        gradients: jets
            .iter()
            .map(|jet| {
                let mut gradient = [0.0; 3];
                for (d, component) in gradient.iter_mut().enumerate().take(dimension) {
                    *component = jet.1[d + 1] - jet.1[0];
                }
                gradient
            })
            .collect(),
    }
}

fn tensor_points(dimension: usize) -> Vec<QuadraturePoint> {
    products(&GAUSS3, dimension)
}

/// Products of a rule on a line.
fn products(line: &[(f64, f64)], dimension: usize) -> Vec<QuadraturePoint> {
    let mut points = vec![QuadraturePoint {
        at: [0.0; 3],
        weight: 1.0,
    }];
    for d in 0..dimension {
        points = points
            .into_iter()
            .flat_map(|point| {
                line.iter().map(move |&(x, weight)| {
                    let mut at = point.at;
                    at[d] = x;
                    QuadraturePoint {
                        at,
                        weight: point.weight * weight,
                    }
                })
            })
            .collect();
    }
    points
}

/// Parts of equal measure of a simplex by its corners and the middles of its edges (numbered
/// behind the corners).
const TRIANGLE_PARTS: [&[usize]; 4] = [&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]];
const TETRAHEDRON_PARTS: [&[usize]; 8] = [
    &[0, 4, 6, 7],
    &[4, 1, 5, 8],
    &[6, 5, 2, 9],
    &[7, 8, 9, 3],
    &[4, 5, 6, 8],
    &[4, 6, 7, 8],
    &[5, 6, 8, 9],
    &[6, 7, 8, 9],
];

/// A rule exact to degree 3 on each part of a simplex that is halved along its edges until there
/// are `halves` parts along each: shares of the corners, the middles of the edges (in the plane)
/// and the middles of the faces.
fn closed_simplex(parts: &[&[usize]], faces: &[[usize; 3]], halves: usize) -> Vec<QuadraturePoint> {
    let corners = parts[0].len();
    let (edges, measure, shares): (&[[usize; 2]], _, _) = if corners == 3 {
        (&TRI_EDGES, 0.5, [3.0, 8.0, 27.0])
    } else {
        (&TET_EDGES, 1.0 / 6.0, [1.0, 0.0, 9.0])
    };
    let middle = |of: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|d| of.iter().map(|x| x[d]).sum::<f64>() / of.len() as f64)
    };
    let corner = |k: usize| std::array::from_fn(|d| f64::from(u8::from(k == d + 1)));
    let mut simplices: Vec<Vec<[f64; 3]>> = vec![(0..corners).map(corner).collect()];
    for _ in 0..halves.ilog2() {
        let halved = simplices.iter().flat_map(|whole| {
            let mut all = whole.clone();
            all.extend(edges.iter().map(|pair| middle(&pair.map(|k| whole[k]))));
            parts
                .iter()
                .map(move |part| part.iter().map(|&k| all[k]).collect())
        });
        simplices = halved.collect();
    }
    let whole = shares[0] * corners as f64
        + shares[1] * edges.len() as f64
        + shares[2] * faces.len() as f64;
    let unit = measure / simplices.len() as f64 / whole;
    let mut points: Vec<QuadraturePoint> = Vec::new();
    for x in &simplices {
        let own = x.iter().map(|&x| (x, shares[0]));
        let own = own.chain(
            edges
                .iter()
                .map(|pair| (middle(&pair.map(|k| x[k])), shares[1])),
        );
        let own = own.chain(
            faces
                .iter()
                .map(|three| (middle(&three.map(|k| x[k])), shares[2])),
        );
        for (at, share) in own.filter(|(_, share)| *share > 0.0) {
            let weight = unit * share;
            // Parts share their corners and edges.
            let same =
                |point: &&mut QuadraturePoint| (0..3).all(|d| (point.at[d] - at[d]).abs() < 1e-12);
            match points.iter_mut().find(same) {
                Some(known) => known.weight += weight,
                None => points.push(QuadraturePoint { at, weight }),
            }
        }
    }
    points
}

/// Twelve points, exact to degree 6 (Dunavant), on the triangle of area 1/2.
fn triangle_points() -> Vec<QuadraturePoint> {
    let mut points = Vec::new();
    let mut push = |l: [f64; 3], weight: f64| {
        points.push(QuadraturePoint {
            at: [l[1], l[2], 0.0],
            weight: weight / 2.0,
        });
    };
    for (a, weight) in [
        (0.249286745170910, 0.116786275726379),
        (0.063089014491502, 0.050844906370207),
    ] {
        let b = 1.0 - 2.0 * a;
        for l in [[b, a, a], [a, b, a], [a, a, b]] {
            push(l, weight);
        }
    }
    let (a, b) = (0.310352451033785, 0.053145049844816);
    let c = 1.0 - a - b;
    for l in [
        [a, b, c],
        [b, c, a],
        [c, a, b],
        [b, a, c],
        [a, c, b],
        [c, b, a],
    ] {
        push(l, 0.082851075618374);
    }
    points
}

/// Twenty-four points, exact to degree 6 (Keast), on the tetrahedron of volume 1/6.
fn tetrahedron_points() -> Vec<QuadraturePoint> {
    let mut points = Vec::new();
    let mut push = |l: [f64; 4], weight: f64| {
        points.push(QuadraturePoint {
            at: [l[1], l[2], l[3]],
            weight,
        });
    };
    for (a, weight) in [
        (0.214602871259152029, 0.00665379170969458),
        (0.0406739585346113531, 0.00167953517588678),
        (0.322337890142275510, 0.00922619692394245),
    ] {
        for corner in 0..4 {
            let mut l = [a; 4];
            l[corner] = 1.0 - 3.0 * a;
            push(l, weight);
        }
    }
    let (a, b) = (0.0636610018750175253, 0.269672331458315808);
    let c = 1.0 - 2.0 * a - b;
    for i in 0..4 {
        for j in (0..4).filter(|&j| j != i) {
            let mut l = [a; 4];
            l[i] = b;
            l[j] = c;
            push(l, 0.00803571428571428);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [CellShape; 4] = [
        CellShape::Quad9,
        CellShape::Tri7,
        CellShape::Hex27,
        CellShape::Tet15,
    ];

    #[test]
    fn shape_functions_are_nodal() {
        for shape in ALL {
            for node in 0..shape.node_count() {
                let values = shape.shapes(shape.node_at(node)).values;
                for (other, value) in values.iter().enumerate() {
                    let expected = f64::from(u8::from(other == node));
                    assert!((value - expected).abs() < 1e-14, "{shape:?} {node} {other}");
                }
            }
        }
    }

    #[test]
    fn closed_rules_have_the_corners_and_integrate_as_far_as_they_should() {
        for shape in ALL {
            let simplex = matches!(shape, CellShape::Tri7 | CellShape::Tet15);
            // Of degree 3 on parts of simplices; 7 and 15 along the edges of the others.
            let powers: &[i32] = if simplex {
                &[0, 1, 2, 3]
            } else {
                &[0, 2, 4, 6, 7]
            };
            for finer in [false, true] {
                let points = shape.closed_quadrature(finer);
                for &n in powers {
                    let sum: f64 = points.iter().map(|p| p.weight * p.at[1].powi(n)).sum();
                    let exact = match shape {
                        CellShape::Tri7 => 1.0 / f64::from((n + 1) * (n + 2)),
                        CellShape::Tet15 => 1.0 / f64::from((n + 1) * (n + 2) * (n + 3)),
                        _ if n % 2 == 1 => 0.0,
                        CellShape::Quad9 => 4.0 / f64::from(n + 1),
                        CellShape::Hex27 => 8.0 / f64::from(n + 1),
                    };
                    // Sums of up to 729 rounded weights.
                    assert!((sum - exact).abs() < 1e-13, "{shape:?} {n}: {sum} {exact}");
                }
                for corner in 0..shape.corner_count() {
                    let at = shape.node_at(corner);
                    assert!(points.iter().any(|p| p.at == at && p.weight > 0.0));
                }
            }
        }
    }

    #[test]
    fn gradients_are_those_of_the_values() {
        for shape in ALL {
            let at = [0.21, 0.17, 0.33];
            let shapes = shape.shapes(at);
            for d in 0..shape.dimension() {
                let step = |sign: f64| {
                    let mut moved = at;
                    moved[d] += sign * 1e-6;
                    shape.shapes(moved).values
                };
                let (up, down) = (step(1.0), step(-1.0));
                for node in 0..shape.node_count() {
                    let slope = (up[node] - down[node]) / 2e-6;
                    assert!((slope - shapes.gradients[node][d]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn sides_lie_on_the_boundary_and_turn_outward() {
        for shape in ALL {
            let middle = shape.node_at(shape.node_count() - 1);
            for side in shape.sides() {
                let at: Vec<[f64; 3]> = side
                    .iter()
                    .map(|&n| shape.node_at(usize::from(n)))
                    .collect();
                let facet = shape.facet_shape();
                let point = facet.quadrature()[1].at;
                let shapes = facet.shapes(point);
                let mut place = [0.0; 3];
                let mut tangents = [[0.0; 3]; 2];
                for (n, x) in at.iter().enumerate() {
                    for k in 0..3 {
                        place[k] += shapes.values[n] * x[k];
                        for (d, tangent) in tangents.iter_mut().enumerate() {
                            tangent[k] += shapes.gradients[n][d] * x[k];
                        }
                    }
                }
                let normal = if shape.dimension() == 2 {
                    [tangents[0][1], -tangents[0][0], 0.0]
                } else {
                    let [s, t] = tangents;
                    [
                        s[1] * t[2] - s[2] * t[1],
                        s[2] * t[0] - s[0] * t[2],
                        s[0] * t[1] - s[1] * t[0],
                    ]
                };
                let outward: f64 = (0..3).map(|k| normal[k] * (place[k] - middle[k])).sum();
                assert!(outward > 1e-3, "{shape:?} {side:?}");
            }
        }
    }

    #[test]
    fn quadrature_is_exact_to_its_degree() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (shape, degree) in [(CellShape::Tri7, 6), (CellShape::Tet15, 6)] {
            for i in 0..=degree {
                for j in 0..=degree - i {
                    let last = if shape == CellShape::Tri7 {
                        0
                    } else {
                        degree - i - j
                    };
                    for k in 0..=last {
                        let found: f64 = shape
                            .quadrature()
                            .iter()
                            .map(|p| p.weight * p.at[0].powi(i) * p.at[1].powi(j) * p.at[2].powi(k))
                            .sum();
                        let dimension = shape.dimension() as i32;
                        let exact = factorial(i) * factorial(j) * factorial(k)
                            / factorial(i + j + k + dimension);
                        assert!((found / exact - 1.0).abs() < 1e-11, "{shape:?} {i} {j} {k}");
                    }
                }
            }
        }
    }
}
