//! A block with crossing channels under one or several loads on parts of its top, solved
//! by finite elements.

use super::microchannel_block::{BlockLoad, BlockState, BlockStudy, BlockVoid, Sides};
use super::microchannel_cell::{Filling, WallContact};
use taxel_fem::mesh::{CrossingVoids, Footprint, FootprintShape, VoidBlock};

use super::DeformedBody;
use super::solved_voids::{NotSolved, check_stack, filling, light_pressure, solid, void_shape};
use taxel::mechanics::{ClosingCurve, PressureLaw, VoidStack, tabulated_pressure};

/// A piece cut out of a sheet with free sides, with whole crossings of channels.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelBlock {
    /// Section, spacing and stack of the channels, the solid and the liquid.
    pub stack: VoidStack,
    /// Number of upper and of lower channels.
    pub counts: [usize; 2],
    /// Length along the upper and along the lower channels, m.
    pub size: [f64; 2],
    /// Upper and lower channel: the share of its length that lies in the block, up to 1,
    /// and how the rest of it closes, on which nothing presses.
    pub channels: [(f64, ClosingCurve); 2],
}

/// Load on the top of a block, with its middle along the upper and along the lower
/// channels from the middle of the block, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LocalLoad {
    /// A pressure on a rectangle.
    Patch {
        /// Its middle, m.
        centre: [f64; 2],
        /// Its lengths, m.
        size: [f64; 2],
    },
    /// The force of a rigid, flat, round punch without friction. Its rim is rounded with
    /// a twentieth of its diameter.
    Punch {
        /// Its middle, m.
        centre: [f64; 2],
        /// Its diameter, m.
        diameter: f64,
    },
}

/// Loads that press at once, and how they rise: the whole load has one size, 0 at rest, of
/// which each takes its share.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalLoads {
    /// What presses, with its pressure in Pa or force in N over the size of the whole load.
    pub parts: Vec<(LocalLoad, f64)>,
}

impl LocalLoads {
    /// Loads with their pressures in Pa or forces in N, and the size of them together: the
    /// value of the first that presses.
    pub fn of(loads: Vec<(LocalLoad, f64)>) -> (Self, f64) {
        let first = loads.iter().map(|(_, value)| *value);
        let size = first.clone().find(|value| *value != 0.0).unwrap_or(0.0);
        let share = |value: f64| if size == 0.0 { 1.0 } else { value / size };
        let parts = loads
            .into_iter()
            .map(|(load, value)| (load, share(value)))
            .collect();
        (Self { parts }, size)
    }

    /// True if these are `others` at a size: the same places, pressed in the same proportion.
    pub fn include(&self, others: &Self, size: f64) -> bool {
        // Shares are quotients of two values that were read; rest has none.
        let same = |(one, other): (&(LocalLoad, f64), &(LocalLoad, f64))| {
            one.0 == other.0 && (size == 0.0 || (one.1 - other.1).abs() <= 1e-12 * one.1.abs())
        };
        self.parts.len() == others.parts.len() && self.parts.iter().zip(&others.parts).all(same)
    }

    fn values(&self, size: f64) -> Vec<f64> {
        self.parts.iter().map(|(_, share)| share * size).collect()
    }

    /// What they are at a size, in words.
    fn words(&self, size: f64) -> String {
        let words = |(load, share): &(LocalLoad, f64)| match load {
            LocalLoad::Patch { .. } => format!("{:.6} kPa on the patch", 1e-3 * share * size),
            LocalLoad::Punch { .. } => format!("{:.6} mN on the punch", 1e3 * share * size),
        };
        let parts: Vec<String> = self.parts.iter().map(words).collect();
        parts.join(" and ")
    }
}

/// Radius of the rim of a punch over its diameter.
const RIM: f64 = 0.05;
/// Fewest states on the way to the greatest load: they show how far it is, and cost
/// iterations of seconds.
const STATES: usize = 3;
/// Points of the law of the liquid in a part of a channel, at each hundredth of its volume:
/// straight lines between them are within 4 Pa of Eq. 2 down to half the volume.
const LAW_POINTS: usize = 150;

