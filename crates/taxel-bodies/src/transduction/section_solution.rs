//! Solving the cross-section of an in-plane sensor that no table has.

use super::in_plane_field::{FieldStudy, NoField, SolvedInPlane};
use taxel::mechanics::{DeformedElectrodes, EndCondition, LARGEST_COMPRESSION};
use taxel::transduction::{InPlaneModel, SectionErrors, SolvedSection, VACUUM_PERMITTIVITY};

const NUMBERS: usize = SolvedSection::NUMBERS;
const FORCE: usize = SolvedSection::FORCE;
const LEAST: SectionErrors = SectionErrors::LEAST;

/// Gaps over the drawn one; a wider one that finds no place is taken closer.
const NARROW: f64 = 0.5;
const WIDE: [f64; 5] = [2.0, 1.6, 1.3, 1.1, 1.02];
/// Share of the half length of the layer that gap and electrode may take.
const ROOM: f64 = 0.95;
/// States on the way to the greatest compression.
const STEPS: usize = 12;
/// Least part of a step that is tried: a fold that cannot be followed is not found by ever
/// smaller ones.
const SMALLEST: f64 = 0.03;
/// Compressions over the last one at which a coarser mesh is solved too.
const COMPARED: [f64; 3] = [0.0, 0.25, 0.5];

/// Solves the cross-section of a sensor; `progress` hears the fraction.
///
/// # Errors
/// [`NoField`].
pub(crate) fn solve_section(
    model: &InPlaneModel,
    progress: &mut dyn FnMut(f64),
) -> Result<SolvedSection, NoField> {
    let body = body(model);
    let with_gap = |factor: f64| {
        let mut other = body.clone();
        other.electrodes.gap *= factor;
        other
    };
    let whole = |model: &InPlaneModel, progress: &mut dyn FnMut(f64)| {
        SolvedInPlane::solve_in(
            (STEPS, SMALLEST),
            model,
            LARGEST_COMPRESSION,
            &|_| false,
            progress,
        )
    };
    let wide = WIDE.into_iter().find(|factor| has_room(&with_gap(*factor)));
    let mut sides: [Option<Result<SolvedInPlane, NoField>>; 2] = [None, None];
    let mut drawn = None;
    let [narrow_side, wide_side] = &mut sides;
    // The calling thread solves the drawn gap and tells how far it is.
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| *narrow_side = Some(whole(&with_gap(NARROW), &mut |_| {})));
        if let Some(factor) = wide {
            scope.spawn(move |_| *wide_side = Some(whole(&with_gap(factor), &mut |_| {})));
        }
        drawn = Some(whole(&body, &mut |fraction| progress(0.5 * fraction)));
    });
    let drawn = drawn.unwrap_or(Err(NoField::Compression(0.0)))?;
    progress(0.8);
    let of_force = has_body(model.layer.end_condition);
    let own = numbers(&body, &drawn, of_force);
    let [narrow_side, wide_side] = sides;
    let narrow = narrow_side.map(|found| (NARROW, found));
    let wide = wide.zip(wide_side);
    let (mut gaps, mut states) = (vec![1.0], vec![own.clone()]);
    for (factor, found) in [narrow, wide].into_iter().flatten() {
        // A gap that has no solution is left out.
        let Ok(found) = found else { continue };
        let side = beside(&own, &drawn, &with_gap(factor), &found, of_force);
        let place = if factor < 1.0 { 0 } else { gaps.len() };
        gaps.insert(place, factor);
        states.insert(place, side);
    }
    if gaps.len() == 1 {
        let message = "neither a narrower nor a wider gap has a solution";
        return Err(NoField::Solver(message.into()));
    }
    Ok(SolvedSection {
        drawn_gap: body.electrodes.gap,
        gaps,
        step: drawn.step(),
        states,
        errors: errors(&body, &drawn, of_force)?,
        ended: drawn.ended,
    })
}

/// True if an end condition means a body that can be solved.
fn has_body(end: EndCondition) -> bool {
    matches!(
        end,
        EndCondition::Free | EndCondition::ShortLayer | EndCondition::WideLayer
    )
}

/// The body whose electrodes are solved: free ends on a wider base where the end condition
/// is a factor, on which the middle of the layer hardly depends.
fn body(model: &InPlaneModel) -> InPlaneModel {
    let mut body = as_drawn(model);
    if !has_body(body.layer.end_condition) {
        body.layer.end_condition = EndCondition::ShortLayer;
    }
    body
}

