//! Time of one answer of the table of a body: that of the shipped dome, and one of 200 points over four
//! parameters with ten outputs.
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::hint::black_box;
use std::time::Instant;

use taxel::solutions::shipped_table;
use taxel::transduction::{ResponseFile, ResponseTable, TableOutput, TableParameter};
use taxel_numerics::{Kriging, sobol};

const ANSWERS: usize = 20_000;

/// Mean time of an answer at points all over the box, us.
fn time(table: &ResponseTable) -> f64 {
    let dimensions = table.file().parameters.len();
    let points: Vec<Vec<f64>> = sobol(dimensions, ANSWERS, Some(1))
        .iter()
        .map(|point| table.file().in_box(point))
        .collect();
    let start = Instant::now();
    for point in &points {
        black_box(table.at(black_box(point)));
    }
    1e6 * start.elapsed().as_secs_f64() / ANSWERS as f64
}

fn several() -> Option<ResponseTable> {
    let parameter = |name: &str| TableParameter {
        name: name.into(),
        unit: "m".into(),
        range: [0.0, 1e-3],
    };
    let output = |number: usize| TableOutput {
        name: format!("output_{number}"),
        unit: "F".into(),
    };
    let parameters = ["travel", "x", "y", "radius"].map(parameter).to_vec();
    let mut file = ResponseFile::new(Vec::new(), parameters, 0, (0..11).map(output).collect());
    let points = sobol(4, 200, Some(2));
    for point in &points {
        file.points.push(file.in_box(point));
        let value = |output: usize| (point[output % 4] * (1.0 + 0.2 * output as f64)).sin();
        file.values.push((0..11).map(value).collect());
    }
    let kriging = Kriging::with(&points, &file.values, vec![0.5; 4], 1e-8)?;
    (file.lengths, file.nugget) = (kriging.lengths().to_vec(), kriging.nugget());
    ResponseTable::new(file)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = shipped_table("soft-dome.table").ok_or("not shipped")?;
    let dome = ResponseTable::read(text)?;
    println!("soft-dome: {:.2} us an answer", time(&dome));
    let several = several().ok_or("no surface")?;
    println!(
        "200 points over four parameters, ten outputs and a force: {:.2} us an answer",
        time(&several)
    );
    Ok(())
}
