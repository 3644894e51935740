//! `div(k grad phi) = 0` on a mesh as it is, moved, or pulled back.
//!
//! The matrix of a cell is `K_ab = int k grad N_a . grad N_b dv`. On the reference
//! mesh the same number is `int (J F^-1 k F^-T) Grad N_a . Grad N_b dV`, with the
//! deformation gradient `F = 1 + Grad u`: fields on a deformed shape need no second
//! mesh. For these cells both are equal to rounding.

use super::FieldError;
use super::exterior::Exterior;
use super::geometry::{Geometry, length, times};
use crate::mesh::{CellShape, Mesh, Shapes};
use crate::scalar::{PAIRS, Symmetric, Tensor, determinant, inverse};

/// Displacement of each node, in the units of the mesh.
#[derive(Clone, Copy, Debug, Default)]
pub enum MeshMotion<'a> {
    /// The mesh as it is.
    #[default]
    None,
    /// The reference mesh with the coefficient pulled back.
    PulledBack(&'a [[f64; 3]]),
    /// The nodes moved by the displacement.
    Moved(&'a [[f64; 3]]),
}

/// Coefficient `k` of a region: permittivity or conductivity, in space (it does not
/// turn with the solid).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coefficient {
    /// The same in all directions.
    Scalar(f64),
    /// Symmetric tensor, 11, 22, 33, 12, 23, 13.
    Tensor(Symmetric<f64>),
}

/// Where a field is solved.
#[derive(Clone, Copy, Debug)]
pub struct Domain<'a> {
    /// The mesh; coordinates in m.
    pub mesh: &'a Mesh,
    /// Body that the mesh stands for.
    pub geometry: Geometry,
    /// Motion of the mesh.
    pub motion: MeshMotion<'a>,
    /// The unbounded rest of space, when the mesh carries its image.
    pub exterior: Option<&'a Exterior>,
}

impl Coefficient {
    /// As a full tensor.
    fn tensor(&self) -> Tensor<f64> {
        let mut k = [[0.0; 3]; 3];
        match self {
            Self::Scalar(value) => (0..3).for_each(|i| k[i][i] = *value),
            Self::Tensor(entries) => {
                for (entry, (i, j)) in entries.iter().zip(PAIRS) {
                    k[i][j] = *entry;
                    k[j][i] = *entry;
                }
            }
        }
        k
    }

    /// The coefficient times a number.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Scalar(value) => Self::Scalar(factor * value),
            Self::Tensor(entries) => Self::Tensor(entries.map(|entry| factor * entry)),
        }
    }

    /// Smallest leading minor: positive if and only if the tensor is positive definite.
    fn smallest_minor(&self) -> f64 {
        let k = self.tensor();
        let second = k[0][0] * k[1][1] - k[0][1] * k[1][0];
        let minors = [k[0][0], second, determinant(&k)];
        if minors.iter().all(|minor| minor.is_finite()) {
            minors.into_iter().fold(f64::INFINITY, f64::min)
        } else {
            f64::NAN
        }
    }
}

impl Geometry {
    fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Axisymmetric => "axisymmetric",
            Self::Solid => "solid",
        }
    }
}

/// Shape functions of one cell shape at its quadrature points.
struct Table {
    shape: CellShape,
    points: Vec<(f64, Shapes)>,
}

impl Table {
    fn new(shape: CellShape) -> Self {
        let points = shape
            .quadrature()
            .into_iter()
            .map(|point| (point.weight, shape.shapes(point.at)))
            .collect();
        Self { shape, points }
    }
}

/// Value and reference gradients of a nodal vector field at a quadrature point.
fn interpolate(
    field: &[[f64; 3]],
    nodes: &[u32],
    shapes: &Shapes,
    dimension: usize,
) -> ([f64; 3], Tensor<f64>) {
    let mut value = [0.0; 3];
    let mut gradient = [[0.0; 3]; 3];
    for (local, &node) in nodes.iter().enumerate() {
        let at_node = field[node as usize];
        for i in 0..dimension {
            value[i] += at_node[i] * shapes.values[local];
            for j in 0..dimension {
                gradient[i][j] += at_node[i] * shapes.gradients[local][j];
            }
        }
    }
    (value, gradient)
}

fn transposed(a: &Tensor<f64>) -> Tensor<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// One quadrature point of a cell: what multiplies the reference gradients there.
struct Place {
    /// `g k g^T` times the weight and measure, where `g` takes gradients to space.
    weighted: Tensor<f64>,
}

