//! Where a contact is and how it moves: a Kalman filter of constant velocity.

/// A matrix of two by two.
pub(super) type Matrix = [[f64; 2]; 2];

/// Position and velocity of a contact with their covariance.
///
/// The velocity wanders by a white acceleration of density q, m²/s³: after a
/// time t the position is uncertain by q t³/3, the velocity by q t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    pub(super) position: [f64; 2],
    pub(super) velocity: [f64; 2],
    pub(super) place_covariance: Matrix,
    /// Covariance of position (rows) and velocity (columns).
    cross: Matrix,
    pub(super) velocity_covariance: Matrix,
}

impl Motion {
    /// At rest at `position`, with a speed of the standard deviation `speed`.
    pub(super) fn begin(position: [f64; 2], covariance: Matrix, speed: f64) -> Self {
        Self {
            position,
            velocity: [0.0; 2],
            place_covariance: covariance,
            cross: [[0.0; 2]; 2],
            velocity_covariance: [[speed * speed, 0.0], [0.0, speed * speed]],
        }
    }

    /// Goes on by `dt`, s.
    pub(super) fn predict(&mut self, dt: f64, density: f64) {
        for i in 0..2 {
            self.position[i] += self.velocity[i] * dt;
        }
        let (cross, velocity) = (self.cross, self.velocity_covariance);
        for i in 0..2 {
            for j in 0..2 {
                self.place_covariance[i][j] +=
                    dt * (cross[i][j] + cross[j][i]) + dt * dt * velocity[i][j];
                self.cross[i][j] += dt * velocity[i][j];
            }
            self.place_covariance[i][i] += density * dt.powi(3) / 3.0;
            self.cross[i][i] += density * dt * dt / 2.0;
            self.velocity_covariance[i][i] += density * dt;
        }
    }

    /// Square of the Mahalanobis distance of a position measured with `noise`.
    pub(super) fn distance(&self, position: [f64; 2], noise: Matrix) -> f64 {
        let off = [
            position[0] - self.position[0],
            position[1] - self.position[1],
        ];
        let inverse = inverse(add(self.place_covariance, noise));
        (0..2)
            .map(|i| off[i] * (inverse[i][0] * off[0] + inverse[i][1] * off[1]))
            .sum()
    }

    /// Takes a position measured with `noise`.
    pub(super) fn update(&mut self, position: [f64; 2], noise: Matrix) {
        let off = [
            position[0] - self.position[0],
            position[1] - self.position[1],
        ];
        let inverse = inverse(add(self.place_covariance, noise));
        let gain = multiply(self.place_covariance, inverse);
        let velocity_gain = multiply(transpose(self.cross), inverse);
        for i in 0..2 {
            self.position[i] += gain[i][0] * off[0] + gain[i][1] * off[1];
            self.velocity[i] += velocity_gain[i][0] * off[0] + velocity_gain[i][1] * off[1];
        }
        let cross = self.cross;
        // Its unsymmetric part would grow with each position that is known well.
        self.velocity_covariance = symmetric(subtract(
            self.velocity_covariance,
            multiply(velocity_gain, cross),
        ));
        self.cross = subtract(cross, multiply(gain, cross));
        self.place_covariance = symmetric(multiply(gain, noise));
    }
}

fn add(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

fn subtract(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i][j]))
}

fn multiply(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

fn transpose(a: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Rounding makes a product of symmetric matrices a little unsymmetric.
fn symmetric(a: Matrix) -> Matrix {
    let mean = 0.5 * (a[0][1] + a[1][0]);
    [[a[0][0], mean], [mean, a[1][1]]]
}

/// Inverse of a positive definite matrix.
fn inverse(a: Matrix) -> Matrix {
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [
        [a[1][1] / determinant, -a[0][1] / determinant],
        [-a[1][0] / determinant, a[0][0] / determinant],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With no acceleration the filter is the straight line of least squares;
    /// of n + 1 positions at 0 … n its slope has the variance 12σ²/(n(n+1)(n+2)).
    #[test]
    fn without_acceleration_it_is_the_line_of_least_squares() {
        let noise = [[1e-6, 0.0], [0.0, 4e-6]];
        let mut motion = Motion::begin([0.0; 2], noise, 1.0);
        for i in 1..=20 {
            motion.predict(1.0, 0.0);
            motion.update([f64::from(i) * 0.5, 0.0], noise);
        }
        let expected = 12.0 * 1e-6 / (20.0 * 21.0 * 22.0);
        // A first speed of 1 m/s weighs 1e-9; cancellation of 1 against 1e-9 leaves 1e-7.
        assert!((motion.velocity_covariance[0][0] / expected - 1.0).abs() < 1e-6);
        assert!((motion.velocity_covariance[1][1] / expected / 4.0 - 1.0).abs() < 1e-6);
        assert!((motion.velocity[0] - 0.5).abs() < 1e-8);
    }

    /// Rounding must not grow, however long a contact rests.
    #[test]
    fn a_place_known_well_stays_where_it_is() {
        let noise = [[1e-10, 3e-11], [3e-11, 2e-10]];
        let mut motion = Motion::begin([1e-3, 2e-3], noise, 0.1);
        for _ in 0..10_000 {
            motion.predict(1.0 / 60.0, 1e-3);
            motion.update([1e-3, 2e-3], noise);
        }
        let [[xx, xy], [yx, yy]] = motion.velocity_covariance;
        assert!(xx > 0.0 && yy > 0.0 && xx * yy > xy * yx, "{motion:?}");
        // Rounding of positions of a millimetre over steps of 17 ms.
        assert!(motion.velocity[0].hypot(motion.velocity[1]) < 1e-13);
    }

    #[test]
    fn one_long_step_is_two_short_ones() {
        let noise = [[2.0, 0.5], [0.5, 1.0]];
        let mut once = Motion::begin([1.0, 2.0], noise, 3.0);
        let mut twice = once;
        once.predict(0.8, 0.3);
        twice.predict(0.5, 0.3);
        twice.predict(0.3, 0.3);
        for i in 0..2 {
            for j in 0..2 {
                let pairs = [
                    (once.place_covariance, twice.place_covariance),
                    (once.cross, twice.cross),
                    (once.velocity_covariance, twice.velocity_covariance),
                ];
                // Rounding of numbers of order ten.
                assert!(pairs.iter().all(|(a, b)| (a[i][j] - b[i][j]).abs() < 1e-14));
            }
        }
    }
}
