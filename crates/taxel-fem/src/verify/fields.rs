//! Capacitance and resistance with an answer from outside.

use super::{Case, Effort};
use crate::field::cases as of;
use crate::field::{FieldError, cases};
use crate::solver::failure::Failure;

/// Mesh level of a short and of a full run.
fn level(effort: Effort) -> u32 {
    match effort {
        Effort::Short => 2,
        Effort::Full => 3,
    }
}

/// Relative error that is accepted: 0.01 % on the full mesh.
fn limit(effort: Effort) -> f64 {
    match effort {
        Effort::Short => 1e-3,
        Effort::Full => 1e-4,
    }
}

/// Adds a solved case, and on a full run its error on coarser meshes.
fn add(
    case: &mut Case,
    effort: Effort,
    solve: impl Fn(u32) -> Result<cases::FieldCase, FieldError>,
) -> Result<(), Failure> {
    let solved = solve(level(effort))?;
    case.relative(
        solved.name.clone(),
        solved.reference,
        solved.ours,
        limit(effort),
    );
    case.mesh = case.mesh.max((solved.cells, 0));
    if effort == Effort::Full && case.refinement.is_empty() {
        let mut points = Vec::new();
        for level in 1..=3 {
            let error = solve(level)?.error().abs();
            points.push((0.5_f64.powi(level as i32), error));
        }
        case.refinement.push(super::Refinement {
            what: solved.name,
            points,
        });
    }
    Ok(())
}

pub(super) fn coplanar_strips(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (ratio, reference) in of::COPLANAR_STRIPS {
        add(case, effort, |level| {
            of::coplanar_strips(ratio, reference, level)
        })?;
    }
    Ok(())
}

pub(super) fn opposed_strips(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (ratio, reference) in of::OPPOSED_STRIPS {
        add(case, effort, |level| {
            of::opposed_strips(ratio, reference, level)
        })?;
    }
    Ok(())
}

pub(super) fn ground_to_infinity(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (ratio, reference) in of::OPPOSED_STRIPS {
        add(case, effort, |level| {
            of::strip_above_ground(ratio, reference, level)
        })?;
    }
    Ok(())
}

pub(super) fn coaxial_discs(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (ratio, reference) in of::COAXIAL_DISCS {
        add(case, effort, |level| {
            of::coaxial_discs(ratio, reference, level)
        })?;
    }
    Ok(())
}

pub(super) fn isolated(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    add(case, effort, of::sphere)?;
    add(case, effort, of::disc)
}

pub(super) fn corner_square(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    add(case, effort, of::corner_square)
}

impl From<FieldError> for Failure {
    fn from(error: FieldError) -> Self {
        Self::at_start(crate::solver::failure::Reason::Field(error))
    }
}
