//! Which runs determine positions, and the map of the position.

use super::failed;
use super::presses::{Presses, SAME};
use super::readings::Run;
use crate::outcome::{ModelComparison, Outcome, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::training::{
    PositionOptions, Session, Split, TrainedPlace, for_the_next_run, train_place, trained_position,
};
use taxel::InputError;
use taxel::estimation::TrainedArea;
use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::{PlaceMap, PositionMap};

/// A run of fewer distinct places has none to learn.
const PLACES: usize = 9;
const MILLIMETRES: f64 = 1e3;

/// The map of the position, where runs determine one; with `rest`, of readings that are moved from the rest
/// of each run to that.
pub(super) fn train(
    runs: &[Run],
    area: &TrainedArea,
    rest: Option<&[f64]>,
    found: &mut Outcome,
) -> Result<(Option<PositionMap>, Option<PlaceMap>), InputError> {
    let placed = runs.iter().filter(|run| run.placed && has_places(run));
    let placed: Vec<&Run> = placed.collect();
    let Some(name) = placed.last().map(|run| run.name.as_str()) else {
        return Ok((None, None));
    };
    let mut presses = Presses::of(&placed, rest, &mut found.remarks);
    if presses.count() < PLACES {
        found.remarks.push(Remark::whole(format!(
            "place: {} presses show no place; at least {PLACES} all over the area are needed",
            presses.count()
        )));
        return Ok((None, None));
    }
    found.remarks.push(presses.move_to(area, name)?);
    let (splits, held, whole_runs) = presses.splits();
    let deep = presses.rows.by_force || !presses.one_depth();
    let candidates = candidates(deep, &presses, whole_runs);
    let failed = |error| failed(name, &error);
    let (mut map, tried) = trained_position(&presses.rows, &splits, &candidates).map_err(failed)?;
    let held_out = &tried.held_out;
    map.tared = rest.is_some();
    let options = &candidates[tried.best];
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
    let within = presses.last_of_each();
    let runs = whole_runs.then_some((held_out, &within));
    let wider = for_the_next_run(&mut map, &presses.rows, *options, runs, &presses.empty());
    found.remarks.push(for_which_run(
        placed.len(),
        whole_runs,
        wider.map_err(failed)?,
    ));
    found.held_out = String::from(held);
    report(&presses, &splits, &held_out.estimates(), found, &map);
    let place = match rest {
        Some(_) if whole_runs => mixture(&placed, &presses, held_out.score.rms, found),
        _ => None,
    };
    Ok((Some(map), place))
}

/// The mixture of maps, where held-out runs show that it says better than the surface, of `rms` m along an
/// axis, where something touches.
fn mixture(runs: &[&Run], presses: &Presses, rms: f64, found: &mut Outcome) -> Option<PlaceMap> {
    let sessions: Vec<Session> = runs.iter().map(|run| run.session.clone()).collect();
    // Too few readings make no mixture.
    let TrainedPlace { map, held_out } = train_place(&sessions, &presses.readings()).ok()?;
    let errors = held_out.iter().flat_map(|one| &one.errors);
    let (sum, count) = errors.fold((0.0, 0.0_f64), |(sum, count), e| (sum + e * e, count + 1.0));
    let own = (sum / count.max(1.0)).sqrt();
    let better = own < rms;
    found.remarks.push(Remark::whole(format!(
        "place: a mixture of maps of the pattern, of what changed lately and of the nearest presses has {:.3} mm rms along an \
         axis of held-out runs, the inverted surface {:.3} mm: {} says where a contact is",
        own * MILLIMETRES,
        rms * MILLIMETRES,
        if better { "the mixture" } else { "the surface" }
    )));
    if !better {
        return None;
    }
    for (name, one) in ["place.x, mixture", "place.y, mixture"]
        .into_iter()
        .zip(&held_out)
    {
        let [low, high] = map.axes[usize::from(name.starts_with("place.y"))].range;
        found.hold_out.push(ResidualSummary::of(
            name.into(),
            "m",
            &one.errors,
            high - low,
        ));
    }
    Some(map)
}

/// What the intervals are for.
fn for_which_run(runs: usize, whole_runs: bool, wider: f64) -> Remark {
    Remark::whole(if whole_runs {
        format!(
            "place: the held-out errors are those of whole runs by maps of the others; the intervals are for the next run, \
             {wider:.2} times as wide as for more of these {runs}"
        )
    } else {
        format!(
            "place: {} how runs differ, and the held-out errors hold for more of the same. The intervals are for the next run: \
             with a difference of 1 % in gain, as is usual, they are {wider:.2} times as wide as for more of the same",
            if runs == 1 {
                "one run does not show"
            } else {
                "runs that press at different places do not show"
            }
        )
    })
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

/// Surfaces that are tried: which presses of a run count less is not asked of several runs.
fn candidates(deep: bool, presses: &Presses, whole_runs: bool) -> Vec<PositionOptions> {
    let of_all = |options: &PositionOptions| {
        !whole_runs || (options.run_in == 0.0 && options.fading.is_infinite())
    };
    if !deep {
        return PositionOptions::of_one_depth()
            .into_iter()
            .filter(of_all)
            .collect();
    }
    // The force spreads the rows of each press over the depth: few presses have many.
    let by_force = presses.rows.by_force;
    let (spacings, smoothings): (&[f64], &[f64]) = match (by_force, presses.rows.on_a_grid()) {
        (true, false) => (&[0.25, 0.5, 1.0], &[1e-4, 1e-3, 1e-2]),
        (true, true) => (&[1.5, 2.0, 2.5], &[1e-4, 1e-3, 1e-2]),
        (false, _) => (&[1.5, 2.0, 2.5], &[0.03, 0.1, 0.3]),
    };
    let mut all = Vec::new();
    for run_in in [0.0, 0.5] {
        for spacing in spacings {
            for depths in [1, 2] {
                for smoothing in smoothings {
                    all.push(PositionOptions {
                        smoothing: *smoothing,
                        run_in,
                        spacing: *spacing,
                        depths,
                        ..PositionOptions::default()
                    });
                }
            }
        }
    }
    all.into_iter().filter(of_all).collect()
}

/// Residuals, ranges and figures.
fn report(
    presses: &Presses,
    splits: &[Split],
    estimates: &[[f64; 3]],
    found: &mut Outcome,
    map: &PositionMap,
) {
    let rows: Vec<usize> = splits.iter().flat_map(|split| split.test.clone()).collect();
    let truth: Vec<[f64; 3]> = rows.iter().map(|row| presses.rows.places[*row]).collect();
    let axes = if map.surface.is_deep() && !map.by_force {
        3
    } else {
        2
    };
    let names = [
        ("place.x", "surface, x"),
        ("place.y", "surface, y"),
        ("depth", "surface, depth"),
    ];
    for (axis, (name, model)) in names.into_iter().enumerate().take(axes) {
        let errors: Vec<f64> = estimates
            .iter()
            .zip(&truth)
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
        "{} presses in {} rows, {} channels in use",
        presses.count(),
        presses.rows.frames.len(),
        map.surface.width
    );
    let start = presses.times.iter().copied().fold(f64::INFINITY, f64::min);
    let chart = |axis: usize| {
        let points = |of: &[[f64; 3]]| {
            let times = rows.iter().map(|row| presses.times[*row]);
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
                Curve::new("truth", points(&truth), Style::Line),
                Curve::new("estimate", points(estimates), Style::Marks),
            ],
        }
    };
    found.figures.push(Figure {
        title: "Place of held-out presses".into(),
        charts: (0..axes).map(chart).collect(),
        caption: "Estimates of maps that were trained on other presses.".into(),
    });
}
