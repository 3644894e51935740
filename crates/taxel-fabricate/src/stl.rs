//! Binary STL in mm.

use crate::relief::Mesh;
use crate::text::ascii;

/// The file; `head` says what wrote it.
pub(crate) fn stl(mesh: &Mesh, head: &str) -> Vec<u8> {
    // A head that begins with "solid" would be taken for a file of text.
    let mut bytes = format!("{:80.80}", format!("taxel: {}", ascii(head))).into_bytes();
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.points[corner]);
        let [u, v] =
            [b, c].map(|end| -> [f64; 3] { std::array::from_fn(|axis| end[axis] - a[axis]) });
        let normal = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
        let normal = normal.map(|part| part / length);
        let corners = [a, b, c].map(|corner| corner.map(|coordinate| coordinate * 1e3));
        for number in normal.into_iter().chain(corners.into_iter().flatten()) {
            bytes.extend((number as f32).to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    bytes
}
