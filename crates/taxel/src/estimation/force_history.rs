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

/// What is above noise by so many standard deviations is clearly more: noise is in one of 400.
const CLEARLY: f64 = 3.0;
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
    /// Standard deviations of the force at the extreme.
    at_extreme: Spread,
    largest: f64,
    /// Rise of the peak that is being left: middle, 10-90 % time, height, and its deviation.
    risen: Option<[f64; 4]>,
    cycles: Vec<Cycle>,
    cyclic: bool,
    plateau: Plateau,
    /// The force that was held, and as it stood a while ago: what begins to change it is not part
    /// of it.
    held: Option<Plateau>,
    /// True while the force that is held first comes after a pause: what it came from was not seen.
    unseen: bool,
    before: Option<(f64, Plateau)>,
}

/// A stretch of even force.
#[derive(Debug, Clone, Copy, Default)]
struct Plateau {
    since: f64,
    count: f64,
    mean: f64,
    /// Its later part: the tail of the change before it is left out.
    late: Line,
    late_since: f64,
}

/// Standard deviations of a force.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Spread {
    /// All that is not known of it.
    pub(super) whole: f64,
    /// By the noise of the readings, which differs from frame to frame.
    pub(super) noise: f64,
}

impl Spread {
    /// What stays the same from frame to frame: no mean makes it less.
    fn lasting(self) -> f64 {
        (self.whole * self.whole - self.noise * self.noise)
            .max(0.0)
            .sqrt()
    }
}

/// A straight line through forces over time, by least squares.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    count: f64,
    time: f64,
    force: f64,
    times: f64,
    product: f64,
    forces: f64,
    noise: f64,
    lasting: f64,
}

impl Line {
    fn push(&mut self, point: Point, spread: Spread) {
        self.count += 1.0;
        let (time, force) = (point.time - self.time, point.force - self.force);
        self.time += time / self.count;
        self.force += force / self.count;
        self.times += time * (point.time - self.time);
        self.product += time * (point.force - self.force);
        self.forces += force * (point.force - self.force);
        self.noise += (spread.noise * spread.noise - self.noise) / self.count;
        self.lasting += (spread.lasting() - self.lasting) / self.count;
    }

    /// Variance of what a change from an earlier force is not known by that lasts: all of it but what grows
    /// with the force, such as a gain, is the same before and after. If both forces have a² of the one and
    /// g²F² of the other, g²(F₂ - F₁)² is left.
    fn lasting_since(&self, before: &Self) -> f64 {
        let squares = self.lasting.powi(2) - before.lasting.powi(2);
        let share = (self.force - before.force) / (self.force + before.force);
        let least = (self.lasting - before.lasting).powi(2);
        // Of forces to both sides of none a share is not known; nor can less be left than the deviations
        // differ by.
        if share.abs() <= 1.0 {
            (squares * share).max(least)
        } else {
            least
        }
    }

    /// Change along the line over `time`, s.
    fn change(&self, time: f64) -> f64 {
        if self.times > 0.0 {
            self.product / self.times * time
        } else {
            0.0
        }
    }

    /// Variance of one force about the line: that of the noise of the readings, unless the forces
    /// scatter by clearly more, or it is not known.
    fn scatter(&self) -> f64 {
        let left = self.forces - self.change(1.0) * self.product;
        let freedom = self.count - 2.0;
        if freedom <= 0.0 {
            return self.noise;
        }
        let found = left / freedom;
        // The variance of a variance by so many differences is 2/n of its square.
        let by_chance = self.noise * (1.0 + CLEARLY * (2.0 / freedom).sqrt());
        if found > by_chance { found } else { self.noise }
    }

    /// Variance of the mean of a force that is held since a time, s: by the scatter, and by how far
    /// the force goes on, if it clearly does.
    fn variance(&self, since: f64) -> f64 {
        let by_scatter = self.scatter() / self.count.max(1.0);
        let slope = self.change(1.0);
        if slope * slope * self.times > CLEARLY * CLEARLY * self.scatter() {
            // It was anywhere between what it was at the beginning and what it is.
            by_scatter + (slope * (self.time - since)).powi(2) / 3.0
        } else {
            by_scatter
        }
    }

