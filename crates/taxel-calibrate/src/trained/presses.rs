//! The presses of runs: which rows of a recording belong to one indentation, and which touch nothing.

use super::readings::Run;
use crate::loads::{range, span};
use crate::remark::Remark;
use crate::training::{CONTACT_SHARE, PlacedRows, Session, Split};
use taxel::InputError;
use taxel::estimation::TrainedArea;

/// Places this near are one, m.
pub(super) const SAME: f64 = 1e-4;
/// Runs of places are of one depth when their height changes by less than this
/// share of their way.
const ONE_DEPTH: f64 = 0.05;
/// Presses are of one force when the least is above this share of the largest.
const ONE_FORCE: f64 = 0.8;
/// Readings that differ by less than this share of the deviation of their channels are alike.
const ALIKE: f64 = 0.15;
/// Rows that are looked at as those of the empty body.
const TRIED: usize = 200;
/// Without a force, rows count whose readings are farther from rest than this share of the farthest of
/// their stay: at any depth, or at the one depth of presses whose depth is not recorded.
const PRESSED: [f64; 2] = [0.15, 0.5];
/// Rows that all presses keep together, and each at least and at most.
const ROWS: usize = 4000;
const ROWS_EACH: [usize; 2] = [4, 20];
/// Fewer presses than this are held out in fourths, as a quarter of them says too little.
const FEW: usize = 100;
/// The last quarter, or a run, is held out unless more than this share of it presses
/// beyond the rest, where nothing could predict it.
const BEYOND_REST: f64 = 0.1;
/// Presses may reach this much beyond the area, or beyond others, as a share of it.
const BEYOND: f64 = 0.05;
const MILLIMETRES: f64 = 1e3;

/// Presses of all runs.
#[derive(Default)]
pub(super) struct Presses {
    pub(super) rows: PlacedRows,
    pub(super) times: Vec<f64>,
    /// Number of the run of each row.
    runs: Vec<usize>,
    /// Readings of the empty body of the last run that shows them.
    pub(super) rest: Option<Vec<f64>>,
}

/// What shows that something touches.
enum Contact {
    /// A force above this, N.
    Force(f64),
    /// Readings away from those at rest.
    Signal,
    /// Nothing: all rows are presses.
    Always,
}

impl Presses {
    /// Those of the runs, with what is said of each; with `rest` the readings of each are moved from its own
    /// rest to that.
    pub(super) fn of(runs: &[&Run], rest: Option<&[f64]>, remarks: &mut Vec<Remark>) -> Self {
        let mut all = Self::default();
        let places = || runs.iter().flat_map(|run| run.session.place.rows());
        let along = |axis: usize| span(places().map(|row| row[axis]));
        let by_height = along(2) > ONE_DEPTH * along(0).max(along(1));
        for run in runs {
            remarks.push(all.add(run, by_height, rest));
        }
        if by_height {
            return all;
        }
        let weighed = runs.iter().all(|run| run.session.force.is_some());
        let [least, most] = range(all.rows.places.iter().map(|place| place[2]));
        all.rows.by_force = weighed && least < ONE_FORCE * most;
        if !all.rows.by_force {
            all.rows.places.iter_mut().for_each(|place| place[2] = 0.0);
        }
        all
    }

