//! A rectangular void made elliptic: its wall moves onto the ellipse, and what lies beside it less
//! and less with it.

use std::f64::consts::FRAC_PI_2;

/// Cross-section of a void.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VoidShape {
    /// A rectangle.
    #[default]
    Rectangle,
    /// The ellipse as wide and as high.
    Ellipse,
}

/// The ellipse in the place of a rectangle, and how far the solid round it reaches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipse {
    /// Half the width and half the height.
    pub(super) half: [f64; 2],
    /// Solid beside the void.
    pub(super) beside: f64,
    /// Solid above and below the void.
    pub(super) room: [f64; 2],
}

impl Ellipse {
    /// Where a point goes, from the middle of the void.
    ///
    /// It moves with the nearest point of the rectangle's wall, the less the nearer to the outer
    /// side: cells stay whole, and where three of them meet at a corner they share a half turn. The
    /// corner lies on the ellipse at the angle, as its parameter, at which its quarter is shared
    /// like the half width and the half height.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self { half, beside, .. } = *self;
        let room = self.room[usize::from(y < 0.0)];
        // Of the parameter from the top of the ellipse to its side.
        let corner = FRAC_PI_2 * half[0] / (half[0] + half[1]);
        let (right, up) = (x.abs(), y.abs());
        // Of the rectangle the nearest point, as shares of its half sides.
        let along = (right / half[0]).min(1.0);
        let share = (up / half[1]).min(1.0);
        // On the wall one of both is 1 but for rounding.
        let angle = if share >= along {
            corner * along
        } else {
            FRAC_PI_2 - (FRAC_PI_2 - corner) * share
        };
        let stays = (1.0 - (right - half[0]).max(0.0) / beside).max(0.0)
            * (1.0 - (up - half[1]).max(0.0) / room).max(0.0);
        let [sine, cosine] = [angle.sin(), angle.cos()];
        [
            x + sign(x) * stays * half[0] * (sine - along),
            y + sign(y) * stays * half[1] * (cosine - share),
        ]
    }
}

/// Zero stays where it is.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_the_wall_go_onto_the_ellipse_whatever_their_rounding() {
        let ellipse = Ellipse {
            half: [1.3, 0.5],
            beside: 2.0,
            room: [0.4, 1.7],
        };
        for across in [0.0, 0.1, 0.7, 1.2] {
            let [x, y] = ellipse.place([across, -0.5]);
            let off = (x / 1.3).powi(2) + (y / 0.5).powi(2) - 1.0;
            assert!(off.abs() < 1e-12, "{off}");
            // A place is a sum of lengths.
            for rounding in [-1e-16, 1e-16] {
                let near = ellipse.place([across, -0.5 + rounding]);
                assert!((near[0] - x).abs() < 1e-12, "{near:?} {x}");
                assert!((near[1] - y).abs() < 1e-12, "{near:?} {y}");
            }
        }
    }
}