    /// True if the change over `time` is more than `most`, and more than noise makes.
    fn moves(&self, time: f64, most: f64) -> bool {
        let by_noise = (self.scatter() / self.times).sqrt() * time;
        self.count > 2.0 && self.change(time).abs() > most.max(CLEARLY * by_noise)
    }
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
            at_extreme: Spread::default(),
            largest: 0.0,
            risen: None,
            cycles: Vec::new(),
            cyclic: false,
            plateau: Plateau::default(),
            held: None,
            unseen: false,
            before: None,
        }
    }

    /// The same after a pause of which nothing is known: at the force that comes first.
    pub(super) fn after_pause(options: HistoryOptions, time_ns: u64, force: f64) -> Self {
        let mut history = Self::new(options, time_ns);
        history.begin_anew(Point { time: 0.0, force });
        history
    }

    /// Takes a force with its standard deviations. Times must grow; after a
    /// pause the history begins anew at this force.
    pub(super) fn push(&mut self, time_ns: u64, force: f64, spread: Spread) -> [Option<Course>; 2] {
        let deviation = spread.whole;
        let time = time_ns.saturating_sub(self.begin_ns) as f64 * 1e-9;
        let pause = self.last.map_or(0.0, |last| time - last.time);
        let paused = pause > self.options.longest_pause;
        let point = Point { time, force };
        if paused {
            self.begin_anew(point);
        }
        self.last = Some(point);
        self.largest = self.largest.max(point.force);
        let least = (self.options.deviations * std::f64::consts::SQRT_2 * deviation)
            .max(self.options.share * self.largest);
        let turned = self.turn(point, least, spread);
        [turned, self.hold(point, least, spread)]
    }

    fn begin_anew(&mut self, point: Point) {
        self.samples.clear();
        self.samples.push(point);
        (self.rising, self.valley, self.extreme) = (true, point, point);
        (self.risen, self.cyclic, self.held) = (None, false, None);
        (self.before, self.unseen) = (None, true);
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
        (self.plateau, self.held, self.before) = (Plateau::default(), None, None);
        self.unseen = false;
    }

    /// Follows rises and falls.
    fn turn(&mut self, point: Point, least: f64, spread: Spread) -> Option<Course> {
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
            (self.extreme, self.at_extreme) = (point, spread);
        }
        let back = (point.force - self.extreme.force).abs() > least;
        match (self.rising, back) {
            (true, true) => {
                // A wobble on the way down from nothing is no rise.
                self.risen =
                    (self.extreme.force - self.valley.force > least).then(|| self.rise(least));
                (self.rising, self.extreme) = (false, point);
                None
            }
            (false, true) => {
                let bottom = self.extreme;
                let found = self.close_cycle(bottom);
                self.samples.clear();
                self.samples.extend([bottom, point]);
                (self.rising, self.valley, self.extreme) = (true, bottom, point);
                found.or_else(|| self.impact(bottom))
            }
            (false, false) => self.impact(point),
            (true, false) => None,
        }
    }

    /// Middle, 10-90 % time, height and its deviation of the rise that ended.
    fn rise(&self, least: f64) -> [f64; 4] {
        let spread = self.at_extreme;
        let [top, deviation] = self.top(least, spread);
        // What the rise came from, if that was held; else the lowest force, at its scatter.
        let held = self
            .held
            .filter(|held| (held.late.force - self.valley.force).abs() < least);
        let (bottom, variance) = match held {
            Some(held) => (held.late.force, held.late.variance(held.since)),
            // Before a contact there is no force at all.
            None if self.valley.force == 0.0 => (0.0, 0.0),
            None => (self.valley.force, spread.noise * spread.noise),
        };
        let height = top - bottom;
        let deviation = (deviation * deviation + variance).sqrt();
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
        [when(0.5), when(0.9) - when(0.1), height, deviation]
    }

    /// Force at the top of the rise and its deviation: that of the parabola through the forces
    /// within `least` of the highest one, which is higher than the force by its noise, and lower
    /// by what lies between two frames.
    fn top(&self, least: f64, spread: Spread) -> [f64; 2] {
        let near = |point: &&Point| self.extreme.force - point.force <= least;
        let points = || {
            self.samples
                .iter()
                .rev()
                .take_while(|point| point.time > self.valley.time)
                .filter(near)
        };
        let highest = self.extreme.force;
        let Some(parabola) = Parabola::through(&points(), self.extreme) else {
            // Of so few frames the highest is as good as any.
            return [highest, spread.whole.hypot(least)];
        };
        let noise = parabola.scatter.max(spread.noise * spread.noise);
        // What the curve does not follow is no noise of its own.
        let misfit = (parabola.scatter - spread.noise * spread.noise).max(0.0);
        let variance = noise * parabola.weight + misfit + spread.lasting().powi(2);
        [parabola.top, variance.sqrt()]
    }

    /// An impact that is over at `point`.
    fn impact(&mut self, point: Point) -> Option<Course> {
        let [_, rise_time, height, deviation] = self.risen?;
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
        self.cycles.extend(rise.map(|[middle, _, rise, _]| Cycle {
            middle,
            rise,
            fall: f64::NAN,
        }));
        Some(Course::Impact {
            rise_time,
            peak: height,
            deviation,
        })
    }

    fn plateau_since(&self, time: f64) -> bool {
        self.held.is_some_and(|held| held.since > time)
    }

    /// Adds a rise and its fall to `bottom`; says when they have become cyclic.
    fn close_cycle(&mut self, bottom: Point) -> Option<Course> {
        match (self.risen.take(), self.cycles.last_mut()) {
            (Some([middle, _, rise, _]), _) => self.cycles.push(Cycle {
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

    /// Goes on with a held force as it stood a while ago.
    fn keep(&mut self, time: f64, half: f64) {
        let now = self.plateau;
        match &mut self.before {
            Some((since, before)) if time - *since >= 0.5 * half => {
                self.held = Some(*before);
                (*since, *before) = (time, now);
            }
            Some(_) => {}
            None => self.before = Some((time, now)),
        }
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
    fn hold(&mut self, point: Point, least: f64, spread: Spread) -> Option<Course> {
        let plateau = &mut self.plateau;
        if plateau.count == 0.0 || (point.force - plateau.mean).abs() > 0.5 * least {
            *plateau = Plateau {
                since: point.time,
                count: 1.0,
                mean: point.force,
                late: Line::default(),
                late_since: point.time,
            };
            return None;
        }
        plateau.count += 1.0;
        plateau.mean += (point.force - plateau.mean) / plateau.count;
        let half = 0.5 * self.options.dwell;
        if point.time - plateau.late_since < half {
            return None;
        }
        plateau.late.push(point, spread);
        if point.time - plateau.late_since < self.options.dwell {
            return None;
        }
        if self.held.is_some_and(|held| held.since == plateau.since) {
            self.keep(point.time, half);
            return None;
        }
        // A force that still goes on is not held: it is looked at anew.
        if plateau.late.moves(self.options.dwell, least) {
            (plateau.late, plateau.late_since) = (Line::default(), point.time);
            return None;
        }
        let seen = !std::mem::take(&mut self.unseen);
        let (before, now) = (self.held.unwrap_or_default(), self.plateau);
        (self.held, self.before) = (Some(now), Some((point.time, now)));
        let change = now.late.force - before.late.force;
        let mut variance = now.late.variance(now.since) + now.late.lasting_since(&before.late);
        if before.late.count > 0.0 {
            variance += before.late.variance(before.since);
        }
        (seen && change.abs() > least).then_some(Course::Step {
            change,
            deviation: variance.sqrt(),
        })
    }
}

/// A parabola through forces near a top, by least squares.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    /// Its value at its top, or at the end of the forces where it has none among them.
    top: f64,
    /// Variance of one force about it.
    scatter: f64,
    /// Variance of the top over that of one force.
    weight: f64,
}

impl Parabola {
    /// Through at least three forces, of which three leave no scatter; times are counted from `highest`.
    fn through<'a>(
        points: &(impl Iterator<Item = &'a Point> + Clone),
        highest: Point,
    ) -> Option<Self> {
        let count = points.clone().count();
        if count < 3 {
            return None;
        }
        let span = points
            .clone()
            .map(|point| (point.time - highest.time).abs())
            .fold(0.0, f64::max);
        let row = |point: &Point| {
            let time = (point.time - highest.time) / span;
            [1.0, time, time * time]
        };
        let (mut normal, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for point in points.clone() {
            let row = row(point);
            for i in 0..3 {
                right[i] += row[i] * (point.force - highest.force);
                for j in 0..3 {
                    normal[i][j] += row[i] * row[j];
                }
            }
        }
        let inverse = inverse_of_symmetric(&normal)?;
        let along = |row: &[f64; 3], other: &[f64; 3]| -> f64 {
            row.iter().zip(other).map(|(a, b)| a * b).sum()
        };
        let found = inverse.map(|row| along(&row, &right));
        let squares = points.clone().map(|point| {
            let left = point.force - highest.force - along(&row(point), &found);
            left * left
        });
        let scatter = squares.sum::<f64>() / (count - 3).max(1) as f64;
        let times = || points.clone().map(|point| row(point)[1]);
        let [first, last] = [
            times().fold(f64::INFINITY, f64::min),
            times().fold(f64::NEG_INFINITY, f64::max),
        ];
        let at = if found[2] < 0.0 {
            -0.5 * found[1] / found[2]
        } else {
            0.0
        };
        let at = at.clamp(first, last);
        let at = [1.0, at, at * at];
        let weight = along(&at, &inverse.map(|row| along(&row, &at)));
        Some(Self {
            top: highest.force + along(&at, &found),
            scatter,
            weight,
        })
    }
}

/// The inverse of a symmetric matrix by cofactors; none of one that is singular.
fn inverse_of_symmetric(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let cofactor = |i: usize, j: usize| {
        let [a, b] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(j + 1) % 3, (j + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    let inverse: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant));
    inverse
        .iter()
        .flatten()
        .all(|value| value.is_finite())
        .then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const NOISE: Spread = Spread {
        whole: 1e-3,
        noise: 1e-3,
    };

    /// Courses of a force given every so many milliseconds, the steps uneven.
    fn courses(force: impl Fn(f64) -> f64, duration: f64) -> Vec<(f64, Course)> {
        let mut history = ForceHistory::new(HistoryOptions::default(), 0);
        let mut found = Vec::new();
        let (mut time_ns, mut step) = (0_u64, 0_u64);
        while (time_ns as f64) < duration * 1e9 {
            step += 1;
            time_ns += [1_000_000, 2_500_000, 1_700_000][step as usize % 3];
            let time = time_ns as f64 * 1e-9;
            let courses = history.push(time_ns, force(time), NOISE);
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
            history.push(i * 1_000_000, 0.5, NOISE);
        }
        history.push(400_000_000, 0.1, NOISE);
        assert_eq!(history.valley.force, 0.1);
        assert!(history.held.is_none() && history.cycles.is_empty());
    }

    /// Of so many events of force with noise, given at 60 or 1000 Hz, those whose 95 % interval
    /// holds the truth, and all.
    fn held(
        events: usize,
        rate: f64,
        shape: impl Fn(f64) -> (f64, f64),
        wanted: impl Fn(&Course) -> Option<[f64; 2]>,
    ) -> [usize; 2] {
        let mut random = taxel_numerics::Noise::seeded(7);
        let (mut held, mut all) = (0, 0);
        for event in 0..events {
            // The frames lie anywhere in the event.
            let phase = (event as f64 * 0.618).fract() / rate;
            let mut history = ForceHistory::new(HistoryOptions::default(), 0);
            let mut found = None;
            for frame in 1..(1.6 * rate) as u64 {
                let time = frame as f64 / rate + phase;
                let (force, _) = shape(time);
                let force = force + 5e-3 * random.normal();
                let spread = Spread {
                    whole: 5e-3,
                    noise: 5e-3,
                };
                let courses = history.push((time * 1e9) as u64, force, spread);
                found = found.or(courses.iter().flatten().find_map(&wanted));
            }
            let truth = shape(0.0).1;
            if let Some([value, deviation]) = found {
                all += 1;
                held += usize::from((value - truth).abs() <= 1.96 * deviation);
            }
        }
        [held, all]
    }

    fn step(course: &Course) -> Option<[f64; 2]> {
        match course {
            Course::Step { change, deviation } => Some([*change, *deviation]),
            _ => None,
        }
    }

    fn impact(course: &Course) -> Option<[f64; 2]> {
        match course {
            Course::Impact {
                peak, deviation, ..
            } => Some([*peak, *deviation]),
            _ => None,
        }
    }

    #[test]
    fn intervals_of_steps_and_impacts_hold_the_truth() {
        let events = 1000;
        for rate in [60.0, 250.0, 1000.0] {
            for rise in [0.02, 0.1, 0.3] {
                let shape = |t: f64| (0.5 * ramp(t, 0.1, 0.1 + rise), 0.5);
                let found = held(events, rate, shape, step);
                println!("step, {rate} Hz, {rise} s: {found:?}");
                assert_coverage(found, events);
            }
            for width in [0.1, 0.2, 0.4] {
                let shape = |t: f64| {
                    let arc = std::f64::consts::PI * (t - 0.1) / width;
                    (
                        if (0.0..1.0).contains(&((t - 0.1) / width)) {
                            0.5 * arc.sin()
                        } else {
                            0.0
                        },
                        0.5,
                    )
                };
                let found = held(events, rate, shape, impact);
                println!("impact, {rate} Hz, {width} s: {found:?}");
                assert_coverage(found, events);
            }
        }
    }

    /// From 93 to 97 %, with three deviations of a count of so many, and nearly all events found.
    fn assert_coverage([held, all]: [usize; 2], events: usize) {
        let share = held as f64 / all as f64;
        let error = 3.0 * (0.05 * 0.95 / all as f64).sqrt();
        assert!(10 * all >= 9 * events, "{all} of {events}");
        assert!(share > 0.93 - error, "{share}");
    }

    #[test]
    fn a_slow_ramp_is_no_step_or_one_with_the_interval_of_the_ramp() {
        let found = courses(|t| 0.5 * ramp(t, 0.1, 4.1), 5.0);
        for (time, course) in &found {
            let Course::Step { change, deviation } = course else {
                panic!("{course:?}")
            };
            let truth = 0.5 * ramp(*time, 0.1, 4.1);
            assert!(*change <= truth + 1.96 * deviation, "{time}: {course:?}");
        }
    }
}
