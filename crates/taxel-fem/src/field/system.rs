//! The equations of the free nodes: factorised once, solved and checked.

use super::FieldError;
use crate::sparse::{Cholesky, Definiteness, Factorisation, Pattern, solve_checked};

/// An entry of the lower half: row, column, value. Equal places add up.
pub(super) type Entry = (u32, u32, f64);

/// A factorised symmetric positive definite matrix, its unknowns in the order of
/// elimination.
pub(super) struct System {
    pattern: Pattern,
    values: Vec<f64>,
    factor: Cholesky,
}

impl System {
    /// Adds up the entries and factorises.
    pub(super) fn new(unknowns: usize, entries: &[Entry]) -> Result<Self, FieldError> {
        let pattern = pattern(unknowns, entries);
        let mut values = vec![0.0; pattern.entries()];
        for &(row, column, value) in entries {
            let range = pattern.column(column as usize);
            if let Ok(place) = pattern.rows[range.clone()].binary_search(&row) {
                values[range.start + place] += value;
            }
        }
        let mut factor = Cholesky::analyse(&pattern)?;
        if factor.refactor(&pattern, &values)? == Definiteness::Indefinite {
            return Err(FieldError::Undetermined { unknowns });
        }
        Ok(Self {
            pattern,
            values,
            factor,
        })
    }

    /// Solves for one right-hand side; the residual is checked.
    pub(super) fn solve(&mut self, right: &[f64]) -> Result<Vec<f64>, FieldError> {
        let Self {
            pattern,
            values,
            factor,
        } = self;
        Ok(solve_checked(factor, pattern, values, right)?)
    }
}

fn pattern(unknowns: usize, entries: &[Entry]) -> Pattern {
    let mut columns: Vec<Vec<u32>> = vec![Vec::new(); unknowns];
    for &(row, column, _) in entries {
        columns[column as usize].push(row);
    }
    let mut pattern = Pattern {
        column_starts: vec![0],
        rows: Vec::new(),
    };
    for mut rows in columns {
        rows.sort_unstable();
        rows.dedup();
        pattern.rows.append(&mut rows);
        pattern.column_starts.push(pattern.rows.len() as u32);
    }
    pattern
}
