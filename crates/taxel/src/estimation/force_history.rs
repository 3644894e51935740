//! The force of one contact over time: steps, impacts and cycles.

/// Options of the classification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryOptions {
    /// A change of force counts above this many of its standard deviations;
    /// default 6.
    pub deviations: f64,
    /// ... and above this share of the largest force of the contact; default
    /// 0.1.
    pub share: f64,
    /// A force that stays within such a change for this time, s, is held;
    /// default 0.4, more than an impact's pause at its top.
    pub dwell: f64,
    /// An impact comes and goes within this time, s; default 0.6.
    pub longest_impact: f64,
    /// Periods that are alike within this share make a cyclic load; default 0.15.
    pub regularity: f64,
    /// A pause between frames after which the history begins anew, s; default 0.1.
    pub longest_pause: f64,
    /// A contact that comes back to its position within this time, s, goes on with
    /// its history: so a load that lifts off is cyclic too; default 1.
    pub longest_break: f64,
}

impl Default for HistoryOptions {
    fn default() -> Self {
        Self {
            deviations: 6.0,
            share: 0.1,
            dwell: 0.4,
            longest_impact: 0.6,
            regularity: 0.15,
            longest_pause: 0.1,
            longest_break: 1.0,
        }
    }
}

/// Course of the force of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    /// It went from one held force to another one.
    Step { change: f64, deviation: f64 },
    /// It came and went: rise time from 10 to 90 %, s, and height of the peak.
    Impact {
        rise_time: f64,
        peak: f64,
        deviation: f64,
    },
    /// It comes and goes: frequency, Hz; smaller over larger amplitude of
    /// coming and going.
    Cyclic {
        frequency: f64,
        deviation: f64,
        symmetry: f64,
    },
}

/// Time, s, and force.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    time: f64,
    force: f64,
}

/// A rise with the fall that ends it.
#[derive(Debug, Clone, Copy)]
struct Cycle {
    /// When the rise was half done, s.
    middle: f64,
    rise: f64,
    fall: f64,
}

/// Cycles that make a cyclic load: three periods between them.
const CYCLES: usize = 4;
/// Remainder of an impact when it is over, as a share.
const OVER: f64 = 0.25;
/// Samples of a rise that are kept; of a longer one the older half is dropped.
const MOST_SAMPLES: usize = 8192;

/// Follows the force of one contact by its turning points.
#[derive(Debug, Clone)]
pub(super) struct ForceHistory {
    options: HistoryOptions,
    begin_ns: u64,
    last: Option<Point>,
    /// Since the last valley.
    samples: Vec<Point>,
    rising: bool,
    valley: Point,
    extreme: Point,
    largest: f64,
    /// Rise of the peak that is being left: middle, 10-90 % time, height.
    risen: Option<[f64; 3]>,
    cycles: Vec<Cycle>,
    cyclic: bool,
    plateau: Plateau,
    held: Option<Plateau>,
}

/// A stretch of even force.
#[derive(Debug, Clone, Copy, Default)]
struct Plateau {
    since: f64,
    count: f64,
    mean: f64,
}

impl ForceHistory {
    /// Begins without force at `time_ns`.
    pub(super) fn new(options: HistoryOptions, time_ns: u64) -> Self {
        let start = Point {
            time: 0.0,
            force: 0.0,
        };
        Self {
            options,
            begin_ns: time_ns,
            last: None,
            samples: vec![start],
            rising: true,
            valley: start,
            extreme: start,
            largest: 0.0,
            risen: None,
            cycles: Vec::new(),
            cyclic: false,
            plateau: Plateau::default(),
            held: None,
        }
    }

    /// Takes a force with its standard deviation. Times must grow; after a
    /// pause the history begins anew at this force.
    pub(super) fn push(&mut self, time_ns: u64, force: f64, deviation: f64) -> [Option<Course>; 2] {
        let point = Point {
            time: time_ns.saturating_sub(self.begin_ns) as f64 * 1e-9,
            force,
        };
        let pause = self.last.map_or(0.0, |last| point.time - last.time);
        if pause > self.options.longest_pause {
            self.begin_anew(point);
        }
        self.last = Some(point);
        self.largest = self.largest.max(force);
        let least = (self.options.deviations * std::f64::consts::SQRT_2 * deviation)
            .max(self.options.share * self.largest);
        let turned = self.turn(point, least, deviation);
        [turned, self.hold(point, least, deviation)]
    }

    fn begin_anew(&mut self, point: Point) {
        self.samples.clear();
        self.samples.push(point);
        (self.rising, self.valley, self.extreme) = (true, point, point);
        (self.risen, self.cyclic, self.held) = (None, false, None);
        self.cycles.clear();
        self.plateau = Plateau::default();
    }

