//! `taxel tabulate`: the load path of a sensor by finite elements as a table.

use taxel::table::{self, Cell, Column};
use taxel::transduction::PathTable;
use taxel_bodies::NotTabulated;
use taxel_bodies::transduction::{Leaps, NoTable, TableOptions};
use taxel_files::{COMMIT, VERSION};

use crate::arguments::Tabulate;
use crate::{Done, Stop, files, interrupt, outputs};
use taxel_files::Progress;

pub(crate) fn run(arguments: &Tabulate) -> Result<Done, Stop> {
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", Some(&arguments.output))];
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    let named = files::sensor(&arguments.sensor)?;
    let mut options = TableOptions::default();
    if let Some(tolerance) = arguments.tolerance {
        options.tolerance = tolerance;
        options.leaps = Leaps::Refused;
    }
    let program = format!("taxel {VERSION} {COMMIT}");
    let progress = Progress::new("solving the load path");
    interrupt::leave_nothing_unfinished();
    let heard = &mut |fraction| progress.at(fraction);
    let table = taxel_bodies::tabulate(&named.sensor, &options, &program, heard);
    drop(progress);
    let table = table.map_err(|error| match error {
        NotTabulated::NoTable(NoTable::Field(error)) => {
            Stop::Failed(format!("{}: {error}", named.name))
        }
        NotTabulated::NoTable(NoTable::Layers(error)) => {
            Stop::Failed(format!("{}: {error}", named.name))
        }
        wrong => Stop::WrongInput(format!("{}: {wrong}", named.name)),
    })?;
    outputs::write(Some(&arguments.output), existing, &table.text())?;
    let summary = summary(&table);
    let done = outputs::print_beside(Some(&arguments.output), &summary);
    let end = table.variable();
    if let Some(reason) = &table.ended {
        note!(
            "note: the solution ended at a {} of {:.4}{}: {reason}",
            end.name,
            table.end() / end.scale,
            if end.unit.is_empty() {
                String::new()
            } else {
                format!(" {}", end.unit)
            }
        );
    }
    if table.interpolation.largest() > options.tolerance {
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
    let end = table.variable();
    let mut columns = vec![
        Column::plain("nodes"),
        Column::new(
            format!("largest_{}", end.name),
            end.unit,
            end.scale,
            end.key,
            4,
        ),
    ];
    let mut row = vec![Cell::Whole(table.nodes() as u64), Cell::Number(table.end())];
    for (name, errors, loads) in [
        (
            "interpolation_error",
            &table.interpolation,
            "loads_between_nodes",
        ),
        ("mesh_error", &table.mesh, "loads_on_finer_mesh"),
    ] {
        for (quantity, share) in &errors.of_full_scale {
            let name = format!("{name}_of_{quantity}");
            columns.push(Column::new(name, "%", 1e-2, "share", 5));
            row.push(Cell::Number(*share));
        }
        columns.push(Column::plain(loads));
        row.push(Cell::Whole(errors.loads as u64));
    }
    table::render(
        table::Format::Table,
        &serde_json::Map::new(),
        &columns,
        &[row],
    )
}