impl Domain<'_> {
    /// Checks the parts against each other.
    pub(super) fn check(&self) -> Result<(), FieldError> {
        let expected = if self.geometry == Geometry::Solid {
            3
        } else {
            2
        };
        let given = self.mesh.dimension();
        if given != expected {
            return Err(FieldError::WrongDimension {
                geometry: self.geometry.name(),
                given,
                expected,
            });
        }
        if let MeshMotion::PulledBack(u) | MeshMotion::Moved(u) = self.motion {
            let expected = self.mesh.points.len();
            if u.len() != expected {
                return Err(FieldError::WrongLength {
                    given: u.len(),
                    expected,
                });
            }
            self.check_outside_at_rest(u)?;
        }
        Ok(())
    }

    fn check_outside_at_rest(&self, u: &[[f64; 3]]) -> Result<(), FieldError> {
        let Some(exterior) = self.exterior else {
            return Ok(());
        };
        for cell in 0..self.mesh.cell_count() {
            if exterior.inside_of(self.mesh.region_of(cell)).is_none() {
                continue;
            }
            for &node in self.mesh.cell(cell) {
                let distance = length(u[node as usize]);
                if distance.is_nan() || distance > 0.0 {
                    return Err(FieldError::OutsideMoves { node, distance });
                }
            }
        }
        Ok(())
    }

    /// Calls `add` with the nodes and the matrix (row first) of each cell that has a
    /// coefficient; `coefficients` holds one for each region, none to leave it out.
    pub(super) fn for_each_cell(
        &self,
        coefficients: &[Option<Coefficient>],
        add: &mut dyn FnMut(&[u32], &[f64]),
    ) -> Result<(), FieldError> {
        self.check_coefficients(coefficients)?;
        let tables = [
            CellShape::Quad9,
            CellShape::Tri7,
            CellShape::Hex27,
            CellShape::Tet15,
        ]
        .map(Table::new);
        let mut matrix = Vec::new();
        for cell in 0..self.mesh.cell_count() {
            let Some(k) = coefficients[self.mesh.region_of(cell)] else {
                continue;
            };
            let shape = self.mesh.shape(cell);
            if let Some(table) = tables.iter().find(|table| table.shape == shape) {
                self.cell_matrix(cell, &k.tensor(), table, &mut matrix)?;
                add(self.mesh.cell(cell), &matrix);
            }
        }
        Ok(())
    }

    fn check_coefficients(&self, coefficients: &[Option<Coefficient>]) -> Result<(), FieldError> {
        for (k, region) in coefficients.iter().zip(&self.mesh.regions) {
            let value = k.map_or(1.0, |k| k.smallest_minor());
            if value.is_nan() || value <= 0.0 {
                return Err(FieldError::NotPositive {
                    region: region.clone(),
                    value,
                });
            }
        }
        Ok(())
    }

    fn cell_matrix(
        &self,
        cell: usize,
        k: &Tensor<f64>,
        table: &Table,
        matrix: &mut Vec<f64>,
    ) -> Result<(), FieldError> {
        let nodes = self.mesh.cell(cell);
        let count = nodes.len();
        let dimension = table.shape.dimension();
        matrix.clear();
        matrix.resize(count * count, 0.0);
        for (weight, shapes) in &table.points {
            let place = self.place(cell, k, *weight, shapes)?;
            for a in 0..count {
                let ga = shapes.gradients[a];
                let row: [f64; 3] = std::array::from_fn(|j| {
                    (0..dimension).map(|i| ga[i] * place.weighted[i][j]).sum()
                });
                for b in 0..=a {
                    let gb = shapes.gradients[b];
                    let entry: f64 = (0..dimension).map(|j| row[j] * gb[j]).sum();
                    matrix[a * count + b] += entry;
                }
            }
        }
        for a in 0..count {
            for b in 0..a {
                matrix[b * count + a] = matrix[a * count + b];
            }
        }
        Ok(())
    }

    fn place(
        &self,
        cell: usize,
        k: &Tensor<f64>,
        weight: f64,
        shapes: &Shapes,
    ) -> Result<Place, FieldError> {
        let nodes = self.mesh.cell(cell);
        let dimension = self.mesh.dimension();
        let (mut at, mut jacobian) = interpolate(&self.mesh.points, nodes, shapes, dimension);
        if let MeshMotion::Moved(u) = self.motion {
            let (moved, gradient) = interpolate(u, nodes, shapes, dimension);
            for i in 0..dimension {
                at[i] += moved[i];
                for j in 0..dimension {
                    jacobian[i][j] += gradient[i][j];
                }
            }
        }
        if dimension == 2 {
            jacobian[2][2] = 1.0;
        }
        let ratio = determinant(&jacobian);
        self.upright(cell, at, ratio)?;
        let to_reference = inverse(&jacobian, ratio);
        let mut k = self.seen_outside(cell, k, at);
        if let MeshMotion::PulledBack(u) = self.motion {
            let (moved, gradient) = interpolate(u, nodes, shapes, dimension);
            let f = self.deformation_gradient(at, moved, &times(&gradient, &to_reference));
            let volume = determinant(&f);
            self.upright(cell, at, volume)?;
            let g = inverse(&f, volume);
            k = times(&times(&g, &k), &transposed(&g)).map(|row| row.map(|entry| volume * entry));
        }
        let measure = weight * ratio * self.measure(cell, at)?;
        let weighted = times(&times(&to_reference, &k), &transposed(&to_reference))
            .map(|row| row.map(|entry| measure * entry));
        Ok(Place { weighted })
    }

    fn deformation_gradient(
        &self,
        at: [f64; 3],
        moved: [f64; 3],
        gradient: &Tensor<f64>,
    ) -> Tensor<f64> {
        let mut f = *gradient;
        (0..3).for_each(|i| f[i][i] += 1.0);
        if self.geometry == Geometry::Axisymmetric {
            // Circles about the axis grow with their radius.
            f[2][2] = 1.0 + moved[0] / at[0];
        }
        f
    }

    fn upright(&self, cell: usize, at: [f64; 3], ratio: f64) -> Result<(), FieldError> {
        if ratio > 0.0 && ratio.is_finite() {
            return Ok(());
        }
        Err(FieldError::Inverted {
            cell,
            region: self.mesh.regions[self.mesh.region_of(cell)].clone(),
            at,
            ratio,
        })
    }

    /// Factor on the plane or solid measure at a position.
    fn measure(&self, cell: usize, at: [f64; 3]) -> Result<f64, FieldError> {
        let turn = match self.geometry {
            Geometry::Axisymmetric if at[0].is_nan() || at[0] <= 0.0 => {
                return Err(FieldError::BehindAxis {
                    cell,
                    radius: at[0],
                });
            }
            Geometry::Axisymmetric => std::f64::consts::TAU * at[0],
            Geometry::Plane | Geometry::Solid => 1.0,
        };
        let outside = self.outside(cell);
        Ok(turn * outside.map_or(1.0, |exterior| exterior.weight(self.geometry, at)))
    }

    /// The exterior that a cell belongs to.
    fn outside(&self, cell: usize) -> Option<&Exterior> {
        let region = self.mesh.region_of(cell);
        self.exterior
            .filter(|exterior| exterior.inside_of(region).is_some())
    }

    /// The coefficient at a place, as the image of the unbounded space shows it.
    fn seen_outside(&self, cell: usize, k: &Tensor<f64>, at: [f64; 3]) -> Tensor<f64> {
        self.outside(cell)
            .map_or(*k, |exterior| exterior.mirrored(k, at))
    }

    /// One coefficient for each region, from names; regions of the image of the
    /// unbounded space take that of the medium they continue. `left_out` names the
    /// regions without a field.
    pub(super) fn coefficients(
        &self,
        given: &[(&str, Coefficient)],
        left_out: &[usize],
    ) -> Result<Vec<Option<Coefficient>>, FieldError> {
        for (name, _) in given {
            region_number(self.mesh, name)?;
        }
        let regions = &self.mesh.regions;
        (0..regions.len())
            .map(|region| {
                if left_out.contains(&region) {
                    return Ok(None);
                }
                let medium = self
                    .exterior
                    .and_then(|exterior| exterior.inside_of(region))
                    .unwrap_or(region);
                let found = given.iter().find(|(name, _)| *name == regions[medium]);
                let missing = || FieldError::NoCoefficient {
                    region: regions[medium].clone(),
                };
                found.map(|(_, k)| Some(*k)).ok_or_else(missing)
            })
            .collect()
    }
}

/// Number of a region that must exist.
pub(super) fn region_number(mesh: &Mesh, name: &str) -> Result<usize, FieldError> {
    mesh.regions
        .iter()
        .position(|known| known == name)
        .ok_or_else(|| FieldError::UnknownName {
            kind: "region",
            name: name.to_owned(),
            known: mesh.regions.join(", "),
        })
}