/// The model without what was solved of it and without what only a calibration gives.
pub(super) fn as_drawn(model: &InPlaneModel) -> InPlaneModel {
    let mut drawn = model.clone();
    drawn.solved = None;
    drawn.table = None;
    drawn.stray_capacitance = 0.0;
    drawn.layer.end_scale = 1.0;
    drawn
}

/// True if gap and electrodes lie in the layer.
fn has_room(model: &InPlaneModel) -> bool {
    let electrodes = &model.electrodes;
    let half = 0.5 * electrodes.gap + electrodes.width;
    model.layer.end_condition == EndCondition::WideLayer
        || half <= ROOM * model.layer.contact_half_length
}

/// Numbers of one solved load path at the compressions of its states.
fn numbers(model: &InPlaneModel, way: &SolvedInPlane, of_force: bool) -> Vec<[f64; NUMBERS]> {
    let electrodes = &model.electrodes;
    let scale = VACUUM_PERMITTIVITY * electrodes.depth;
    let mut found: Vec<[f64; NUMBERS]> = way
        .states()
        .iter()
        .map(|state| {
            let deformed = DeformedElectrodes {
                gap: state.gap,
                thickness: state.thickness,
                width: state.width,
            };
            let closed = model.dielectric.uniform(&deformed, electrodes.depth);
            let force = model.closed_layer().compress(state.compression);
            let ratio = match force {
                Ok(layer) if of_force && layer.mean_stress > 0.0 => {
                    state.mean_stress / layer.mean_stress
                }
                _ => 1.0,
            };
            [
                state.gap / electrodes.gap,
                state.thickness / electrodes.thickness,
                state.width / electrodes.width,
                (state.capacitance - closed) / scale,
                ratio,
            ]
        })
        .collect();
    if let [rest, one, two, three, ..] = &mut found[..] {
        // At rest both forces are nothing: the parabola through the next states.
        rest[FORCE] = 3.0 * one[FORCE] - 3.0 * two[FORCE] + three[FORCE];
    }
    found
}

/// Numbers of another gap at the compressions of the drawn one; beyond its end they keep
/// their distance.
fn beside(
    own: &[[f64; NUMBERS]],
    drawn: &SolvedInPlane,
    model: &InPlaneModel,
    way: &SolvedInPlane,
    of_force: bool,
) -> Vec<[f64; NUMBERS]> {
    let states = numbers(model, way, of_force);
    let side = SolvedSection {
        drawn_gap: 1.0,
        gaps: vec![1.0],
        step: way.step(),
        states: vec![states],
        errors: LEAST,
        ended: None,
    };
    let drawn = SolvedSection {
        states: vec![own.to_vec()],
        step: drawn.step(),
        ..side.clone()
    };
    let end = side.largest_compression();
    own.iter()
        .enumerate()
        .map(|(number, own)| {
            let compression = number as f64 * drawn.step;
            let there = side.at(1.0, compression);
            if compression <= end {
                return there;
            }
            let last = drawn.at(1.0, end);
            std::array::from_fn(|k| own[k] + there[k] - last[k])
        })
        .collect()
}

/// Differences of a coarser mesh at a few compressions.
fn errors(
    model: &InPlaneModel,
    way: &SolvedInPlane,
    of_force: bool,
) -> Result<SectionErrors, NoField> {
    let mut coarse = FieldStudy::coarse(model)?;
    let mut found = LEAST;
    let mut rest = [way.rest().capacitance; 2];
    for part in COMPARED {
        let compression = part * way.last().compression;
        let (Some(fine), Ok(other)) = (way.at(compression), coarse.press(compression)) else {
            continue;
        };
        let pair = [fine.capacitance, other.capacitance];
        let differ = |[fine, other]: [f64; 2]| (other / fine - 1.0).abs();
        if compression == 0.0 {
            rest = pair;
            found.capacitance = found.capacitance.max(differ(pair));
        } else {
            let change = differ([rest[0] - pair[0], rest[1] - pair[1]]);
            found.change = found.change.max(change);
            let force = differ([fine.mean_stress, other.mean_stress]);
            found.force = found.force.map(|known| known.max(force));
        }
    }
    if !of_force {
        found.force = None;
    }
    Ok(found)
}
