//! A foot that rolls from its heel to its toes.

use super::{Contact, ramp};

/// Weight of the walker, N.
const WEIGHT: f64 = 700.0;

/// A part of the sole that carries: where (shares of length from the toes and of width), its radius (m),
/// and when its share of the load rises and falls (shares of the stance).
struct Part {
    at: [f64; 2],
    radius: f64,
    rises: [f64; 2],
    falls: [f64; 2],
}

const fn part(at: [f64; 2], radius: f64, rises: [f64; 2], falls: [f64; 2]) -> Part {
    Part {
        at,
        radius,
        rises,
        falls,
    }
}

/// Heel, outer midfoot, inner and outer ball, great toe.
const PARTS: [Part; 5] = [
    part([0.84, 0.50], 0.026, [-0.1, 0.0], [0.35, 0.65]),
    part([0.58, 0.62], 0.019, [0.05, 0.3], [0.5, 0.75]),
    part([0.30, 0.34], 0.022, [0.2, 0.6], [0.85, 1.0]),
    part([0.32, 0.68], 0.022, [0.15, 0.5], [0.75, 0.95]),
    part([0.11, 0.40], 0.015, [0.45, 0.8], [1.0, 1.1]),
];

/// Force on the ground at a share of the stance, N: two humps, 0 before and after it.
pub(crate) fn force(stance: f64) -> f64 {
    let envelope = ramp(stance, 0.0, 0.2) * (1.0 - ramp(stance, 0.8, 1.0));
    WEIGHT * envelope * (0.8 + 4.8 * (stance - 0.5).powi(2))
}

/// Contacts of a foot of a length and a width (m) at a share of the stance; their forces add up to [`force`].
pub(crate) fn contacts(stance: f64, [length, width]: [f64; 2]) -> Vec<Contact> {
    let share = |part: &Part| {
        ramp(stance, part.rises[0], part.rises[1])
            * (1.0 - ramp(stance, part.falls[0], part.falls[1]))
    };
    let all: f64 = PARTS.iter().map(share).sum();
    let contact = |part: &Part| Contact {
        centre: [part.at[0] * length, part.at[1] * width],
        radius: part.radius,
        force: if all > 0.0 {
            force(stance) * share(part) / all
        } else {
            0.0
        },
    };
    PARTS.iter().map(contact).collect()
}