/// States of a block on the way to the greatest load.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedBlock {
    /// Size of the loads with its state; the first is rest.
    states: Vec<(f64, BlockState)>,
    /// Size below which answers lie on a parabola from rest.
    light: f64,
    /// Why the solution ended before the greatest load.
    pub ended: Option<String>,
    /// The block at its greatest load.
    pub body: DeformedBody,
}

impl MicrochannelBlock {
    /// Solves the block at each of these sizes of the loads, and at some between; `progress`
    /// hears the fraction. All press at once: nothing is superposed.
    ///
    /// # Errors
    /// [`NotSolved`] when there is not even a first state.
    pub fn solve(
        &self,
        loads: &LocalLoads,
        sizes: &[f64],
        progress: &mut dyn FnMut(f64),
    ) -> Result<SolvedBlock, NotSolved> {
        let failed =
            |failure: taxel_fem::solver::failure::Failure| NotSolved::Solver(failure.to_string());
        check_stack(&self.stack)?;
        let mut study = self.study(loads).map_err(failed)?;
        let mut states = vec![(0.0, study.state().map_err(failed)?)];
        let mut ended = None;
        let patches = |(load, _): &(LocalLoad, f64)| matches!(load, LocalLoad::Patch { .. });
        let light = if loads.parts.iter().all(patches) {
            // There the patch that is pressed hardest is no longer light.
            let shares = loads.parts.iter().map(|(_, share)| *share);
            light_pressure(&self.stack) / shares.fold(f64::MIN_POSITIVE, f64::max)
        } else {
            // The contact of a punch grows from nothing: no curve leads to it.
            0.0
        };
        let way = way(sizes, light);
        let greatest = way.last().copied().unwrap_or(0.0);
        let mut last = 0.0;
        for &value in &way {
            let heard = &mut |part| progress((last + part * (value - last)) / greatest);
            let state = study.push_heard(&loads.values(value), heard);
            last = value;
            match state {
                Ok(state) => states.push((value, state)),
                Err(failure) if states.len() == 1 && failure.fraction == 0.0 => {
                    return Err(failed(failure));
                }
                Err(failure) => {
                    ended = Some(failure.to_string());
                    break;
                }
            }
        }
        let reached = states.last().map_or(0.0, |(value, _)| *value);
        Ok(SolvedBlock {
            states,
            light,
            ended,
            body: DeformedBody::of(&study.solver, "block", loads.words(reached), "top"),
        })
    }

    fn study(&self, loads: &LocalLoads) -> Result<BlockStudy, taxel_fem::solver::failure::Failure> {
        let stack = &self.stack;
        // What a punch touches follows from its shape.
        let footprint = |centre, size| Footprint {
            centre,
            size,
            shape: FootprintShape::Rectangle,
        };
        let posed = |(load, _): &(LocalLoad, f64)| match *load {
            LocalLoad::Patch { centre, size } => (footprint(centre, size), BlockLoad::Pressure),
            LocalLoad::Punch { centre, diameter } => {
                let size = [diameter; 2];
                (footprint(centre, size), BlockLoad::Punch(RIM * diameter))
            }
        };
        let (footprints, loads): (Vec<_>, Vec<_>) = loads.parts.iter().map(posed).unzip();
        let block = VoidBlock {
            voids: CrossingVoids {
                width: stack.section.width,
                pitch: stack.pitch,
                base: stack.base,
                lower: stack.section.height,
                between: stack.between,
                upper: stack.section.height,
                cover: stack.cover,
                // Cells that answer in minutes; the theory has finer ones beside them.
                smallest: stack.pitch / 8.0,
                growth: 2.0,
                largest: f64::INFINITY,
                shape: void_shape(stack),
            },
            counts: self.counts,
            size: self.size,
            footprints,
        };
        let fillings = [0, 1].map(|layer| {
            let (share, rest) = &self.channels[layer];
            filling_of_part(&stack.liquid, *share, rest)
        });
        BlockStudy::new(
            block,
            Sides::Free,
            &loads,
            solid(&stack.material),
            [&fillings[0], &fillings[1]],
            WallContact::default(),
        )
    }
}

