//! Maps from indentations at known positions: gains of the elements, and the best method
//! for the position of a contact, by indentations that it has not seen.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::PiezoelectricCalibrator;
use super::cross_validation::{CANDIDATES, Candidate, CrossValidation, FOLDS, Found, trusted};
use super::problem::Indentation;
use crate::loads::span;
use crate::outcome::{Outcome, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::training::Score;
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::trained::TrainingError;

/// Adds to `outcome` what `presses`, which are enough, teach.
///
/// # Errors
/// [`TrainingError`] where they span no area.
pub(super) fn learn(
    calibrator: &PiezoelectricCalibrator<'_>,
    presses: &[Indentation],
    outcome: &mut Outcome,
) -> Result<(), TrainingError> {
    let validation = CrossValidation::new(calibrator, presses)?;
    let parts = validation.parts();
    let distances_of_folds = validation.distances_of_folds(&parts)?;
    let held: Vec<Vec<Found>> = CANDIDATES
        .par_iter()
        .map(|candidate| validation.held_out(candidate, &parts, &distances_of_folds))
        .collect::<Result<_, _>>()?;
    // A probe of another size is what a map fails at: where there are several,
    // they decide.
    let several = parts.iter().any(|part| !part.radius_seen);
    let scores: Vec<Score> = held
        .iter()
        .map(|found| score(found.iter().filter(|one| one.radius_seen != several)))
        .collect();
    let likelihood = |place: &usize| scores[*place].log_likelihood;
    let mut order: Vec<usize> = (0..CANDIDATES.len()).collect();
    order.sort_by(|a, b| likelihood(b).total_cmp(&likelihood(a)));
    let best = order[0];
    let rank = |(rank, place): (usize, &usize)| {
        let name = CANDIDATES[*place].name;
        ranked(rank, name, &scores[*place], &held[*place])
    };
    outcome.remarks.extend(order.iter().enumerate().map(rank));
    outcome
        .remarks
        .push(used(&CANDIDATES[best], &validation.radii, several));
    let map = validation.map_without(&CANDIDATES[best], &vec![false; presses.len()]);
    let map = trusted(map, distances_of_folds.iter());
    if CANDIDATES[best].with_gains {
        let gains: Vec<String> = map.gains.iter().map(|gain| format!("{gain:.4}")).collect();
        let message = format!(
            "gains of the elements {}, +- {:.4}",
            gains.join(" "),
            map.gain_deviation
        );
        outcome.remarks.push(Remark::whole(message));
    }
    outcome.places = Some(map);
    outcome.hold_out.extend(summaries(presses, &held));
    outcome.scope.extend(scope(presses, &validation.radii));
    let figure = figure(presses, CANDIDATES[best].name, &held[best]);
    outcome.figures.push(figure);
    let before = if outcome.held_out.is_empty() {
        ""
    } else {
        "; "
    };
    let unseen = if several {
        ", then those of each radius"
    } else {
        ""
    };
    let _ = write!(
        outcome.held_out,
        "{before}presses: each {FOLDS}th in turn{unseen}"
    );
    Ok(())
}

fn score<'a>(found: impl Iterator<Item = &'a Found>) -> Score {
    let values = found.flat_map(|one| [0, 1].map(|axis| (one.error[axis], one.deviation[axis])));
    let (errors, deviations): (Vec<f64>, Vec<f64>) = values.unzip();
    Score::of(&errors, &deviations)
}

fn ranked(rank: usize, name: &str, score: &Score, found: &[Found]) -> Remark {
    let mut remark = format!(
        "positions, {}. by held-out likelihood: {name}, {:.3} mm rms, log likelihood {:.2}",
        rank + 1,
        // Of both coordinates together.
        1e3 * score.rms * 2.0_f64.sqrt(),
        score.log_likelihood - 1e3_f64.ln(),
    );
    for (seen, radii) in [(true, "of radii"), (false, "of a radius not")] {
        let such: Vec<&Found> = found.iter().filter(|one| one.radius_seen == seen).collect();
        let estimated: Vec<bool> = such.iter().filter_map(|one| one.inside).collect();
        if such.is_empty() {
            continue;
        }
        let share = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
        let inside = estimated.iter().filter(|inside| **inside).count();
        let learned = such.iter().filter(|one| one.learned).count();
        let _ = write!(
            remark,
            "; {radii} learned {:.1} % within their ellipses of 95 %",
            share(inside, estimated.len())
        );
        if learned > 0 && learned < such.len() {
            let _ = write!(
                remark,
                ", {:.0} % taken for known",
                share(learned, such.len())
            );
        }
        if estimated.len() < such.len() {
            let unknown = such.len() - estimated.len();
            let _ = write!(remark, ", no information in {unknown} of {}", such.len());
        }
    }
    Remark::whole(remark)
}

