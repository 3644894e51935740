//! `taxel tabulate`: the load path of a sensor by finite elements as a table.

use taxel::device::NotTabulated;
use taxel::table::{self, Cell, Column};
use taxel::transduction::{Leaps, PathTable, TableErrors, TableOptions};

use crate::arguments::{COMMIT, Tabulate, VERSION};
use crate::progress::Progress;
use crate::{Done, Stop, files, interrupt, outputs};

pub(crate) fn run(arguments: &Tabulate) -> Result<Done, Stop> {
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", Some(&arguments.output))];
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    let named = files::sensor(&arguments.sensor)?;
    let device = files::device(&named.sensor)?;
    let mut options = TableOptions::default();
    if let Some(tolerance) = arguments.tolerance {
        options.tolerance = tolerance;
        options.leaps = Leaps::Refused;
    }
    let program = format!("taxel {VERSION} {COMMIT}");
    let mut progress = Progress::new("solving the load path");
    interrupt::leave_nothing_unfinished();
    let table = device.tabulate(&options, &program, &mut |fraction| progress.at(fraction));
    progress.end();
    let table = table.map_err(|error| match error {
        NotTabulated::NoTable(taxel::transduction::NoTable::Field(error)) => {
            Stop::Failed(format!("{}: {error}", named.name))
        }
        wrong => Stop::WrongInput(format!("{}: {wrong}", named.name)),
    })?;
    outputs::write(Some(&arguments.output), existing, &table.text())?;
    let summary = summary(&table);
    let done = outputs::print_beside(Some(&arguments.output), &summary);
    if let Some(reason) = &table.ended {
        note!(
            "note: the solution ended at a compression of {:.4}: {reason}",
            table.largest_compression()
        );
    }
    let error = table.interpolation.force.max(table.interpolation.change);
    if error > options.tolerance {
        note!(
            "note: the solution leaps: closer nodes do not bring the interpolation error below {:.1e}",
            options.tolerance
        );
    }
    note!(
        "note: the errors were observed, and are no bounds; write mechanics = {{ table = \"{}\" }} into the sensor file",
        arguments
            .output
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
    );
    done
}

/// Nodes, range and errors.
fn summary(table: &PathTable) -> String {
    let columns = [
        Column::plain("nodes"),
        Column::new("largest_compression", "", 1.0, "", 4),
        Column::new("interpolation_error_of_force", "%", 1e-2, "share", 5),
        Column::new("interpolation_error_of_change", "%", 1e-2, "share", 5),
        Column::plain("loads_between_nodes"),
        Column::new("mesh_error_of_force", "%", 1e-2, "share", 5),
        Column::new("mesh_error_of_change", "%", 1e-2, "share", 5),
        Column::plain("loads_on_finer_mesh"),
    ];
    let errors = |errors: &TableErrors| {
        [
            Cell::Number(errors.force),
            Cell::Number(errors.change),
            Cell::Whole(errors.loads as u64),
        ]
    };
    let head = [
        Cell::Whole(table.nodes() as u64),
        Cell::Number(table.largest_compression()),
    ];
    let row = head
        .into_iter()
        .chain(errors(&table.interpolation))
        .chain(errors(&table.mesh))
        .collect();
    table::render(
        table::Format::Table,
        &serde_json::Map::new(),
        &columns,
        &[row],
    )
}
