//! Places of elements that tell the place of a contact best.

use rayon::prelude::*;
use taxel::InputError;
use taxel::device::{Device as _, PlaceInformation};
use taxel::information::RadiusKnowledge;
use taxel::predict::Loads;
use taxel::quantity::{FORCE, LENGTH};

use crate::answers::{cells, farthest};
use crate::file::{Criterion, PlaceFile, PlaceOf};
use crate::plans::{draw, seeded};
use crate::study::Study;

/// Subsets up to which all are tried.
const MOST_TRIED: u64 = 100_000;
/// Random starts of the exchange.
const STARTS: usize = 20;
/// Most candidates.
const MOST_CANDIDATES: usize = 400;

/// A choice of elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Indices of the candidates, rising: row by row from -x at +y.
    pub chosen: Vec<usize>,
    /// Root of the mean square of the deviation of the place, m.
    pub rms: f64,
    /// Greatest deviation, m.
    pub worst: f64,
    /// Mean of half the logarithm of the determinant of the covariance, m².
    pub half_log_det: f64,
}

/// Result of a placing.
#[derive(Debug, Clone, PartialEq)]
pub struct Placing {
    /// Candidate places, m from their middle.
    pub candidates: Vec<[f64; 2]>,
    /// Side of an element, m.
    pub side: f64,
    /// The best choices, the best first; empty where none has information everywhere.
    pub best: Vec<Choice>,
    /// Choices that were looked at.
    pub tried: usize,
    /// True if all were.
    pub exhaustive: bool,
}

/// Places `grid 5 x 3, 2.5 mm`, row by row from -x at +y, m.
fn grid(text: &str) -> Option<Vec<[f64; 2]>> {
    let rest = text.trim().strip_prefix("grid")?;
    let (counts, pitch) = rest.split_once(',')?;
    let (columns, rows) = counts.split_once('x')?;
    let [columns, rows] = [columns, rows].map(|text| text.trim().parse::<usize>().ok());
    let (columns, rows) = (columns?, rows?);
    let pitch = LENGTH
        .parse(pitch.trim())
        .ok()
        .filter(|pitch| *pitch > 0.0)?;
    if columns == 0 || rows == 0 || columns.checked_mul(rows)? > MOST_CANDIDATES {
        return None;
    }
    let middle = |count: usize| 0.5 * (count as f64 - 1.0);
    let place = |row: usize, column: usize| {
        [
            (column as f64 - middle(columns)) * pitch,
            (middle(rows) - row as f64) * pitch,
        ]
    };
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    Some(all.map(|(row, column)| place(row, column)).collect())
}

/// Slopes of one candidate for one contact, over the noise.
type Slopes = [f64; 3];

/// Covariance of the place for a subset at one contact: xx, xy, yy; none where it is singular.
fn covariance(slopes: &[Slopes], chosen: &[usize]) -> Option<[f64; 3]> {
    let (mut xx, mut xy, mut yy, mut xf, mut yf, mut ff) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for index in chosen {
        let [x, y, f] = slopes[*index];
        xx += x * x;
        xy += x * y;
        yy += y * y;
        xf += x * f;
        yf += y * f;
        ff += f * f;
    }
    if ff <= 0.0 {
        return None;
    }
    // The force is unknown beside the place: its Schur complement.
    let (a, b, c) = (xx - xf * xf / ff, xy - xf * yf / ff, yy - yf * yf / ff);
    let determinant = a * c - b * b;
    if !(a > 1e-11 * xx && c > 1e-11 * yy && determinant > 1e-11 * a * c) {
        return None;
    }
    Some([c / determinant, -b / determinant, a / determinant])
}

fn judged(slopes: &[Vec<Slopes>], chosen: &[usize]) -> Option<Choice> {
    let (mut square, mut worst, mut log) = (0.0, 0.0_f64, 0.0);
    for of_contact in slopes {
        let [xx, xy, yy] = covariance(of_contact, chosen)?;
        square += xx + yy;
        worst = worst.max(xx + yy);
        log += 0.5 * (xx * yy - xy * xy).ln();
    }
    let count = slopes.len() as f64;
    let mut chosen = chosen.to_vec();
    chosen.sort_unstable();
    Some(Choice {
        chosen,
        rms: (square / count).sqrt(),
        worst: worst.sqrt(),
        half_log_det: log / count,
    })
}