/// Rising loads on the way: those asked for, and some even ones where they are few; instead of
/// loads below `light` its half and itself.
fn way(loads: &[f64], light: f64) -> Vec<f64> {
    let mut loads = loads.to_vec();
    if loads.iter().any(|load| *load > 0.0 && *load < light) {
        loads.retain(|load| *load >= light);
        loads.extend([0.5 * light, light]);
    }
    let greatest = loads.iter().copied().fold(0.0, f64::max);
    let steps = if loads.len() < STATES { STATES } else { 1 };
    let even = (1..steps)
        .map(|step| greatest * step as f64 / steps as f64)
        .filter(|load| *load >= light);
    let mut way: Vec<f64> = loads.iter().copied().chain(even).collect();
    way.retain(|load| *load > 0.0);
    way.sort_by(f64::total_cmp);
    way.dedup();
    way
}

/// Filling of a part of a microchannel, by the volume of this part alone.
///
/// The whole channel obeys the law, V = s V_part + (1 − s) V_rest, and the rest closes by
/// its own curve under the net pressure −P.
fn filling_of_part(liquid: &PressureLaw, share: f64, rest: &ClosingCurve) -> Filling {
    // A billionth is forgiven: lengths are sums of others.
    if share >= 1.0 - 1e-9 || *liquid == PressureLaw::Vented {
        return filling(liquid);
    }
    let of_rest = |pressure: f64| (1.0 - share) * rest.at(-pressure).area_ratio;
    let excess = |part: f64, pressure: f64| {
        let volume = share * part + of_rest(pressure);
        match liquid {
            PressureLaw::Vented => -pressure,
            // Nothing leaves: the sum of the volumes stays.
            PressureLaw::Sealed => 1.0 - volume,
            PressureLaw::Paper(law) => law.pressure(volume) - pressure,
            PressureLaw::Tabulated(points) => tabulated_pressure(points, volume) - pressure,
        }
    };
    let points = (1..=LAW_POINTS).map(|k| {
        let part = 0.01 * k as f64;
        (part, falling_root(|pressure| excess(part, pressure)))
    });
    Filling::Tabulated(points.collect())
}