    /// Adds the presses of a run; the third of their places is the height, or the force.
    fn add(&mut self, run: &Run, by_height: bool, rest: Option<&[f64]>) -> Remark {
        let session = &run.session;
        let reach = session.sensor.longest_step();
        let places = session.place.times().iter().zip(session.place.rows());
        let force_at = |time: f64| Some(session.force.as_ref()?.at(time, reach)?[0]);
        let own = session.baseline();
        let moved = |frame: &mut [f64]| {
            for ((value, own), rest) in frame.iter_mut().zip(&own).zip(rest.into_iter().flatten()) {
                *value += rest - own;
            }
        };
        let read = places.filter_map(|(time, place)| {
            let mut frame = session.sensor.at(*time, reach)?;
            moved(&mut frame);
            Some((*time, frame, place, force_at(*time)))
        });
        let read: Vec<_> = read.collect();
        let stays = stays(read.iter().map(|(_, _, place, _)| [place[0], place[1]]));
        let frames: Vec<&Vec<f64>> = read.iter().map(|(_, frame, ..)| frame).collect();
        let empty = match &session.force {
            Some(_) => {
                let mut empty = own.clone();
                moved(&mut empty);
                Some(empty)
            }
            None => Rest::of(&frames, &stays).map(|rest| rest.mean.clone()),
        };
        let (contact, touches) = contacts(session, &frames, &stays, by_height, |row| read[row].3);
        let mut presses: Vec<Vec<usize>> = Vec::new();
        for (row, touches) in touches.iter().enumerate() {
            if !touches {
                continue;
            }
            match presses.last_mut() {
                Some(rows) if rows.last() == Some(&(row - 1)) && stays[row] == stays[row - 1] => {
                    rows.push(row);
                }
                _ => presses.push(vec![row]),
            }
        }
        let number = self.runs.last().map_or(0, |run| run + 1);
        let first = self.rows.presses.last().map_or(0, |press| press + 1);
        let each = (ROWS / presses.len().max(1)).clamp(ROWS_EACH[0], ROWS_EACH[1]);
        for (press, rows) in presses.iter().enumerate() {
            for row in thinned(rows, each) {
                let (time, frame, place, force) = &read[row];
                let third = if by_height {
                    place[2]
                } else {
                    force.unwrap_or(0.0)
                };
                self.rows.frames.push(frame.clone());
                self.rows.places.push([place[0], place[1], third]);
                self.rows.presses.push(first + press);
                self.times.push(*time);
                self.runs.push(number);
            }
        }
        let touching = touches.iter().filter(|touches| **touches).count();
        self.rest = empty.or_else(|| self.rest.take());
        said(&run.name, presses.len(), [touching, read.len()], &contact)
    }

    /// Times, s, and places of the rows of each run.
    pub(super) fn readings(&self) -> Vec<Vec<(f64, [f64; 2])>> {
        let count = self.runs.last().map_or(0, |run| run + 1);
        let mut all = vec![Vec::new(); count];
        let rows = self.runs.iter().zip(&self.times).zip(&self.rows.places);
        for ((run, time), place) in rows {
            all[*run].push((*time, [place[0], place[1]]));
        }
        all
    }

    /// Number of presses.
    pub(super) fn count(&self) -> usize {
        self.rows.of_presses().len()
    }

    /// Readings at rest; their mean where no run shows them.
    pub(super) fn empty(&self) -> Vec<f64> {
        if let Some(rest) = &self.rest {
            return rest.clone();
        }
        let frames = &self.rows.frames;
        let mean = |channel: usize| {
            frames.iter().map(|row| row[channel]).sum::<f64>() / frames.len() as f64
        };
        (0..frames.first().map_or(0, Vec::len)).map(mean).collect()
    }

    /// True if the presses are of one depth, and of one force where that tells them apart.
    pub(super) fn one_depth(&self) -> bool {
        let [x, y, z] =
            [0, 1, 2].map(|axis| span(self.rows.places.iter().map(|place| place[axis])));
        !self.rows.by_force && z <= ONE_DEPTH * x.max(y)
    }

    /// What is held out, and its name; with true for whole runs.
    pub(super) fn splits(&self) -> (Vec<Split>, &'static str, bool) {
        let rows = self.rows.frames.len();
        let runs = self.runs.last().map_or(0, |run| run + 1);
        let by = |test: &dyn Fn(usize) -> bool| {
            let (test, train) = (0..rows).partition(|row| test(*row));
            Split { train, test }
        };
        let whole: Vec<Split> = (0..runs)
            .map(|run| by(&|row| self.runs[row] == run))
            .collect();
        let last = Split::last(&self.rows.of_presses(), rows);
        if runs > 1 && whole.iter().all(|split| self.is_within_rest(split)) {
            return (whole, "each run in turn, by a map of the others", true);
        }
        let within = self.is_within_rest(&last);
        if within && self.count() >= FEW {
            return (vec![last], "the last 25 % of the presses in time", false);
        }
        let fourth = |k: usize| by(&|row| self.rows.presses[row] % 4 == k);
        let fourths = (0..4).map(fourth).collect();
        let why = if within {
            "every fourth press in turn, since there are few"
        } else {
            "every fourth press in turn, since the last 25 % in time, or a run, press where none else does"
        };
        (fourths, why, false)
    }

