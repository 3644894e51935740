//! The offset of outputs to which a leak returns them, by the charge that went through the
//! leak (P3).

/// Facts of the outputs, which are voltages here whatever they are.
#[derive(Debug, Clone)]
pub(super) struct Leak {
    /// Time constants of the high-pass, s, and of the low-pass, zero without.
    pub high_pass: f64,
    pub low_pass: f64,
    /// Time between frames, s.
    pub period: f64,
    /// Standard deviation of one reading, V.
    pub deviation: f64,
    /// A force that matters, N, and its voltage in the band, of each element.
    pub matters: Vec<[f64; 2]>,
}

/// Finds when an output shows its offset.
///
/// Long after the last change of force it is at its offset, whatever force is held. Sooner the
/// balance of charge shows the offset V₀: between two moments at which the force is the same,
/// ∫(V − V₀) dt = −τ ΔV, whatever came and went between them.
#[derive(Debug, Clone)]
pub(super) struct ChargeBalance {
    leak: Leak,
    /// Time constant of the average that stands for the output at one moment, s, and the
    /// variance of that average, V².
    average: f64,
    noise: f64,
    /// Time over which it shows whether a force stands still, s.
    lag: f64,
    pace: Pace,
    elements: Vec<Element>,
}

/// Time since the frame before, s, and weights of a frame in the averages for that time.
#[derive(Debug, Clone, Copy, Default)]
struct Pace {
    elapsed: f64,
    average: f64,
    long: f64,
}

/// What an element shows in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shown {
    /// Its force may be changing.
    Nothing,
    /// Its output has faded to the offset.
    Faded,
    /// The force is what it was at an earlier moment.
    Same {
        /// The offset by the balance of charge since then, V, once the output has come near
        /// enough to what it was for that.
        offset: Option<f64>,
        /// Where that is the force at rest, as it was estimated, N, and how long ago, s.
        rest: Option<[f64; 2]>,
    },
}

#[derive(Debug, Clone, Default)]
struct Element {
    /// The output averaged over the time constant of the leak; none before the first reading.
    long: Option<f64>,
    /// For how long the output has not differed from it, s.
    faded: f64,
    now: Moment,
    /// Largest force since it was last at rest, N.
    most: f64,
    /// Three earlier moments, the newest first, each half a lag before the next.
    earlier: [Option<Moment>; 3],
    /// Moments at which the force stood still before it changed, the newest first, each at
    /// another force ...
    references: [Option<Moment>; REFERENCES],
    /// ... and the one that will be the newest when it changes again.
    next: Option<Moment>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Moment {
    time: f64,
    /// Averaged output, V, its integral, V s, and the variance of that by what lies between
    /// frames.
    output: f64,
    charge: f64,
    between: f64,
    /// Average of the estimated forces, N, at the time `estimated`.
    force: f64,
    estimated: f64,
    /// True if nothing presses, as far as that was estimated.
    rest: bool,
}

/// An output fades while it is this many standard deviations from its average ...
const FADES: f64 = 6.0;
/// ... and for this many time constants after: of a range of 10⁴ deviations half of one is left.
const FADED: f64 = 10.0;
/// Moments that are remembered: at rest, and loads that were held since.
const REFERENCES: usize = 3;
/// Forces are the same that differ by no more than this many standard deviations.
const SAME: f64 = 4.0;
/// What the steps of a converter leave open about a mean of readings, in deviations of one: between steps the
/// noise is less than a third of one.
const STEPS: f64 = 0.25;
/// What the time constant of the high-pass is not known by, as a share of it.
pub(super) const LEAK: f64 = 0.02;
/// An offset is measured where the time constant leaves open no more than this many deviations of a reading.
const BIAS: f64 = 0.5;
/// A moment is remembered for a force that is known to this share of what matters.
const CLOSE: f64 = 0.5;
/// A force that came down to this share of its most has gone.
const GONE: f64 = 0.05;
/// The average over this share of the time constant stands for an output.
const AVERAGE: f64 = 1.0 / 16.0;
/// A change has passed the average and the low-pass after so many of their time constants.
const PASSED: f64 = 8.0;

impl ChargeBalance {
    pub(super) fn new(leak: Leak) -> Self {
        let average = (AVERAGE * leak.high_pass).max(2.0 * leak.period);
        Self {
            average,
            noise: leak.deviation.powi(2) * 0.5 * leak.period / average,
            lag: PASSED * average.max(leak.low_pass),
            pace: Pace::default(),
            elements: vec![Element::default(); leak.matters.len()],
            leak,
        }
    }