/// Method in use, and the contacts that it was judged for.
fn used(candidate: &Candidate, radii: &[f64], several: bool) -> Remark {
    let name = candidate.name;
    let in_words: Vec<String> = radii.iter().map(|a| format!("{:.2}", 1e3 * a)).collect();
    Remark::whole(match (radii, several) {
        ([], _) => format!(
            "positions are found by {name}, judged for the probe of these indentations alone; its size is not known"
        ),
        ([radius], _) => format!(
            "positions are found by {name}, judged for contacts of {:.2} mm radius alone",
            1e3 * radius
        ),
        (_, false) => format!(
            "positions are found by {name}, judged for contacts of {} mm radius",
            in_words.join(", ")
        ),
        (_, true) => format!(
            "positions are found by {name}, judged for contacts of a radius that the indentations did not have, beside those of {} mm",
            in_words.join(", ")
        ),
    })
}

/// Distances of the held-out presses from where they were found, for each
/// candidate and radius.
fn summaries(presses: &[Indentation], held: &[Vec<Found>]) -> Vec<ResidualSummary> {
    let mut summaries = Vec::new();
    for (candidate, found) in CANDIDATES.iter().zip(held) {
        for seen in [true, false] {
            let of = || found.iter().filter(move |one| one.radius_seen == seen);
            let mut radii: Vec<Option<f64>> = of().map(|one| presses[one.press].radius).collect();
            radii.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
            radii.dedup();
            for radius in radii {
                let such = of().filter(|one| presses[one.press].radius == radius);
                let distances: Vec<f64> = such.map(Found::distance).collect();
                let radius = radius.map_or(String::new(), |a| format!(".radius_{:.2}mm", 1e3 * a));
                let unseen = if seen { "" } else { "_not_trained" };
                let name = format!("place.{}{radius}{unseen}", candidate.name);
                summaries.push(ResidualSummary::of(name, "m", &distances, spread(presses)));
            }
        }
    }
    summaries
}

/// Length of the diagonal over all presses, m.
fn spread(presses: &[Indentation]) -> f64 {
    let along = |axis: usize| span(presses.iter().map(|press| press.place[axis]));
    along(0).hypot(along(1))
}

fn scope(presses: &[Indentation], radii: &[f64]) -> Vec<Scope> {
    let along = |axis: usize| presses.iter().map(move |press| press.place[axis]);
    let mut scope = vec![Scope::of("x", "m", along(0)), Scope::of("y", "m", along(1))];
    if !radii.is_empty() {
        scope.push(Scope::of("radius", "m", radii.iter().copied()));
    }
    scope
}

fn figure(presses: &[Indentation], name: &str, held: &[Found]) -> Figure {
    let mm = |place: [f64; 2]| place.map(|x| 1e3 * x);
    let seen = || held.iter().filter(|one| one.radius_seen);
    let truth = seen().map(|one| mm(presses[one.press].place));
    let found = seen().map(|one| {
        let at = presses[one.press].place;
        mm([at[0] + one.error[0], at[1] + one.error[1]])
    });
    Figure {
        title: "Places of held-out presses".into(),
        charts: vec![Chart {
            title: "Place".into(),
            x: Axis::new("x", "mm"),
            y: Axis::new("y", "mm"),
            series: vec![
                Series::new("pressed", truth.collect(), Style::Marks),
                Series::new(name, found.collect(), Style::Marks),
            ],
        }],
        caption: "Each press as found by what was learned from the others.".into(),
    }
}
