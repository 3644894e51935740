//! Axes of a mesh file, along and about which the components of a body are.

use taxel_fem::problem::Kinematics;

/// Component of a mesh along an axis of its file.
pub(super) fn component(axes: &[usize], axis: usize) -> Option<usize> {
    axes.iter().position(|&known| known == axis)
}

/// Axes of the file about which a body turns, each with its component of the rotation vector and
/// its sign: a turn from the first axis of a plane mesh to the second is one about the third axis
/// of the file, or against it.
pub(super) fn turns(kinematics: Kinematics, axes: &[usize]) -> Vec<(usize, usize, f64)> {
    match (kinematics, axes) {
        (Kinematics::PlaneStrain, &[first, second]) => {
            let across = 3 - first - second;
            let sign = if (first + 1) % 3 == second { 1.0 } else { -1.0 };
            vec![(across, 2, sign)]
        }
        (Kinematics::Solid, axes) => axes.iter().enumerate().map(|(i, &a)| (a, i, 1.0)).collect(),
        _ => Vec::new(),
    }
}

/// Letter of an axis.
pub(super) fn letter(axis: usize) -> &'static str {
    ["x", "y", "z"][axis]
}
