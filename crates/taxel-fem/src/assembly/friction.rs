//! Coulomb friction at a contact point.

use taxel_numerics::dense::dot3;

use crate::problem::contact::{ContactState, Gap};

/// Traction that resists sliding, with its derivative by the place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Friction {
    /// Traction against the sliding, on the side of the internal forces, Pa.
    pub traction: [f64; 3],
    /// Its derivative along the surface at a fixed bound, Pa/m: symmetric. Where the surface is
    /// curved, the traction turns with it, too.
    pub tangent: [[f64; 3]; 3],
    /// Its derivative by the bound: the direction in which the point slides; zero while it
    /// sticks.
    pub sliding: [f64; 3],
    /// Where the point would rest without traction.
    pub anchor: [f64; 3],
}

/// Friction of a point at `place` (in the frame of what it touches): a stiff spring from its
/// anchor along the surface up to the bound (Pa), then constant.
pub(crate) fn friction(
    gap: &Gap,
    place: [f64; 3],
    anchor: [f64; 3],
    stiffness: f64,
    bound: f64,
) -> Friction {
    let n = gap.normal;
    let from: [f64; 3] = std::array::from_fn(|d| place[d] - anchor[d]);
    let along = dot3(from, n);
    let slide: [f64; 3] = std::array::from_fn(|d| from[d] - along * n[d]);
    let size = slide.iter().map(|s| s * s).sum::<f64>().sqrt();
    let flat = |i: usize, j: usize| f64::from(u8::from(i == j)) - n[i] * n[j];
    let curvature = gap.curvature;
    if stiffness * size <= bound {
        return Friction {
            traction: slide.map(|s| stiffness * s),
            tangent: std::array::from_fn(|i| {
                std::array::from_fn(|j| stiffness * (flat(i, j) - along * curvature[i][j]))
            }),
            sliding: [0.0; 3],
            anchor,
        };
    }
    let direction = slide.map(|s| s / size);
    let bent = curvature.map(|row| dot3(row, direction));
    let rest = bound / stiffness;
    Friction {
        traction: direction.map(|d| bound * d),
        tangent: std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let turned = 0.5 * (direction[i] * bent[j] + bent[i] * direction[j]);
                let curved = along * (curvature[i][j] - turned);
                bound / size * (flat(i, j) - direction[i] * direction[j] - curved)
            })
        }),
        sliding: direction,
        anchor: std::array::from_fn(|d| place[d] - rest * direction[d]),
    }
}

/// A contact point that slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slide {
    /// Number of the contact.
    pub contact: usize,
    /// Number of the point in it.
    pub point: usize,
    /// Direction in which it slides.
    pub direction: [f64; 3],
}

/// Lets points stick that slide now against the direction in which they slid in the last
/// iteration; false if there are none. A point at rest lies between the two, in a range as narrow
/// as the contact is stiff, and the tangent of a point that slides knows nothing of it: its friction
/// does not change. Without this the point goes to and fro without end.
pub(crate) fn stick_where_turned(
    before: &[Slide],
    now: &[Slide],
    contacts: &mut [ContactState],
) -> bool {
    let mut before = before.iter().peekable();
    let mut any = false;
    for slide in now {
        let number = (slide.contact, slide.point);
        let earlier = |known: &&Slide| (known.contact, known.point) < number;
        while before.next_if(earlier).is_some() {}
        let same = before.next_if(|known| (known.contact, known.point) == number);
        let along = |known: &Slide| -> f64 {
            let parts = known.direction.iter().zip(slide.direction);
            parts.map(|(a, b)| a * b).sum()
        };
        if same.is_some_and(|known| along(known) < 0.0) {
            contacts[slide.contact].stuck.push(slide.point);
            any = true;
        }
    }
    any
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_that_slide_back_are_stuck() {
        let slide = |contact, point, x: f64| Slide {
            contact,
            point,
            direction: [x, 0.0, 0.0],
        };
        let before = [slide(0, 1, 1.0), slide(0, 4, 1.0), slide(1, 0, -1.0)];
        let now = [
            slide(0, 0, -1.0),
            slide(0, 1, 1.0),
            slide(0, 4, -1.0),
            slide(1, 0, 1.0),
        ];
        let mut contacts = vec![ContactState::default(); 2];
        assert!(stick_where_turned(&before, &now, &mut contacts));
        assert_eq!(
            (&contacts[0].stuck, &contacts[1].stuck),
            (&vec![4], &vec![0])
        );
        assert!(contacts[0].bound(4, 0.5, 2.0).is_infinite());
        assert_eq!(contacts[0].bound(1, 0.5, 2.0), 1.0);
        let mut contacts = vec![ContactState::default(); 2];
        assert!(!stick_where_turned(&before, &before, &mut contacts));
    }

    #[test]
    fn the_traction_sticks_then_slides_and_its_anchor_follows() {
        let gap = Gap {
            distance: -0.1,
            normal: [0.0, 1.0, 0.0],
            curvature: [[0.0; 3]; 3],
        };
        let bound = 2.0;
        let at = |x: f64| friction(&gap, [x, -0.1, 0.0], [0.0; 3], 10.0, bound);
        assert_eq!(at(0.1).traction, [1.0, 0.0, 0.0]);
        assert_eq!(at(0.1).anchor, [0.0; 3]);
        assert_eq!(at(0.5).traction, [2.0, 0.0, 0.0]);
        assert!((at(0.5).anchor[0] - 0.3).abs() < 1e-15);
        // From its new anchor it carries the same traction.
        let again = friction(&gap, [0.5, -0.1, 0.0], at(0.5).anchor, 10.0, bound);
        assert!((again.traction[0] - 2.0).abs() < 1e-14);
    }
}