fn cost(choice: Option<&Choice>, criterion: Criterion) -> f64 {
    choice.map_or(f64::INFINITY, |choice| match criterion {
        Criterion::A => choice.rms,
        Criterion::D => choice.half_log_det,
    })
}

fn subsets(candidates: usize, count: usize) -> Option<u64> {
    (0..count as u64).try_fold(1u64, |all, k| {
        Some(all.checked_mul(candidates as u64 - k)? / (k + 1))
    })
}

/// The candidates that are asked for, or the mistake and what to do.
fn candidates_of(
    asked: &PlaceFile,
    array: Vec<[f64; 2]>,
) -> Result<Vec<[f64; 2]>, (String, &'static str)> {
    match (asked.of, &asked.candidates) {
        (PlaceOf::Channels, None) => Ok(array),
        (PlaceOf::Elements, Some(text)) => grid(text).ok_or_else(|| {
            let help = "such as grid 5 x 3, 2.5 mm, of at most 400 places";
            (format!("\"{text}\" is no grid of places"), help)
        }),
        (PlaceOf::Channels, Some(_)) => {
            let message = String::from("channels are those of the array");
            Err((message, "leave candidates out"))
        }
        (PlaceOf::Elements, None) => {
            let message = String::from("elements need candidates");
            Err((message, "such as grid 5 x 3, 2.5 mm"))
        }
    }
}

/// Chooses the places of `[place]`.
///
/// # Errors
/// A mistake in `[place]`, or a sensor that is no piezoelectric array.
pub fn place(study: &Study, force_exchange: bool) -> Result<Placing, InputError> {
    let error = |key: &str, message: String, help: &str| {
        InputError::whole(&study.name, message)
            .key(format!("place.{key}"))
            .help(help)
    };
    let wrong = |key: &str, message: String, help: &str| Err(error(key, message, help));
    let Some(asked) = &study.place else {
        return wrong("", String::from("the study has no [place]"), "add it");
    };
    let (text, _) = study.text_of(&study.nominal());
    let sensor = study.read(&text)?;
    let Ok(array) = sensor.piezoelectric() else {
        let help = "name such as piezo-1.5mm";
        return wrong(
            "of",
            String::from("places are chosen for piezoelectric arrays"),
            help,
        );
    };
    let candidates = candidates_of(asked, array.places())
        .map_err(|(message, help)| error("candidates", message, help))?;
    let count = asked.count;
    if !(3..=candidates.len()).contains(&count) {
        let message = format!("count = {count} is not between 3 and {}", candidates.len());
        return wrong("count", message, "x, y and the force need three elements");
    }
    let loads = Loads::one(&asked.load, array.information_loads());
    let loads = match loads {
        Ok(loads) => loads,
        Err(error) => return wrong("load", error.message, &error.help),
    };
    let load = loads.load(0);
    let (Some(force), Some(radius)) = (load.number(0), load.number(3)) else {
        let message = String::from("force and radius of the contact are needed");
        return wrong("load", message, "such as fz=100 mN, radius=3.6 mm");
    };
    let noise = match &asked.noise {
        None => array.element_deviation(),
        Some(text) => match FORCE.parse(text) {
            Ok(noise) if noise > 0.0 => noise,
            Ok(_) => {
                return wrong(
                    "noise",
                    format!("\"{text}\" is not above zero"),
                    "give more than zero",
                );
            }
            Err(message) => return wrong("noise", message, ""),
        },
    };
    let cells_of = asked.grid.unwrap_or([25, 9]);
    if cells_of.iter().any(|cells| !(1..=1000).contains(cells)) {
        return wrong(
            "grid",
            String::from("a grid has 1 to 1000 cells each way"),
            "such as [25, 9]",
        );
    }
    let contacts = cells(&candidates, cells_of, force);
    let reach = farthest(&candidates, &contacts) + array.description.ceramic.side;
    let tables = PlaceInformation::new(&array, radius, reach, noise, RadiusKnowledge::Known);
    let slopes: Vec<Vec<Slopes>> = contacts
        .par_iter()
        .map(|contact| {
            let found = tables.at(&candidates, contact);
            let rows = found.jacobian.iter().zip(&found.noise);
            rows.map(|(row, noise)| [row[0] / noise, row[1] / noise, row[2] / noise])
                .collect()
        })
        .collect();
    let all = subsets(candidates.len(), count).filter(|all| *all <= MOST_TRIED);
    let exhaustive = all.is_some() && !force_exchange;
    let mut found = if exhaustive {
        every(&slopes, candidates.len(), count)
    } else {
        exchanged(
            &slopes,
            candidates.len(),
            count,
            asked.criterion,
            asked.seed.unwrap_or(1),
        )
    };
    let tried = found.1;
    found.0.sort_by(|a, b| {
        let by_cost = cost(Some(a), asked.criterion).total_cmp(&cost(Some(b), asked.criterion));
        by_cost.then_with(|| a.chosen.cmp(&b.chosen))
    });
    found.0.dedup_by(|a, b| a.chosen == b.chosen);
    found.0.truncate(10);
    Ok(Placing {
        side: array.description.ceramic.side,
        candidates,
        best: found.0,
        tried,
        exhaustive,
    })
}

