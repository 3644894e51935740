//! Principal values and directions of symmetric tensors.

use crate::scalar::{PLACE, Symmetric, Tensor};

/// Principal values, not ordered, and the directions as rows of a rotation.
///
/// Jacobi's rotations: the directions stay orthonormal to rounding however close
/// the values are, and `sum of value n x n` gives the tensor back to rounding. That
/// is all that functions of the tensor need where values are equal.
pub(super) fn principal(a: &Symmetric<f64>) -> ([f64; 3], Tensor<f64>) {
    let mut values: Tensor<f64> = std::array::from_fn(|i| std::array::from_fn(|j| a[PLACE[i][j]]));
    let mut directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Convergence is quadratic: five sweeps do in practice.
    for _ in 0..12 {
        if values[0][1] == 0.0 && values[1][2] == 0.0 && values[0][2] == 0.0 {
            break;
        }
        for (p, q) in [(0, 1), (1, 2), (0, 2)] {
            rotate(&mut values, &mut directions, p, q);
        }
    }
    ([values[0][0], values[1][1], values[2][2]], directions)
}

/// Turns axes `p` and `q` so that their off-diagonal entry vanishes.
fn rotate(values: &mut Tensor<f64>, directions: &mut Tensor<f64>, p: usize, q: usize) {
    let off = values[p][q];
    // Far below the rounding of both values, so that it is noise.
    if off.abs() <= 1e-18 * (values[p][p].abs().min(values[q][q].abs())) {
        values[p][q] = 0.0;
        values[q][p] = 0.0;
        return;
    }
    let theta = (values[q][q] - values[p][p]) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    values[p][p] -= t * off;
    values[q][q] += t * off;
    values[p][q] = 0.0;
    values[q][p] = 0.0;
    let r = 3 - p - q;
    let (rp, rq) = (values[r][p], values[r][q]);
    values[r][p] = c * rp - s * rq;
    values[r][q] = s * rp + c * rq;
    values[p][r] = values[r][p];
    values[q][r] = values[r][q];
    for k in 0..3 {
        let (x, y) = (directions[p][k], directions[q][k]);
        directions[p][k] = c * x - s * y;
        directions[q][k] = s * x + c * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tensor_comes_back_from_its_principal_values() {
        for a in [
            [2.0, 3.0, 5.0, 0.7, -0.4, 0.9],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1e-9, -1e-9, 2e-9],
            [1.0, 1.0 + 1e-12, 40.0, 1e-10, 6.0, 1e-3],
            [0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
            [0.0; 6],
        ] {
            let (values, n) = principal(&a);
            let size = a.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    let back: f64 = (0..3).map(|k| values[k] * n[k][i] * n[k][j]).sum();
                    let unit: f64 = (0..3).map(|k| n[i][k] * n[j][k]).sum();
                    // A few tens of roundings.
                    assert!((back - a[PLACE[i][j]]).abs() <= 4e-15 * size, "{a:?}");
                    assert!((unit - f64::from(u8::from(i == j))).abs() < 4e-15, "{a:?}");
                }
            }
        }
    }
}
