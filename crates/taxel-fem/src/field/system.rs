//! The equations of the free nodes: ordered, factorised once, solved and checked.

use super::FieldError;
use crate::solver::sparse::{Cholesky, Definiteness, Factorisation, Pattern, solve_checked};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// An entry of the lower half: row, column, value. Equal places add up.
pub(super) type Entry = (u32, u32, f64);

/// A factorised symmetric positive definite matrix.
pub(super) struct System {
    pattern: Pattern,
    values: Vec<f64>,
    factor: Cholesky,
    /// Place of each unknown in the order of elimination.
    places: Vec<u32>,
}

impl System {
    /// Orders for little fill, then factorises.
    pub(super) fn new(unknowns: usize, mut entries: Vec<Entry>) -> Result<Self, FieldError> {
        let places = order(&pattern(unknowns, &entries))?;
        for (row, column, _) in &mut entries {
            let (i, j) = (places[*row as usize], places[*column as usize]);
            (*row, *column) = (i.max(j), i.min(j));
        }
        let pattern = pattern(unknowns, &entries);
        let mut values = vec![0.0; pattern.entries()];
        for (row, column, value) in entries {
            let range = pattern.column(column as usize);
            let rows = &pattern.rows[range.clone()];
            if let Ok(place) = rows.binary_search(&row) {
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
            places,
        })
    }

    /// Solves for one right-hand side; the residual is checked. Returns the solution and
    /// what is left of the residual, `A x - b`.
    pub(super) fn solve(&mut self, right: &[f64]) -> Result<(Vec<f64>, Vec<f64>), FieldError> {
        let mut moved = vec![0.0; right.len()];
        for (&place, value) in self.places.iter().zip(right) {
            moved[place as usize] = *value;
        }
        let solution = solve_checked(&mut self.factor, &self.pattern, &self.values, &moved)?;
        let mut rest = self.pattern.multiply(&self.values, &solution);
        for (rest, right) in rest.iter_mut().zip(&moved) {
            *rest -= right;
        }
        Ok((self.back(&solution), self.back(&rest)))
    }

    fn back(&self, moved: &[f64]) -> Vec<f64> {
        let places = self.places.iter();
        places.map(|&place| moved[place as usize]).collect()
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

/// Place of each unknown in an approximate minimum degree order.
fn order(pattern: &Pattern) -> Result<Vec<u32>, FieldError> {
    let n = pattern.size();
    let memory = || crate::solver::sparse::LinearError::Memory { unknowns: n };
    let view =
        SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
    let (mut forward, mut places) = (vec![0_u32; n], vec![0_u32; n]);
    let mut buffer = MemBuffer::new(amd::order_scratch::<u32>(n, pattern.entries()));
    amd::order(
        &mut forward,
        &mut places,
        view,
        amd::Control::default(),
        MemStack::new(&mut buffer),
    )
    .map_err(|_| memory())?;
    Ok(places)
}