    /// Begins anew.
    pub(super) fn forget(&mut self) {
        self.elements.fill(Element::default());
    }

    /// A frame begins, `elapsed` seconds after the one before.
    pub(super) fn begin(&mut self, elapsed: f64) {
        let slowest = self.leak.high_pass.max(self.leak.low_pass);
        let weight = |time: f64| -(-elapsed / time).exp_m1();
        self.pace = Pace {
            elapsed,
            average: weight(self.average),
            long: weight(slowest),
        };
    }

    /// Takes the output of an element in the frame that has begun, V: `None` where
    /// it is clipped or missing, or frames are. Of its offset the value and the variance are
    /// known so far; `force` is what was estimated of this frame, N.
    pub(super) fn push(
        &mut self,
        index: usize,
        output: Option<f64>,
        [offset, variance]: [f64; 2],
        force: f64,
    ) -> Shown {
        let (pace, deviation) = (self.pace, self.leak.deviation);
        let element = &mut self.elements[index];
        let Some(output) = output else {
            *element = Element {
                long: element.long,
                ..Element::default()
            };
            return Shown::Nothing;
        };
        let matters = self.leak.matters[index];
        element.fade(output, &pace, FADES * deviation);
        element.advance([output, force], &pace, matters[0]);
        element.keep(0.5 * self.lag);
        let known = Offset {
            value: offset,
            variance: variance + (STEPS * deviation).powi(2),
            bias: BIAS * deviation,
            noise: self.noise,
            time: self.leak.high_pass,
        };
        let stood = |earlier: &Moment| known.same(earlier, &element.now, f64::INFINITY);
        let stands = element.earlier[2].filter(|earlier| stood(earlier) == Some(true));
        let faded = element.faded >= FADED * self.leak.high_pass;
        if faded {
            let stood = element.earlier[2].map(|moment| Moment {
                rest: element.rests(&moment, &known, matters[1]),
                ..moment
            });
            if stood.is_some_and(|moment| moment.rest) {
                element.most = 0.0;
            }
            element.next = stood;
            return Shown::Faded;
        }
        let shown = stands.map(|stands| element.returned(&stands, &known, matters));
        let shown = shown.unwrap_or(Shown::Nothing);
        if shown == Shown::Nothing
            && let Some(next) = element.next.take()
        {
            element.remember(next, &known);
        }
        shown
    }
}

/// The offset as far as it is known, and what else a change of force is found by.
struct Offset {
    value: f64,
    variance: f64,
    /// What a measured offset may be off by, V.
    bias: f64,
    noise: f64,
    time: f64,
}

impl Offset {
    /// Variance of a change of force between two moments by noise and by the offset, V².
    fn variance(&self, from: &Moment, to: &Moment) -> f64 {
        let times = (to.time - from.time) / self.time;
        let between = (to.between - from.between) / (self.time * self.time);
        2.0 * self.noise + between + times * times * self.variance
    }

    /// Variance of what the time constant is not known by, V².
    fn leak(from: &Moment, to: &Moment) -> f64 {
        (LEAK * (to.output - from.output)).powi(2)
    }

    /// True if the forces at two moments are the same; `None` if they may have changed by as much
    /// as `matters`, V, meanwhile without it showing.
    fn same(&self, from: &Moment, to: &Moment, matters: f64) -> Option<bool> {
        let variance = self.variance(from, to);
        let through = to.charge - from.charge - (to.time - from.time) * self.value;
        let change = to.output - from.output + through / self.time;
        let doubt = SAME * (variance + Self::leak(from, to)).sqrt();
        let tells = SAME * variance.sqrt() < matters;
        tells.then_some(change.abs() <= doubt && doubt < matters)
    }
}

impl Element {
    fn fade(&mut self, output: f64, pace: &Pace, most: f64) {
        let long = self.long.get_or_insert(output);
        let off = output - *long;
        *long += pace.long * off;
        let fades = off.abs() > most;
        self.faded = if fades {
            0.0
        } else {
            self.faded + pace.elapsed
        };
    }

