//! Whether a mesh is fit for a solution.

use super::Mesh;

/// Measure of a cell: its area or volume, negative when inverted.
pub(crate) fn measure(mesh: &Mesh, cell: usize) -> f64 {
    let shape = mesh.shape(cell);
    shape
        .quadrature()
        .iter()
        .map(|point| point.weight * determinant_at(mesh, cell, point.at))
        .sum()
}

/// Determinant of the map from the reference cell at a point of it.
pub(crate) fn determinant_at(mesh: &Mesh, cell: usize, at: [f64; 3]) -> f64 {
    let shape = mesh.shape(cell);
    let shapes = shape.shapes(at);
    let mut map = [[0.0; 3]; 3];
    for (gradient, &node) in shapes.gradients.iter().zip(mesh.cell(cell)) {
        let point = mesh.points[node as usize];
        for i in 0..3 {
            for j in 0..3 {
                map[i][j] += point[i] * gradient[j];
            }
        }
    }
    if shape.dimension() == 2 {
        map[2][2] = 1.0;
    }
    crate::scalar::determinant(&map)
}
