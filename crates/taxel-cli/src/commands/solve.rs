//! `taxel solve`: a soft body of the user's own.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use taxel::shown;
use taxel::table;
use taxel_bodies::problem::{Body, Ended};
use taxel_files::{COMMIT, NamedProblem, VERSION};

use crate::arguments::Solve;
use crate::interrupt::Interrupt;
use crate::outputs::{self, Existing};
use crate::{Done, Stop, files};
use taxel_files::Progress;

/// Name of the list of the files for ParaView.
const SERIES: &str = "steps.pvd";

pub(crate) fn run(arguments: &Solve) -> Result<Done, Stop> {
    let named = NamedProblem::read(&arguments.problem)?;
    let existing = arguments.overwrite.existing();
    let mut inputs = vec![&arguments.problem];
    inputs.extend(named.mesh_file.as_ref());
    inputs.extend(arguments.resume.as_ref());
    let given = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    outputs::check(&given, &inputs, existing)?;
    // The state may go on in the file that it comes from.
    let goes_on = arguments.save.is_some() && arguments.save == arguments.resume;
    let save_over = if goes_on {
        Existing::Replaced
    } else {
        existing
    };
    if !goes_on {
        let save = ("--save", arguments.save.as_ref());
        outputs::check(&[given[0], given[1], save], &inputs, existing)?;
    }
    if let Some(path) = &arguments.plot
        && files::is_page(path)?
    {
        let path = shown::path(path);
        return Err(Stop::WrongInput(format!("--plot {path}: must end in .svg")));
    }
    let mut body = named.body()?;
    for note in body.notes() {
        note!("note: {note}");
    }
    let mut series = arguments
        .vtu
        .as_deref()
        .map(|folder| Series::new(folder, body.steps(), existing))
        .transpose()?;
    if arguments.check {
        return report(&named, &body);
    }
    let identity = named.identity();
    if let Some(path) = &arguments.resume {
        let text = files::text(path)?;
        body.restore(&text, &identity)
            .map_err(|error| Stop::WrongInput(format!("{}: {error}", shown::path(path))))?;
        note!("going on after step {} of {}", body.done(), body.steps());
    }
    let save = |body: &Body, first: bool| match &arguments.save {
        Some(path) => {
            let over = if first { save_over } else { Existing::Replaced };
            outputs::write(Some(path), over, &body.save(&identity)).map(drop)
        }
        None => Ok(()),
    };
    let ended = solve(&mut body, &mut series, arguments.resume.is_some(), &save)?;
    let effort = body.effort();
    if effort.parts > 0 {
        note!(
            "{} parts of steps, {:.1} iterations each on the mean, at most {}",
            effort.parts,
            effort.iterations as f64 / effort.parts as f64,
            effort.most
        );
    }
    notes_of_steps(&body);
    let about = about(&named, &body);
    let answer = table::render(
        arguments.format.into(),
        &about,
        &body.columns(),
        &body.cells(),
    );
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    if let Some(path) = &arguments.plot {
        let picture = body
            .picture()
            .map_err(|error| Stop::WrongInput(format!("--plot: {error}")))?;
        outputs::write(Some(path), existing, &picture)?;
    }
    match ended {
        Way::Done => Ok(Done::Complete),
        Way::Stopped => {
            note!(
                "note: stopped in step {} of {}",
                body.done() + 1,
                body.steps()
            );
            Ok(Done::WithLosses)
        }
        Way::Failed(message) => Err(Stop::Failed(message)),
    }
}

/// Says what the steps have shown of the problem.
fn notes_of_steps(body: &Body) {
    let inside_out = body.inside_out();
    if !inside_out.is_empty() {
        let steps: Vec<String> = inside_out.iter().map(usize::to_string).collect();
        note!(
            "note: after step {} a cell is inside out between its points of integration (least_volume_ratio), and forces are not to be trusted there; larger cells or a rounder edge help, and solver.whole_cells = true refuses such a state",
            steps.join(", ")
        );
    }
    if let Some(strained) = body.beyond_small_strain() {
        note!("note: {strained}");
    }
    for name in body.untouched() {
        note!(
            "note: \"{name}\" touched nothing at the end of any step: its place, direction or way may be wrong"
        );
    }
}

/// End of the steps.
enum Way {
    Done,
    Stopped,
    Failed(String),
}