/// All subsets.
fn every(slopes: &[Vec<Slopes>], candidates: usize, count: usize) -> (Vec<Choice>, usize) {
    let mut all: Vec<Vec<usize>> = Vec::new();
    let mut chosen: Vec<usize> = (0..count).collect();
    loop {
        all.push(chosen.clone());
        // The last index that can still rise.
        let rises = (0..count)
            .rev()
            .find(|at| chosen[*at] < candidates - count + at);
        let Some(at) = rises else { break };
        chosen[at] += 1;
        for next in at + 1..count {
            chosen[next] = chosen[next - 1] + 1;
        }
    }
    let tried = all.len();
    let found = all.par_iter().filter_map(|chosen| judged(slopes, chosen));
    (found.collect(), tried)
}

/// From random starts the best exchange of one element for another until none helps
/// (Fedorov 1972).
fn exchanged(
    slopes: &[Vec<Slopes>],
    candidates: usize,
    count: usize,
    criterion: Criterion,
    seed: u64,
) -> (Vec<Choice>, usize) {
    let mut random = seeded(seed);
    let mut tried = 0;
    let mut found = Vec::new();
    for _ in 0..STARTS {
        let mut order: Vec<usize> = (0..candidates).collect();
        for index in (1..candidates).rev() {
            order.swap(index, (draw(&mut random) * (index + 1) as f64) as usize);
        }
        let mut chosen = order[..count].to_vec();
        let mut now = judged(slopes, &chosen);
        loop {
            let mut swaps: Vec<(usize, usize)> = Vec::new();
            for at in 0..count {
                for other in (0..candidates).filter(|other| !chosen.contains(other)) {
                    swaps.push((at, other));
                }
            }
            tried += swaps.len();
            let judge = |(at, other): &(usize, usize)| {
                let mut trial = chosen.clone();
                trial[*at] = *other;
                (judged(slopes, &trial), trial)
            };
            let trials: Vec<(Option<Choice>, Vec<usize>)> = swaps.par_iter().map(judge).collect();
            let best = trials.into_iter().min_by(|a, b| {
                cost(a.0.as_ref(), criterion).total_cmp(&cost(b.0.as_ref(), criterion))
            });
            match best {
                Some((choice, trial))
                    if cost(choice.as_ref(), criterion) < cost(now.as_ref(), criterion) - 1e-12 =>
                {
                    (now, chosen) = (choice, trial);
                }
                _ => break,
            }
        }
        found.extend(now);
    }
    (found, tried)
}