/// Where a falling function of a pressure in Pa is zero.
fn falling_root(function: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (-1e9, 1e9);
    // 2e9 Pa halved 100 times is below the rounding of a pressure.
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        if function(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

impl SolvedBlock {
    /// The block at a size of its loads, on straight lines between the states, and on
    /// parabolas from rest to a light load; `None` beyond the last.
    pub fn at(&self, load: f64) -> Option<BlockState> {
        let upper = self.states.iter().position(|(known, _)| load <= *known)?;
        let (end, after) = &self.states[upper];
        let Some((start, before)) = upper.checked_sub(1).map(|lower| &self.states[lower]) else {
            return Some(after.clone());
        };
        if let [(_, rest), (half, one), (whole, two), ..] = &self.states[..]
            && *whole <= self.light
            && load <= *whole
        {
            let first = load * (load - whole) / (half * (half - whole));
            let second = load * (load - half) / (whole * (whole - half));
            let parts = [(1.0 - first - second, rest), (first, one), (second, two)];
            return Some(mixed(&parts));
        }
        let share = (load - start) / (end - start);
        Some(mixed(&[(1.0 - share, before), (share, after)]))
    }
}

/// Sum of shares of states.
fn mixed(parts: &[(f64, &BlockState)]) -> BlockState {
    let sum = |of: &dyn Fn(&BlockState) -> f64| -> f64 {
        parts.iter().map(|(share, state)| share * of(state)).sum()
    };
    let first = parts[0].1;
    let voids = [0, 1].map(|layer| {
        (0..first.voids[layer].len())
            .map(|number| {
                let void =
                    |of: &dyn Fn(&BlockVoid) -> f64| sum(&|state| of(&state.voids[layer][number]));
                BlockVoid {
                    inside: void(&|void| void.inside),
                    volume_ratio: void(&|void| void.volume_ratio),
                    thinnest: void(&|void| void.thinnest),
                    thickest: void(&|void| void.thickest),
                    rim: void(&|void| void.rim),
                    resistance_ratio: void(&|void| void.resistance_ratio),
                    gap: void(&|void| void.gap),
                }
            })
            .collect()
    });
    let each = |of: &dyn Fn(&BlockState) -> &[f64]| -> Vec<f64> {
        let numbers = 0..of(first).len();
        numbers
            .map(|number| sum(&|state| of(state)[number]))
            .collect()
    };
    BlockState {
        drives: each(&|state| &state.drives),
        force: sum(&|state| state.force),
        contact_radii: each(&|state| &state.contact_radii),
        stress: sum(&|state| state.stress),
        voids,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::mechanics::{ClosingPoint, PaperLaw};

    const SCALE: f64 = 20.265e3;

    fn rest() -> ClosingCurve {
        let point = |net_pressure: f64, area_ratio| ClosingPoint {
            net_pressure,
            area_ratio,
        };
        ClosingCurve::from_points(&[point(2e3, 0.8), point(4e3, 0.6)]).unwrap()
    }

    fn points(liquid: &PressureLaw, share: f64) -> Vec<(f64, f64)> {
        match filling_of_part(liquid, share, &rest()) {
            Filling::Tabulated(points) => points,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_rest_of_a_channel_takes_what_is_pressed_out_of_its_part() {
        let paper = PressureLaw::Paper(PaperLaw {
            expansion: 0.2,
            atmosphere: 101.325e3,
        });
        let curve = rest();
        for liquid in [paper.clone(), PressureLaw::Sealed] {
            let points = points(&liquid, 0.1);
            for &(part, pressure) in points.iter().step_by(10) {
                let volume = 0.1 * part + 0.9 * curve.at(-pressure).area_ratio;
                let missing = match &liquid {
                    PressureLaw::Sealed => volume - 1.0,
                    _ => SCALE * (1.0 / volume - 1.0) / pressure.max(1.0) - 1.0,
                };
                // Rounding of a root among pressures up to 1e9 Pa, over at least 1 Pa.
                if part < 1.0 {
                    assert!(missing.abs() < 1e-6, "{liquid:?} {part} {missing}");
                }
            }
            let at_rest = points.iter().find(|point| point.0 == 1.0).unwrap();
            assert!(at_rest.1.abs() < 1e-6, "{at_rest:?}");
            assert!(points.windows(2).all(|pair| pair[0].1 > pair[1].1));
        }
        // A channel that ends at the block keeps the law itself.
        assert_eq!(
            filling_of_part(&paper, 1.0, &curve),
            Filling::Gas(0.2 * 101.325e3)
        );
        assert_eq!(
            filling_of_part(&PressureLaw::Vented, 0.1, &curve),
            Filling::Vented
        );
    }

    #[test]
    fn the_way_holds_every_load_once() {
        assert_eq!(way(&[0.0], 0.0), Vec::<f64>::new());
        assert_eq!(way(&[6.0, 3.0], 0.0), [2.0, 3.0, 4.0, 6.0]);
        assert_eq!(way(&[3.0, 6.0, 3.0], 0.0), [3.0, 6.0]);
        let many: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(way(&many, 0.0), many[1..]);
        // Light ones are read off the way to a heavier one.
        assert_eq!(way(&[0.1], 2.0), [1.0, 2.0]);
        assert_eq!(way(&[0.1, 6.0, 0.2], 2.0), [1.0, 2.0, 6.0]);
    }
}
