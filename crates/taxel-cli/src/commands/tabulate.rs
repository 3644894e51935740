//! `taxel tabulate`: the load path of a sensor by finite elements as a table.

use std::path::PathBuf;

use taxel::sensor::Sensor;
use taxel::solutions::Solutions as _;
use taxel::stage::{BodyElement, Share};
use taxel::table::{self, Cell, Column};
use taxel::transduction::{PathTable, ResponseTable};
use taxel_bodies::NotTabulated;
use taxel_bodies::transduction::{Leaps, NoResponse, NoTable, ResponseOptions, TableOptions};
use taxel_files::{COMMIT, Folder, PointFile, VERSION};

use crate::arguments::Tabulate;
use crate::{Done, Stop, files, interrupt, outputs};
use taxel_files::Progress;

pub(crate) fn run(arguments: &Tabulate) -> Result<Done, Stop> {
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", Some(&arguments.output))];
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    let (name, text) = files::sensor_text(&arguments.sensor)?;
    let drawn = Sensor::drawn(&name, &text)?;
    if let Some(body) = drawn.body() {
        return of_body(arguments, body, (&name, &text));
    }
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

/// The answers of a body over its load. Points go to a file beside the table as they are solved, from
/// which a run that was stopped goes on.
fn of_body(
    arguments: &Tabulate,
    body: &BodyElement,
    (name, text): (&str, &str),
) -> Result<Done, Stop> {
    let mut element = body.clone();
    element.tolerance = arguments.tolerance.map(Share).or(element.tolerance);
    let at_key = |key: &str, message: &str, help: &str| {
        let path: Vec<&str> = ["element", "body"]
            .into_iter()
            .chain(key.split('.'))
            .collect();
        Stop::from(taxel::toml_input::at_key(name, text, &path, message, help))
    };
    let files = Folder::beside(&arguments.sensor).body(&element.problem);
    let help = "give a problem file of `taxel solve`, or the name of a shipped one";
    let files = files.map_err(|message| at_key("problem", &message, help))?;
    let drawing = element.drawing(files.unwrap_or_default());
    let drawing = drawing.map_err(|wrong| at_key(&wrong.key, &wrong.message, &wrong.help))?;
    let mut options = ResponseOptions::default();
    options.most_points = arguments.points.unwrap_or(options.most_points);
    options.jobs = arguments.jobs.unwrap_or(options.jobs).max(1);
    let mut kept = arguments.output.clone().into_os_string();
    kept.push(".points");
    let question = drawing.clone().question();
    let points = PointFile::open(&PathBuf::from(kept), &question.statement)?;
    if points.count() > 0 {
        note!("going on after {} points", points.count());
    }
    let program = format!("taxel {VERSION} {COMMIT}");
    let progress = Progress::new(format!("solving the {}", question.what));
    interrupt::leave_nothing_unfinished();
    let heard = &mut |fraction| progress.at(fraction);
    let table = taxel_bodies::tabulate_body(&drawing, options, &points, &program, heard);
    drop(progress);
    let table = table.map_err(|error| match error {
        NoResponse::Problem(message) => {
            let (message, help) = message
                .split_once("\nhelp: ")
                .unwrap_or((&message, "change the problem or the sensor file"));
            at_key("problem", message, help)
        }
        error => Stop::Failed(format!("{name}: {error}")),
    })?;
    let existing = arguments.overwrite.existing();
    outputs::write(Some(&arguments.output), existing, &table.text())?;
    points.remove()?;
    let done = outputs::print_beside(Some(&arguments.output), &summary_of_body(&table));
    if let Some(reason) = &table.file().ended {
        note!("note: the box ends sooner than its range, because the solution does: {reason}");
    }
    let file = arguments.output.file_name().unwrap_or_default();
    note!(
        "note: write mechanics = {{ table = \"{}\" }} into the sensor file",
        file.to_string_lossy()
    );
    done
}

/// Points, box and errors.
fn summary_of_body(table: &ResponseTable) -> String {
    let file = table.file();
    let mut columns = vec![Column::plain("points"), Column::plain("fresh_points")];
    let mut row = vec![
        Cell::Whole(file.points.len() as u64),
        Cell::Whole(file.certificate.points as u64),
    ];
    for (output, worst) in file.outputs.iter().zip(&file.certificate.worst) {
        let name = format!("largest_error_of_{}", output.name);
        columns.push(Column::new(name, "%", 1e-2, "share", 4));
        row.push(Cell::Number(*worst));
    }
    table::render(
        table::Format::Table,
        &serde_json::Map::new(),
        &columns,
        &[row],
    )
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
