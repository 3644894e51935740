//! Channels that break in a recording: what they read teaches nothing.

use std::ops::Range;

use super::readings::Run;
use crate::remark::Remark;

/// A reading that stays the same for this long, s, while the others move, is stuck if a sound channel
/// would do so by less than this chance.
const STILL: f64 = 5.0;
const CHANCE: f64 = 1e-9;
/// The others move by this share of their range.
const MOVES: f64 = 0.2;
/// Share of the frames, and number of them in a row, in which a channel is cut off at its end.
const CUT_OFF: f64 = 0.02;
const IN_A_ROW: usize = 5;
/// Fewest frames on either side of a jump.
const FEWEST: usize = 25;
/// More channels than this share do not break alike in one recording: it is as it is.
const ALIKE: f64 = 1.0 / 3.0;

/// Leaves the channels that break in any run out of all of them, and says so; for each channel
/// whether it was. Channels have the names `names`.
pub(super) fn leave_out(
    runs: &mut [Run],
    names: &[String],
    remarks: &mut Vec<Remark>,
) -> Vec<bool> {
    let mut broken = vec![false; names.len()];
    for run in runs.iter() {
        for (channel, how) in Recorded::of(run).broken() {
            if let Some(name) = names.get(channel).filter(|_| !broken[channel]) {
                broken[channel] = true;
                remarks.push(Remark::whole(format!(
                    "{}: channel {} ({name}) {how}; it is left out of the maps, and its readings are not used live",
                    run.name,
                    channel + 1
                )));
            }
        }
    }
    if broken.contains(&true) {
        for run in runs {
            run.session.sensor.silence(&broken);
        }
    }
    broken
}

/// The frames of a run, channel by channel.
struct Recorded<'a> {
    times: &'a [f64],
    channels: Vec<Vec<f64>>,
    /// Largest less least reading of each channel.
    ranges: Vec<f64>,
}

impl<'a> Recorded<'a> {
    fn of(run: &'a Run) -> Self {
        let sensor = &run.session.sensor;
        let of = |channel: usize| sensor.rows().iter().map(|row| row[channel]).collect();
        let channels: Vec<Vec<f64>> = (0..sensor.width()).map(of).collect();
        Self {
            times: sensor.times(),
            ranges: channels.iter().map(|values| range(values)).collect(),
            channels,
        }
    }

    /// Channels that break, each with how it does.
    fn broken(&self) -> Vec<(usize, String)> {
        let kinds: [&dyn Fn(usize) -> Option<String>; 3] = [
            &|channel| self.stuck(channel),
            &|channel| self.jumps(channel),
            &|channel| self.cut_off(channel),
        ];
        let most = ((ALIKE * self.channels.len() as f64) as usize).max(1);
        let mut found = Vec::new();
        for kind in kinds {
            let moving = (0..self.channels.len()).filter(|channel| self.ranges[*channel] > 0.0);
            let alike: Vec<(usize, String)> = moving
                .filter_map(|channel| Some((channel, kind(channel)?)))
                .collect();
            if alike.len() <= most {
                found.extend(alike);
            }
        }
        found
    }

    /// Frames in a row of the same reading.
    fn stretches(&self, channel: usize) -> Vec<Range<usize>> {
        let mut end = 0;
        let same = self.channels[channel].chunk_by(|a, b| a == b);
        same.map(|stretch| {
            let begin = end;
            end += stretch.len();
            begin..end
        })
        .collect()
    }

    /// True if a quarter of the other channels move in a stretch of frames.
    fn others_move(&self, channel: usize, stretch: &Range<usize>) -> bool {
        let others = (0..self.channels.len()).filter(|other| *other != channel);
        let others: Vec<usize> = others.filter(|other| self.ranges[*other] > 0.0).collect();
        let moves = |other: &&usize| {
            range(&self.channels[**other][stretch.clone()]) > MOVES * self.ranges[**other]
        };
        let moving = others.iter().filter(moves).count();
        moving > 0 && 4 * moving >= others.len()
    }

    fn span(&self, frames: &Range<usize>) -> [f64; 2] {
        [self.times[frames.start], self.times[frames.end - 1]]
    }