    /// Goes on at `time_ns` after a time without a contact, which is no pause.
    pub(super) fn resume(&mut self, time_ns: u64) {
        let nothing = Point {
            time: time_ns.saturating_sub(self.begin_ns) as f64 * 1e-9,
            force: 0.0,
        };
        self.last = Some(nothing);
        if !self.rising {
            self.extreme = nothing;
        }
        (self.plateau, self.held) = (Plateau::default(), None);
    }

    /// Follows rises and falls.
    fn turn(&mut self, point: Point, least: f64, deviation: f64) -> Option<Course> {
        let onwards = if self.rising {
            point.force >= self.extreme.force
        } else {
            point.force <= self.extreme.force
        };
        if self.rising {
            if self.samples.len() >= MOST_SAMPLES {
                self.samples.drain(..MOST_SAMPLES / 2);
            }
            self.samples.push(point);
        }
        if onwards {
            self.extreme = point;
        }
        let back = (point.force - self.extreme.force).abs() > least;
        match (self.rising, back) {
            (true, true) => {
                // A wobble on the way down from nothing is no rise.
                self.risen = (self.extreme.force - self.valley.force > least).then(|| self.rise());
                (self.rising, self.extreme) = (false, point);
                None
            }
            (false, true) => {
                let bottom = self.extreme;
                let found = self.close_cycle(bottom);
                self.samples.clear();
                self.samples.extend([bottom, point]);
                (self.rising, self.valley, self.extreme) = (true, bottom, point);
                found.or_else(|| self.impact(bottom, deviation))
            }
            (false, false) => self.impact(point, deviation),
            (true, false) => None,
        }
    }

    /// Middle, 10-90 % time and height of the rise that ended.
    fn rise(&self) -> [f64; 3] {
        let height = self.extreme.force - self.valley.force;
        let when = |share: f64| {
            let level = self.valley.force + share * height;
            let passed = self
                .samples
                .windows(2)
                .find(|pair| pair[0].force <= level && pair[1].force > level);
            passed.map_or(self.extreme.time, |pair| {
                let share = (level - pair[0].force) / (pair[1].force - pair[0].force);
                pair[0].time + share * (pair[1].time - pair[0].time)
            })
        };
        [when(0.5), when(0.9) - when(0.1), height]
    }

    /// An impact that is over at `point`.
    fn impact(&mut self, point: Point, deviation: f64) -> Option<Course> {
        let [_, rise_time, height] = self.risen?;
        let over = point.force - self.valley.force < OVER * height;
        let late = point.time - self.valley.time > self.options.longest_impact;
        // In a cyclic load, and after a force that was held, there is none.
        if late || self.cyclic || self.plateau_since(self.valley.time) {
            return None;
        }
        if !over {
            return None;
        }
        let rise = self.risen.take();
        // The fall is still needed for the cycle.
        self.cycles.extend(rise.map(|[middle, _, rise]| Cycle {
            middle,
            rise,
            fall: f64::NAN,
        }));
        Some(Course::Impact {
            rise_time,
            peak: height,
            deviation: std::f64::consts::SQRT_2 * deviation,
        })
    }

    fn plateau_since(&self, time: f64) -> bool {
        self.held.is_some_and(|held| held.since > time)
    }

    /// Adds a rise and its fall to `bottom`; says when they have become cyclic.
    fn close_cycle(&mut self, bottom: Point) -> Option<Course> {
        match (self.risen.take(), self.cycles.last_mut()) {
            (Some([middle, _, rise]), _) => self.cycles.push(Cycle {
                middle,
                rise,
                fall: self.valley.force + rise - bottom.force,
            }),
            (None, Some(cycle)) if cycle.fall.is_nan() => {
                cycle.fall = self.valley.force + cycle.rise - bottom.force;
            }
            _ => return None,
        }
        if self.cycles.len() > CYCLES {
            self.cycles.remove(0);
        }
        if self.cycles.len() < CYCLES {
            return None;
        }
        let regular = self.regular();
        let begins = regular.is_some() && !self.cyclic;
        self.cyclic = regular.is_some();
        regular.filter(|_| begins)
    }

    /// The cyclic load that the last cycles are, if they are alike.
    fn regular(&self) -> Option<Course> {
        let periods: Vec<f64> = self
            .cycles
            .windows(2)
            .map(|pair| pair[1].middle - pair[0].middle)
            .collect();
        let count = periods.len() as f64;
        let mean = periods.iter().sum::<f64>() / count;
        let alike = |value: f64, mean: f64| (value / mean - 1.0).abs() < self.options.regularity;
        let rise = self.cycles.iter().map(|cycle| cycle.rise).sum::<f64>() / CYCLES as f64;
        // The first rise begins below the others, as a load that settles.
        let even = periods.iter().all(|period| alike(*period, mean))
            && self.cycles[1..].iter().all(|cycle| alike(cycle.rise, rise));
        let last = self.cycles.last()?;
        let variance = periods.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (count - 1.0);
        even.then(|| Course::Cyclic {
            frequency: 1.0 / mean,
            deviation: (variance / count).sqrt() / (mean * mean),
            symmetry: last.rise.min(last.fall) / last.rise.max(last.fall),
        })
    }