    /// The last quarter of the presses of every run.
    pub(super) fn last_of_each(&self) -> Split {
        let presses = self.rows.of_presses();
        let mut all = Split::default();
        let of_runs = presses.chunk_by(|a, b| self.runs[a.start] == self.runs[b.start]);
        for run in of_runs {
            let begin = run.first().map_or(0, |press| press.start);
            let end = run.last().map_or(begin, |press| press.end);
            let split = Split::last(
                &run.iter()
                    .map(|press| press.start - begin..press.end - begin)
                    .collect::<Vec<_>>(),
                end - begin,
            );
            all.train
                .extend(split.train.into_iter().map(|row| begin + row));
            all.test
                .extend(split.test.into_iter().map(|row| begin + row));
        }
        all
    }

    /// True if the presses that are held out lie among the others.
    fn is_within_rest(&self, split: &Split) -> bool {
        let ends =
            [0, 1].map(|axis| range(split.train.iter().map(|row| self.rows.places[*row][axis])));
        let beyond = |row: &&usize| {
            (0..2).any(|axis| {
                let [low, high] = ends[axis];
                let margin = BEYOND * (high - low);
                let at = self.rows.places[**row][axis];
                at < low - margin || at > high + margin
            })
        };
        split.test.iter().filter(beyond).count() as f64 <= BEYOND_REST * split.test.len() as f64
    }

    /// Brings places of the stage onto the area: as they are where all lie on
    /// it, else with the middle of the presses in its middle.
    pub(super) fn move_to(&mut self, area: &TrainedArea, name: &str) -> Result<Remark, InputError> {
        let half = area.half_sides();
        let ends = [0, 1].map(|axis| range(self.rows.places.iter().map(|place| place[axis])));
        let inside = |axis: usize| {
            let most = half[axis] * (1.0 + BEYOND);
            ends[axis].iter().all(|end| end.abs() <= most)
        };
        if inside(0) && inside(1) {
            return Ok(Remark::whole(
                "place: x and y count from the middle of the area, as given",
            ));
        }
        let middle = ends.map(|[low, high]| 0.5 * (low + high));
        for axis in 0..2 {
            let span = ends[axis][1] - ends[axis][0];
            if span > 2.0 * half[axis] * (1.0 + BEYOND) {
                let message = format!(
                    "the presses span {:.2} mm, the area of the sensor file has {:.2} mm",
                    span * MILLIMETRES,
                    2.0 * half[axis] * MILLIMETRES
                );
                return Err(InputError::whole(name, message)
                    .key(["x", "y"][axis])
                    .help("check the unit, or give the sensor file more rows or columns"));
            }
        }
        for place in &mut self.rows.places {
            *place = [place[0] - middle[0], place[1] - middle[1], place[2]];
        }
        Ok(Remark::whole(format!(
            "place: the middle of the presses, x = {:.3} mm and y = {:.3} mm of the stage, is taken as the middle of the area",
            middle[0] * MILLIMETRES,
            middle[1] * MILLIMETRES
        )))
    }
}

/// Number of the stay of each row: a new one begins where the probe comes elsewhere.
fn stays(places: impl Iterator<Item = [f64; 2]>) -> Vec<usize> {
    let mut all = Vec::new();
    let mut begin = [f64::NAN; 2];
    let mut number = 0;
    for place in places {
        let stays = (0..2).all(|axis| (place[axis] - begin[axis]).abs() <= SAME);
        if !stays {
            begin = place;
            number += usize::from(!all.is_empty());
        }
        all.push(number);
    }
    all
}