/// Solves the steps that are left; states are saved and written on the way.
fn solve(
    body: &mut Body,
    series: &mut Option<Series>,
    resumed: bool,
    save: &dyn Fn(&Body, bool) -> Result<(), Stop>,
) -> Result<Way, Stop> {
    let interrupt = Interrupt::listen();
    let flag = interrupt.flag().clone();
    body.stop_when(move || flag.asked());
    let progress = Progress::new("solving");
    let steps = body.steps();
    if let Some(series) = series.as_mut().filter(|_| !resumed) {
        series.write(body)?;
    }
    let mut first = true;
    let mut corners = body.went_to_corners();
    while body.done() < steps {
        let before = body.done();
        let done = before as f64;
        let result = body.step(|part| {
            progress.at((done + part) / steps as f64);
            true
        });
        if body.went_to_corners() && !corners {
            corners = true;
            note!(
                "note: step {}: pressures of contacts at single points did not go on; from here on they are kept at the corners of cells, whose greatest ones are less accurate",
                before + 1
            );
        }
        if let Some(jump) = body.jumps().iter().max_by(|a, b| a.way.total_cmp(&b.way)) {
            let [x, y, z] = jump.place.map(|x| 1e3 * x);
            note!(
                "note: step {}: the body lost its equilibrium and jumped to another one, {}; farthest by {:.3} mm, near ({x:.3}, {y:.3}, {z:.3}) mm",
                before + 1,
                match body.jumps().len() {
                    1 => "once".to_owned(),
                    times => format!("{times} times"),
                },
                1e3 * jump.way
            );
        }
        save(body, first)?;
        first = false;
        match result {
            Ok(Ended::Done) => {
                if let Some(series) = series {
                    series.write(body)?;
                }
            }
            Ok(Ended::Stopped) => return Ok(Way::Stopped),
            Err(failure) => return Ok(Way::Failed(body.explain(&failure))),
        }
        if interrupt.asked() && body.done() < steps {
            return Ok(Way::Stopped);
        }
    }
    Ok(Way::Done)
}

/// What a check says.
fn report(named: &NamedProblem, body: &Body) -> Result<Done, Stop> {
    let [unknowns, cells] = body.size();
    let columns: Vec<String> = body
        .columns()
        .into_iter()
        .map(|column| column.name)
        .collect();
    let description = body.description();
    let description: Vec<String> = description.iter().map(|line| shown::text(line)).collect();
    outputs::print(&format!(
        "{}: {} cells, {unknowns} unknowns, {} steps\n{}\ncolumns: {}\n",
        shown::text(&named.file.name),
        cells,
        body.steps(),
        description.join("\n"),
        shown::text(&columns.join(", "))
    ))
}

fn about(named: &NamedProblem, body: &Body) -> Map<String, Value> {
    let mut about: Map<String, Value> = [
        ("problem", named.file.name.as_str()),
        ("problem_hash", &files::sha256(named.text.as_bytes())),
        ("mesh_hash", &files::sha256(&named.mesh)),
        ("version", VERSION),
        ("commit", COMMIT),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_owned(), Value::from(value)))
    .collect();
    about.insert("complete".into(), Value::from(body.done() == body.steps()));
    about
}

/// Files of the steps for ParaView.
struct Series {
    folder: PathBuf,
    existing: Existing,
    digits: usize,
    written: Vec<(f64, String)>,
}

impl Series {
    /// Refuses a folder that has one of the files already.
    fn new(folder: &Path, steps: usize, existing: Existing) -> Result<Self, Stop> {
        let series = Self {
            folder: folder.to_owned(),
            existing,
            digits: steps.to_string().len(),
            written: Vec::new(),
        };
        if folder.exists() && !folder.is_dir() {
            let path = shown::path(folder);
            let message = format!("--vtu {path}: is a file; name a folder");
            return Err(Stop::WrongInput(message));
        }
        if folder.exists() {
            let names = (0..=steps).map(|step| series.name(step));
            for name in names.chain([SERIES.to_owned()]) {
                let path = folder.join(name);
                outputs::check(&[("--vtu", Some(&path))], &[], existing)?;
            }
        }
        Ok(series)
    }

    fn name(&self, step: usize) -> String {
        format!("step-{step:0digits$}.vtu", digits = self.digits)
    }

    /// Writes the present state and the list of all so far.
    fn write(&mut self, body: &Body) -> Result<(), Stop> {
        let folder = &self.folder;
        fs::create_dir_all(folder).map_err(|error| outputs::cannot_write(folder, &error))?;
        let step = body.done();
        let name = self.name(step);
        let text = body
            .vtu()
            .map_err(|error| Stop::Failed(format!("--vtu: {error}")))?;
        outputs::write(Some(&folder.join(&name)), self.existing, &text)?;
        // Those of a run that is resumed are there already.
        for earlier in self.written.len()..step {
            let name = self.name(earlier);
            if folder.join(&name).exists() {
                self.written.push((earlier as f64, name));
            }
        }
        self.written.push((step as f64, name));
        let list: Vec<(f64, &str)> = self
            .written
            .iter()
            .map(|(step, name)| (*step, name.as_str()))
            .collect();
        let first = self.written.len() == 1;
        let over = if first {
            self.existing
        } else {
            Existing::Replaced
        };
        let path = folder.join(SERIES);
        outputs::write(Some(&path), over, &taxel_fem::output::pvd(&list)).map(drop)
    }
}
