//! Use of the three directions by a field, and the factors that its parts share.

use super::FieldError;
use crate::mesh::Mesh;
use crate::scalar::Tensor;

/// Body that a mesh stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// A plane section; results are per unit depth.
    Plane,
    /// A half section with the radius first and the axis second; results are for the
    /// full turn.
    Axisymmetric,
    /// Three dimensions.
    Solid,
}

/// a b.
pub(super) fn times(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum::<f64>()))
}

/// Nodes of a surface or node set that must exist.
pub(super) fn named_nodes(mesh: &Mesh, name: &str) -> Result<Vec<u32>, FieldError> {
    mesh.nodes_of(name).ok_or_else(|| {
        let names = mesh.surfaces.keys().chain(mesh.node_sets.keys());
        FieldError::UnknownName {
            kind: "region, surface or node set",
            name: name.to_owned(),
            known: names.cloned().collect::<Vec<_>>().join(", "),
        }
    })
}

/// Length of a vector.
pub(super) fn length(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}