/// Which rows touch, and what shows it.
fn contacts(
    session: &Session,
    frames: &[&Vec<f64>],
    stays: &[usize],
    by_height: bool,
    force: impl Fn(usize) -> Option<f64>,
) -> (Contact, Vec<bool>) {
    let rows = 0..frames.len();
    if session.force.is_some() {
        let least = CONTACT_SHARE * session.peak_force();
        let touches = |row: usize| force(row).is_some_and(|force| force > least);
        return (Contact::Force(least), rows.map(touches).collect());
    }
    let Some(rest) = Rest::of(frames, stays) else {
        return (Contact::Always, vec![true; frames.len()]);
    };
    let away: Vec<f64> = frames.iter().map(|frame| rest.distance(frame)).collect();
    let mut farthest = vec![0.0_f64; stays.last().map_or(0, |stay| stay + 1)];
    for (away, stay) in away.iter().zip(stays) {
        farthest[*stay] = farthest[*stay].max(*away);
    }
    let share = PRESSED[usize::from(!by_height)];
    let touches = |row: usize| {
        let farthest = farthest[stays[row]];
        farthest > 2.0 * ALIKE && away[row] > share * farthest
    };
    (Contact::Signal, rows.map(touches).collect())
}

/// Some of the rows, evenly.
fn thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (0..count)
        .map(|k| rows[(2 * k + 1) * rows.len() / (2 * count)])
        .collect()
}

/// The empty body.
struct Rest {
    mean: Vec<f64>,
    /// Deviation of each channel over all rows.
    scale: Vec<f64>,
}

impl Rest {
    /// The readings that most places share: those of a press depend on the place. `None` unless half of
    /// the stays have them, as of recordings with pressed rows alone.
    fn of(frames: &[&Vec<f64>], stays: &[usize]) -> Option<Self> {
        let count = stays.last()? + 1;
        if frames.len() < 2 * count {
            return None;
        }
        let rows = frames.len() as f64;
        let mean =
            |of: &dyn Fn(&Vec<f64>) -> f64| frames.iter().map(|row| of(row)).sum::<f64>() / rows;
        let scale = (0..frames[0].len()).map(|channel| {
            let middle = mean(&|row| row[channel]);
            mean(&|row| (row[channel] - middle).powi(2)).sqrt()
        });
        let scale: Vec<f64> = scale.collect();
        let of = |row: usize| Self {
            mean: frames[row].clone(),
            scale: scale.clone(),
        };
        let alike = |rest: &Self| -> Vec<usize> {
            (0..frames.len())
                .filter(|row| rest.distance(frames[*row]) < ALIKE)
                .collect()
        };
        let shared = |rows: &[usize]| rows.chunk_by(|a, b| stays[*a] == stays[*b]).count();
        let tried = (0..frames.len()).step_by(frames.len().div_ceil(TRIED));
        let best = tried
            .map(|row| alike(&of(row)))
            .max_by_key(|rows| shared(rows))?;
        if 2 * shared(&best) < count || count < 3 {
            return None;
        }
        let mean = |channel: usize| {
            best.iter().map(|row| frames[*row][channel]).sum::<f64>() / best.len() as f64
        };
        Some(Self {
            mean: (0..scale.len()).map(mean).collect(),
            scale,
        })
    }

    /// Distance of readings over the deviations of the channels: root of the mean square.
    fn distance(&self, frame: &[f64]) -> f64 {
        let channels = frame.iter().zip(&self.mean).zip(&self.scale);
        let terms = channels.filter(|(_, scale)| **scale > 0.0);
        let (sum, count) = terms.fold((0.0, 0.0), |(sum, count), ((x, mean), scale)| {
            (sum + ((x - mean) / scale).powi(2), count + 1.0)
        });
        (sum / f64::max(count, 1.0)).sqrt()
    }
}

/// What is said of a run.
fn said(name: &str, presses: usize, [touching, rows]: [usize; 2], contact: &Contact) -> Remark {
    let without = rows - touching;
    let rest = match contact {
        Contact::Always => String::from("each row is of a press"),
        Contact::Force(least) => format!(
            "{without} with at most {least:.3} N, {:.0} % of its largest force, touch nothing and are left out",
            100.0 * CONTACT_SHARE
        ),
        Contact::Signal => format!(
            "{without} are left out, as their readings are at rest or on the way from there"
        ),
    };
    Remark::whole(format!(
        "place: {name} has {presses} presses in {touching} of {rows} rows; {rest}"
    ))
}