    /// It stays at one reading though the others move.
    fn stuck(&self, channel: usize) -> Option<String> {
        let stretches = self.stretches(channel);
        let longest = stretches.iter().max_by_key(|stretch| stretch.len())?;
        let [begin, end] = self.span(longest);
        let others = stretches.iter().filter(|stretch| *stretch != longest);
        let (mut frames, mut repeats) = (1.0, 1.0);
        for stretch in others {
            frames += stretch.len() as f64;
            repeats += (stretch.len() - 1) as f64;
        }
        let same: f64 = repeats / (frames + 1.0);
        let chance = same.ln() * (longest.len() - 1) as f64;
        let stuck =
            end - begin >= STILL && chance < CHANCE.ln() && self.others_move(channel, longest);
        stuck.then(|| {
            let value = self.channels[channel][longest.start];
            format!("reads {value} from {begin:.2} s to {end:.2} s, while others move")
        })
    }

    /// It jumps between two ranges, farther apart than either is wide, while no other moves.
    fn jumps(&self, channel: usize) -> Option<String> {
        let values = &self.channels[channel];
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let gap = |at: &usize| sorted[*at] - sorted[*at - 1];
        let at = (1..sorted.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)))?;
        let (low, high) = sorted.split_at(at);
        if low.len().min(high.len()) < FEWEST || gap(&at) <= range(low).max(range(high)) {
            return None;
        }
        let above: Vec<bool> = values.iter().map(|value| *value >= high[0]).collect();
        let jumps: Vec<usize> = (1..above.len())
            .filter(|at| above[*at] != above[*at - 1])
            .collect();
        let alone = |at: &&usize| {
            let near = at.saturating_sub(2)..(**at + 2).min(values.len());
            !self.others_step(channel, &near)
        };
        let alone = jumps.iter().filter(alone).count();
        (2 * alone > jumps.len()).then(|| {
            let first = jumps[0];
            format!(
                "jumps by {:.3} at {:.2} s ({} in all), while no other moves",
                values[first] - values[first - 1],
                self.times[first],
                jumps.len()
            )
        })
    }

    /// True if any other channel moves within few frames.
    fn others_step(&self, channel: usize, frames: &Range<usize>) -> bool {
        let others = (0..self.channels.len()).filter(|other| *other != channel);
        let mut others = others.filter(|other| self.ranges[*other] > 0.0);
        others
            .any(|other| range(&self.channels[other][frames.clone()]) > MOVES * self.ranges[other])
    }

    /// It stays at its least or largest reading again and again while the others are far from theirs
    /// at rest.
    fn cut_off(&self, channel: usize) -> Option<String> {
        let values = &self.channels[channel];
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let stretches = self.stretches(channel);
        [low, high].into_iter().find_map(|end| {
            let cut =
                |stretch: &&Range<usize>| values[stretch.start] == end && stretch.len() >= IN_A_ROW;
            let cut: Vec<&Range<usize>> = stretches.iter().filter(cut).collect();
            let frames: usize = cut.iter().map(|stretch| stretch.len()).sum();
            if cut.len() < 2 || (frames as f64) < CUT_OFF * values.len() as f64 {
                return None;
            }
            let pressed = cut
                .iter()
                .filter(|stretch| self.pressed(channel, stretch))
                .count();
            (2 * pressed > cut.len()).then(|| {
                format!(
                    "is cut off at {end} in {frames} frames from {:.2} s on, while others go on",
                    self.times[cut[0].start]
                )
            })
        })
    }

    /// True if a quarter of the other channels are far from their first readings.
    fn pressed(&self, channel: usize, stretch: &Range<usize>) -> bool {
        let others = (0..self.channels.len()).filter(|other| *other != channel);
        let others: Vec<usize> = others.filter(|other| self.ranges[*other] > 0.0).collect();
        let middle = usize::midpoint(stretch.start, stretch.end);
        let far = |other: &&usize| {
            let values = &self.channels[**other];
            (values[middle] - values[0]).abs() > MOVES * self.ranges[**other]
        };
        let far = others.iter().filter(far).count();
        far > 0 && 4 * far >= others.len()
    }
}

/// Largest less least of values; what is missing does not count.
fn range(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(*value), high.max(*value))
    });
    (high - low).max(0.0)
}