    /// Forces below `matters` are none.
    fn advance(&mut self, [output, force]: [f64; 2], pace: &Pace, matters: f64) {
        let now = &mut self.now;
        if self.earlier[0].is_none() {
            (now.output, now.force) = (output, force);
        }
        let last = now.output;
        now.output += pace.average * (output - last);
        now.force += pace.average * (force - now.force);
        now.time += pace.elapsed;
        now.charge += 0.5 * pace.elapsed * (last + now.output);
        now.between += ((now.output - last) * pace.elapsed).powi(2) / 12.0;
        now.estimated = now.time;
        now.rest = now.force.abs() < matters;
        self.most = self.most.max(now.force.abs());
    }

    /// Keeps moments that are `apart`, s.
    fn keep(&mut self, apart: f64) {
        let [newest, older, _] = self.earlier;
        if newest.is_none_or(|newest| self.now.time - newest.time >= apart) {
            self.earlier = [Some(self.now), newest, older];
        }
    }

    /// True if nothing presses: the force is the one at rest, or, where that is no longer
    /// known, none as it was estimated.
    fn rests(&self, moment: &Moment, known: &Offset, matters: f64) -> bool {
        let rest = self.references.iter().flatten().find(|one| one.rest);
        let back = rest.and_then(|rest| known.same(rest, moment, matters));
        back.unwrap_or(moment.rest)
    }

    /// What a force shows that has stood still since `stands`: whether it is back at one that
    /// is remembered.
    fn returned(&mut self, stands: &Moment, known: &Offset, [newtons, matters]: [f64; 2]) -> Shown {
        let gone = GONE * self.most / newtons * matters;
        let same = |one: &Moment| {
            let least = if one.rest { gone } else { 0.0 };
            known.same(one, &self.now, matters.max(least))
        };
        let references = || self.references.iter().flatten();
        let back = references().filter(|one| same(one) == Some(true));
        // Of several the one at rest.
        let back = back.max_by_key(|one| one.rest);
        let elsewhere = references().any(|one| same(one).is_some());
        let from = match back {
            Some(back) => *back,
            None if elsewhere => return Shown::Nothing,
            None => {
                // Nothing tells any more what the force was.
                self.references = [Some(*stands), None, None];
                *stands
            }
        };
        let age = self.now.time - from.time;
        let balance = self.now.charge - from.charge + known.time * (self.now.output - from.output);
        let to_what_matters = known.same(&from, &self.now, matters);
        let certain = to_what_matters.is_some();
        let leak = Offset::leak(&from, &self.now).sqrt();
        let balanced = certain && leak * known.time < known.bias * age;
        // A moment that is hardly known is none to come back to.
        let close = certain && SAME * Offset::leak(&from, stands).sqrt() < CLOSE * matters;
        self.next = close.then_some(Moment {
            force: from.force,
            estimated: from.estimated,
            rest: from.rest,
            ..*stands
        });
        // By its greatest force alone it may be near rest as yet.
        if from.rest && to_what_matters == Some(true) {
            self.most = 0.0;
        }
        Shown::Same {
            offset: balanced.then_some(balance / age),
            rest: from
                .rest
                .then_some([from.force, self.now.time - from.estimated]),
        }
    }

    /// Takes `moment` in the place of one at the same force, or of the oldest.
    fn remember(&mut self, moment: Moment, known: &Offset) {
        let same = |one: Moment| known.same(&one, &moment, f64::INFINITY) == Some(true);
        let replaced = |one: Moment| same(one) && (moment.rest || !one.rest);
        let references = &self.references;
        let old = references.iter().position(|one| one.is_none_or(replaced));
        // The one at rest stays.
        let other = |one: &Option<Moment>| one.is_some_and(|one| !one.rest);
        let old = old.or_else(|| references.iter().rposition(other));
        let old = old.unwrap_or(REFERENCES - 1);
        if moment.rest {
            // What was taken for rest before was a load that has gone.
            let others = self.references.iter_mut().flatten();
            others.for_each(|other| other.rest = false);
        }
        self.references[..=old].rotate_right(1);
        self.references[0] = Some(moment);
    }
}

#[cfg(test)]
mod tests;
