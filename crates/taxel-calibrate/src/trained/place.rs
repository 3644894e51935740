//! Which runs determine positions, and the map of the position.

use super::readings::Run;
use super::{compared, failed};
use crate::loads::{range, span};
use crate::outcome::{ModelComparison, Outcome, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::training::{Compared, HELD_OUT, PositionOptions, compared_places, trained_position};
use taxel::estimation::TrainedArea;
use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::PositionMap;
use taxel_recording::InputError;

/// A run of fewer distinct places has none to learn.
const PLACES: usize = 9;
/// Places this near are one, m.
const SAME: f64 = 1e-4;
/// A run of places is of one depth when its height changes by less than this
/// share of its way.
const ONE_DEPTH: f64 = 0.05;
/// Where forces show the depth, indentations above this share of the peak count.
const PRESSED: f64 = 0.5;
/// The last quarter is held out unless more than this share of it presses
/// beyond the rest, where nothing could predict it.
const BEYOND_REST: f64 = 0.1;
/// Presses may reach this much beyond the area, as a share of it.
const BEYOND: f64 = 0.05;
const MILLIMETRES: f64 = 1e3;

/// Frames with their places in the order of runs and time.
#[derive(Default)]
struct Presses {
    frames: Vec<Vec<f64>>,
    /// x, y and the depth, m.
    places: Vec<[f64; 3]>,
    times: Vec<f64>,
}

/// The map of the position, where runs determine one.
pub(super) fn train(
    runs: &[Run],
    area: &TrainedArea,
    found: &mut Outcome,
) -> Result<Option<PositionMap>, InputError> {
    let mut presses = Presses::default();
    let mut name = "";
    for run in runs.iter().filter(|run| run.placed && has_places(run)) {
        name = &run.name;
        presses.add(run);
    }
    if presses.frames.is_empty() {
        return Ok(None);
    }
    found.remarks.push(presses.move_to(area, name)?);
    let in_time = presses.last_within_rest();
    if !in_time {
        presses.every_fourth_last();
    }
    let deep = !presses.one_depth();
    let candidates = candidates(deep);
    let failed = |error| failed(name, &error);
    let (map, tried, best) =
        trained_position(&presses.frames, &presses.places, &candidates).map_err(failed)?;
    let held_out = &tried[best];
    let mut all = compared_places(&presses.frames, &presses.places).map_err(failed)?;
    all.push(Compared {
        name: String::from(SURFACE),
        score: held_out.score,
    });
    found.remarks.push(why(&all));
    found
        .remarks
        .extend(compared("place", all, "mm along an axis", MILLIMETRES));
    let options = &candidates[best];
    found.remarks.push(Remark::whole(format!(
        "place: surface of {} x {}{} intervals, smoothing {}, without the first {:.0} % of the presses{}; best of {} by the \
         likelihood of held-out presses",
        map.surface.intervals[0],
        map.surface.intervals[1],
        if deep {
            format!(" x {}", map.surface.intervals[2])
        } else {
            String::new()
        },
        options.smoothing,
        100.0 * options.run_in,
        if options.fading.is_finite() {
            format!(
                ", whose weight falls to 1/e over {:.0} % of them back in time",
                100.0 * options.fading
            )
        } else {
            String::new()
        },
        candidates.len()
    )));
    if let Some(depth) = held_out.depth_score {
        found.remarks.push(Remark::whole(format!(
            "depth: the z of the recordings, {:.3} mm rms, {:.1} % within the 95 % intervals",
            depth.rms * MILLIMETRES,
            100.0 * depth.coverage
        )));
    }
    found.held_out = String::from(if in_time {
        "the last 25 % of the presses in time"
    } else {
        "every fourth press, since the last 25 % in time press where none did before"
    });
    report(&presses, &held_out.estimates, found, &map);
    Ok(Some(map))
}

fn has_places(run: &Run) -> bool {
    let mut places: Vec<[i64; 2]> = run
        .session
        .place
        .rows()
        .iter()
        .map(|row| [row[0], row[1]].map(|x| (x / SAME).round() as i64))
        .collect();
    places.sort_unstable();
    places.dedup();
    places.len() >= PLACES
}

/// Name of the map that is kept.
const SURFACE: &str = "inverted surface";

/// Surfaces that are tried.
fn candidates(deep: bool) -> Vec<PositionOptions> {
    let mut all = Vec::new();
    if !deep {
        return PositionOptions::of_one_depth();
    }
    for run_in in [0.0, 0.5] {
        for spacing in [1.5, 2.0, 2.5] {
            for depths in [1, 2] {
                for smoothing in [0.03, 0.1, 0.3] {
                    all.push(PositionOptions {
                        smoothing,
                        run_in,
                        spacing,
                        depths,
                        ..PositionOptions::default()
                    });
                }
            }
        }
    }
    all
}

/// Why the surface is kept, or what would have been better.
fn why(all: &[Compared]) -> Remark {
    let likelihood = |one: &&Compared| one.score.log_likelihood;
    let others = all.iter().filter(|one| one.name != SURFACE);
    let other = others.max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)));
    let surface = all.iter().find(|one| one.name == SURFACE);
    let Some((surface, other)) = surface.zip(other) else {
        return Remark::whole("place: the inverted surface is the only map");
    };
    let gain = surface.score.log_likelihood - other.score.log_likelihood;
    Remark::whole(if gain >= 0.0 {
        format!(
            "place: the inverted surface is kept: a held-out coordinate is {:.1} times as likely under it as under the next, \
             {}",
            gain.exp(),
            other.name
        )
    } else {
        format!(
            "place: the inverted surface is kept although {} predicts these rows better ({:.1} times as likely), because it \
             alone recognises frames unlike all indentations; more indentations help it most",
            other.name,
            (-gain).exp()
        )
    })
}

