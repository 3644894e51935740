//! The load path of an in-plane sensor for its table.

use super::in_plane_field::{FieldState, FieldStudy, SolvedInPlane};
use super::path_solution::{LoadPath, NoTable, Off, TableOptions, solve};
use super::section_solution::as_drawn;
use crate::mechanics::Fineness;
use taxel::mechanics::LARGEST_COMPRESSION;
use taxel::transduction::InPlaneModel;
use taxel::transduction::in_plane_table::{CAPACITANCE, CONTENTS, NUMBERS, STRESS};
use taxel::transduction::path_table::{Contents, PathState, PathTable};
use taxel_numerics::roots;

/// The load path of a sensor as drawn.
struct InPlanePath<'m> {
    model: &'m InPlaneModel,
    body: InPlaneModel,
}

impl LoadPath for InPlanePath<'_> {
    const CONTENTS: &'static Contents = &CONTENTS;

    fn drawing(&self) -> Vec<String> {
        self.model.path_statement()
    }

    /// As far as it can be read back.
    fn reach(&mut self, progress: &mut dyn FnMut(f64)) -> Result<(f64, Option<String>), NoTable> {
        let whole = SolvedInPlane::solve(&self.body, LARGEST_COMPRESSION, &|_| false, progress)?;
        Ok((invertible(&whole), whole.ended))
    }

    fn states(&mut self, loads: &[f64], fineness: Fineness) -> Result<Vec<PathState>, NoTable> {
        let mut study = match fineness {
            Fineness::Usual => FieldStudy::new(&self.body),
            Fineness::Finer => FieldStudy::fine(&self.body),
        }?;
        loads
            .iter()
            .map(|compression| Ok(numbers(&study.press(*compression)?)))
            .collect()
    }

    /// Of force and of change of capacitance.
    fn off(
        &self,
        table: &PathTable,
        rest: &PathState,
        states: &[PathState],
    ) -> Result<Vec<Off>, NoTable> {
        let [own, end] = table.ends().map(|node| node[CAPACITANCE]);
        let largest = table.ends()[1][STRESS];
        let full = (own - end).abs();
        let off = |(compression, solved): &PathState| {
            let here = table.at::<NUMBERS>(*compression);
            let change = (own - here[CAPACITANCE]) - (rest.1[CAPACITANCE] - solved[CAPACITANCE]);
            [(here[STRESS] - solved[STRESS]) / largest, change / full]
        };
        Ok(states.iter().map(off).collect())
    }
}

/// Solves the load path of an in-plane sensor by finite elements as far as it can be read back, as a
/// table; `program` is what makes it, `progress` hears the fraction.
///
/// # Errors
/// [`NoTable`].
pub fn tabulate_section(
    model: &InPlaneModel,
    options: &TableOptions,
    program: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<PathTable, NoTable> {
    let body = as_drawn(model);
    let mut path = InPlanePath { model, body };
    solve(&mut path, options, program, progress)
}

/// Compression up to which a change of capacitance belongs to one compression: beyond, nothing reads
/// the sensor back.
fn invertible(way: &SolvedInPlane) -> f64 {
    let rest = way.rest().capacitance;
    let change = |e: f64| way.at(e).map_or(f64::NAN, |state| rest - state.capacitance);
    roots::one_to_one(way.last().compression, change).end
}

fn numbers(state: &FieldState) -> PathState {
    let numbers = vec![
        state.mean_stress,
        state.gap,
        state.thickness,
        state.width,
        state.capacitance,
    ];
    (state.compression, numbers)
}