    /// Follows held forces.
    fn hold(&mut self, point: Point, least: f64, deviation: f64) -> Option<Course> {
        let plateau = &mut self.plateau;
        if plateau.count == 0.0 || (point.force - plateau.mean).abs() > 0.5 * least {
            *plateau = Plateau {
                since: point.time,
                count: 1.0,
                mean: point.force,
            };
            return None;
        }
        plateau.count += 1.0;
        plateau.mean += (point.force - plateau.mean) / plateau.count;
        if point.time - plateau.since < self.options.dwell {
            return None;
        }
        let before = self.held.unwrap_or_default();
        let now = self.plateau;
        if self.held.is_some_and(|held| held.since == now.since) {
            self.held = Some(now);
            return None;
        }
        self.held = Some(now);
        let change = now.mean - before.mean;
        let variance = deviation * deviation / now.count;
        (change.abs() > least).then_some(Course::Step {
            change,
            deviation: variance.sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Courses of a force given every so many milliseconds, the steps uneven.
    fn courses(force: impl Fn(f64) -> f64, duration: f64) -> Vec<(f64, Course)> {
        let mut history = ForceHistory::new(HistoryOptions::default(), 0);
        let mut found = Vec::new();
        let (mut time_ns, mut step) = (0_u64, 0_u64);
        while (time_ns as f64) < duration * 1e9 {
            step += 1;
            time_ns += [1_000_000, 2_500_000, 1_700_000][step as usize % 3];
            let time = time_ns as f64 * 1e-9;
            let courses = history.push(time_ns, force(time), 1e-3);
            found.extend(courses.into_iter().flatten().map(|course| (time, course)));
        }
        found
    }

    fn ramp(time: f64, from: f64, to: f64) -> f64 {
        ((time - from) / (to - from)).clamp(0.0, 1.0)
    }

    #[test]
    fn a_force_that_stays_is_a_step() {
        let found = courses(|t| 0.5 * ramp(t, 0.1, 0.15) - 0.2 * ramp(t, 1.0, 1.2), 2.0);
        let steps: Vec<f64> = found
            .iter()
            .map(|(_, course)| match course {
                Course::Step { change, .. } => *change,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(steps.len(), 2, "{found:?}");
        // A plateau begins within half of the least change, here a twentieth of the force.
        assert!((steps[0] - 0.5).abs() < 0.005 && (steps[1] + 0.2).abs() < 0.005);
    }

    #[test]
    fn a_force_that_comes_and_goes_is_an_impact_with_its_rise_time() {
        for top in [0.0, 0.15, 0.25] {
            let force = |t| 0.5 * (ramp(t, 0.1, 0.15) - ramp(t, 0.15 + top, 0.2 + top));
            let found = courses(force, 1.0);
            let [
                (
                    _,
                    Course::Impact {
                        rise_time, peak, ..
                    },
                ),
            ] = found[..]
            else {
                panic!("{found:?}")
            };
            // Steps of the sampling near the peak: 2.5 ms of a rise of 50 ms.
            assert!((peak - 0.5).abs() < 0.025, "{peak}");
            assert!((rise_time - 0.04).abs() < 0.0025, "{rise_time}");
        }
    }

    #[test]
    fn cycles_have_their_frequency() {
        for frequency in [2.0, 2.86, 5.0] {
            let force = |t: f64| 0.25 - 0.25 * (TAU * frequency * t).cos();
            let found = courses(force, 6.0 / frequency);
            let cyclic: Vec<_> = found
                .iter()
                .filter_map(|(_, course)| match course {
                    Course::Cyclic {
                        frequency,
                        deviation,
                        symmetry,
                    } => Some((*frequency, *deviation, *symmetry)),
                    _ => None,
                })
                .collect();
            assert_eq!(cyclic.len(), 1, "{found:?}");
            let (at, deviation, symmetry) = cyclic[0];
            // Interpolation between steps of up to 2.5 ms of a sine.
            assert!((at / frequency - 1.0).abs() < 2e-3, "{at}");
            assert!(deviation < 5e-3 * frequency && symmetry > 0.99);
        }
    }

    #[test]
    fn a_pause_begins_anew() {
        let mut history = ForceHistory::new(HistoryOptions::default(), 0);
        for i in 1..100_u64 {
            history.push(i * 1_000_000, 0.5, 1e-3);
        }
        history.push(400_000_000, 0.1, 1e-3);
        assert_eq!(history.valley.force, 0.1);
        assert!(history.held.is_none() && history.cycles.is_empty());
    }
}
