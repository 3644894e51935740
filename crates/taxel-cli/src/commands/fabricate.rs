//! `taxel fabricate`: masks, moulds, drawing and bill of layers of a sensor.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use taxel::table::{self, Cell, Column};
use taxel_fabricate::{Options, Plan, files};
use taxel_files::Progress;

use crate::arguments::Fabricate;
use crate::{Done, Stop, outputs};

pub(crate) fn run(arguments: &Fabricate) -> Result<Done, Stop> {
    let options = Options {
        shrink: arguments.shrink,
        mirror: arguments.mirror,
        polarity: arguments.polarity.into(),
        marks: arguments.marks,
        grid: arguments.grid,
    };
    let named = crate::files::sensor(&arguments.sensor)?;
    let wrong =
        |error: taxel_fabricate::Refused| Stop::WrongInput(format!("{}: {error}", named.name));
    let plan = Plan::of(&named.sensor).map_err(wrong)?;
    let drawing = Progress::new("drawing masks and moulds");
    let written = files(&plan, &options, &named.origin()).map_err(wrong)?;

    let existing = arguments.overwrite.existing();
    let folder = &arguments.output;
    let paths: Vec<_> = written.iter().map(|file| folder.join(&file.name)).collect();
    if folder.exists() {
        let targets: Vec<_> = paths.iter().map(|path| ("--output", Some(path))).collect();
        outputs::check(&targets, &[&arguments.sensor], existing)?;
    }
    fs::create_dir_all(folder).map_err(|error| outputs::cannot_write(folder, &error))?;
    for (file, path) in written.iter().zip(&paths) {
        outputs::write_file(path, existing, |target| {
            let written = std::io::Write::write_all(target, &file.bytes);
            written.map_err(|error| outputs::cannot_write(path, &error))
        })?;
    }

    let mut about = named.about();
    let missing = plan.missing.iter().map(String::as_str).map(Value::from);
    about.insert("not_in_the_sensor_file".into(), missing.collect());
    let (columns, rows) = summary(&plan, &options);
    drop(drawing);
    let mut text = table::render(arguments.format.into(), &about, &columns, &rows);
    if arguments.format == crate::arguments::Format::Table {
        text.push_str("\nNot in the sensor file, and so not drawn:\n");
        for what in &plan.missing {
            let _ = writeln!(text, "- {what}");
        }
    }
    outputs::print(&text)
}

/// One row for each mask, mould and table, with areas and volumes as the files have them.
fn summary(plan: &Plan, options: &Options) -> (Vec<Column>, Vec<Vec<Cell>>) {
    let columns = vec![
        Column::plain("what"),
        Column::plain("file"),
        Column::plain("figures"),
        Column::new("area", "mm2", 1e-6, "m2", 6),
        Column::new("volume", "mm3", 1e-9, "m3", 6),
    ];
    let none = || Cell::Missing;
    let masks = plan.masks.iter().map(|mask| {
        let mask = mask.drawn(&plan.field, options.polarity);
        vec![
            mask.name.into(),
            "masks.dxf, masks.gds".into(),
            Cell::Whole(mask.figures.len() as u64),
            mask.area().into(),
            none(),
        ]
    });
    let moulds = plan.moulds.iter().map(|mould| {
        vec![
            mould.about.clone().into(),
            format!("{}.stl", mould.name).into(),
            none(),
            none(),
            mould.mesh(options.shrink).volume().into(),
        ]
    });
    let layers = vec![
        "layers".into(),
        "layers.csv".into(),
        Cell::Whole(plan.layers.len() as u64),
        none(),
        plan.layers
            .iter()
            .map(|layer| layer.volume)
            .sum::<f64>()
            .into(),
    ];
    let drawing = vec![
        "drawing".into(),
        "drawing.svg".into(),
        none(),
        none(),
        none(),
    ];
    let rows = masks.chain(moulds).chain([layers, drawing]).collect();
    (columns, rows)
}