impl Presses {
    fn add(&mut self, run: &Run) {
        let session = &run.session;
        let reach = session.sensor.longest_step();
        let least = PRESSED * session.peak_force();
        let pressed = |time: f64| match &session.force {
            Some(force) => force.at(time, reach).is_some_and(|f| f[0] > least),
            None => true,
        };
        for (time, row) in session.place.times().iter().zip(session.place.rows()) {
            if let Some(frame) = session.sensor.at(*time, reach).filter(|_| pressed(*time)) {
                self.frames.push(frame);
                self.places.push([row[0], row[1], row[2]]);
                self.times.push(*time);
            }
        }
    }

    /// True if the depth of the presses changes by less than a share of their way.
    fn one_depth(&self) -> bool {
        let [x, y, z] = [0, 1, 2].map(|axis| span(self.places.iter().map(|place| place[axis])));
        z <= ONE_DEPTH * x.max(y)
    }

    /// True if the presses that are held out in time lie among those before.
    fn last_within_rest(&self) -> bool {
        let begin = ((1.0 - HELD_OUT) * self.places.len() as f64) as usize;
        let (rest, last) = self.places.split_at(begin);
        let ends = [0, 1].map(|axis| ends(rest, axis));
        let beyond = |place: &&[f64; 3]| {
            (0..2).any(|axis| {
                let [low, high] = ends[axis];
                place[axis] < low - SAME || place[axis] > high + SAME
            })
        };
        last.iter().filter(beyond).count() as f64 <= BEYOND_REST * last.len() as f64
    }

    /// Moves every fourth press to the end, where it is held out.
    fn every_fourth_last(&mut self) {
        let of_time = 0..self.places.len();
        let (last, first): (Vec<usize>, Vec<usize>) = of_time.partition(|row| row % 4 == 3);
        let order = [first, last].concat();
        self.frames = order.iter().map(|row| self.frames[*row].clone()).collect();
        self.places = order.iter().map(|row| self.places[*row]).collect();
        self.times = order.iter().map(|row| self.times[*row]).collect();
    }

    /// Brings places of the stage onto the area: as they are where all lie on
    /// it, else with the middle of the presses in its middle.
    fn move_to(&mut self, area: &TrainedArea, name: &str) -> Result<Remark, InputError> {
        let half = area.half_sides();
        let ends = [0, 1].map(|axis| ends(&self.places, axis));
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
        for place in &mut self.places {
            *place = [place[0] - middle[0], place[1] - middle[1], place[2]];
        }
        Ok(Remark::whole(format!(
            "place: the middle of the presses, x = {:.3} mm and y = {:.3} mm of the stage, is taken as the middle of the area",
            middle[0] * MILLIMETRES,
            middle[1] * MILLIMETRES
        )))
    }
}

/// Least and largest coordinate.
fn ends(places: &[[f64; 3]], axis: usize) -> [f64; 2] {
    range(places.iter().map(|place| place[axis]))
}

/// Residuals, ranges and figures.
fn report(presses: &Presses, estimates: &[[f64; 3]], found: &mut Outcome, map: &PositionMap) {
    let begin = presses.places.len() - estimates.len();
    let truth = &presses.places[begin..];
    let axes = if map.surface.is_deep() { 3 } else { 2 };
    let names = [
        ("place.x", "surface, x"),
        ("place.y", "surface, y"),
        ("depth", "surface, depth"),
    ];
    for (axis, (name, model)) in names.into_iter().enumerate().take(axes) {
        let errors: Vec<f64> = estimates
            .iter()
            .zip(truth)
            .map(|(e, t)| e[axis] - t[axis])
            .collect();
        let [low, high] = map.surface.range(axis);
        let summary = ResidualSummary::of(name.into(), "m", &errors, high - low);
        found.models.push(ModelComparison {
            name: model,
            about: "place where the fitted answer of all channels is nearest to the frame",
            unknowns: map.surface.unknowns() * map.surface.width,
            residual: summary.root_mean_square / (high - low),
            hold_out: Some(summary.root_mean_square / (high - low)),
        });
        found.hold_out.push(summary);
        found.scope.push(Scope {
            name: name.into(),
            unit: "m",
            range: [low, high],
        });
    }
    found.search = format!(
        "{} presses, {} channels in use",
        presses.places.len(),
        map.surface.width
    );
    let start = presses.times.iter().copied().fold(f64::INFINITY, f64::min);
    let chart = |axis: usize| {
        let points = |of: &[[f64; 3]]| {
            let times = presses.times[begin..].iter();
            times
                .zip(of)
                .map(|(t, p)| [t - start, p[axis] * MILLIMETRES])
                .collect()
        };
        Chart {
            title: String::new(),
            x: Axis::new("time", "s"),
            y: Axis::new(["x", "y", "depth"][axis], "mm"),
            series: vec![
                Curve::new("truth", points(truth), Style::Line),
                Curve::new("estimate", points(estimates), Style::Marks),
            ],
        }
    };
    found.figures.push(Figure {
        title: "Place of held-out presses".into(),
        charts: (0..axes).map(chart).collect(),
        caption: "Estimates of a map that was trained on the other presses.".into(),
    });
}
