//! A body of a problem file as the table of a sensor.

use crate::problem::{Body, Ended, ProblemFile};
use crate::transduction::{
    Batch, NoResponse, PointAnswer, PointEnd, Points, ResponseOptions, solve_response,
};
use taxel::solutions::{BodyDrawing, BodyOutput};
use taxel::transduction::{ResponseFile, ResponseTable, SketchPart, TableOutput, TableParameter};
use taxel_ground::quantity::AnyQuantity;
use taxel_ground::table::Cell;

/// A problem whose parameters are set point by point, each solved from rest.
struct Solved<'a> {
    drawing: &'a BodyDrawing,
    file: ProblemFile,
    /// Parameters of the file that are the load, in the order of the file, in which they are applied.
    loads: Vec<usize>,
    /// Which of them presses.
    pressing: usize,
    /// Columns whose sum is each output, the force first.
    outputs: Vec<Vec<usize>>,
    /// The section at rest.
    sketch: Vec<SketchPart>,
}

/// The table of a body over its load; `program` is what makes it, `progress` hears the fraction.
///
/// # Errors
/// [`NoResponse`].
pub fn tabulate_body(
    drawing: &BodyDrawing,
    options: ResponseOptions,
    points: &dyn Points,
    program: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<ResponseTable, NoResponse> {
    let solved = Solved::new(drawing).map_err(NoResponse::Problem)?;
    let mut file = solved.response_file();
    program.clone_into(&mut file.program);
    let batch = Batch {
        solve: &|at| solved.at(at),
        points,
        options,
    };
    solve_response(file, drawing.tolerance, &batch, progress)
}

/// The outputs of a body at one point of its load, in the order of the problem file, SI: the force, then the
/// channels.
///
/// # Errors
/// [`NoResponse`].
pub fn solve_point(drawing: &BodyDrawing, at: &[f64]) -> Result<Vec<f64>, NoResponse> {
    let solved = Solved::new(drawing).map_err(NoResponse::Problem)?;
    solved
        .at(at)
        .map_err(|end| NoResponse::Unsolved(end.reason))
}

impl<'a> Solved<'a> {
    fn new(drawing: &'a BodyDrawing) -> Result<Self, String> {
        let name = drawing.problem.as_str();
        let file = ProblemFile::parse(name, &drawing.files.text).map_err(|e| e.to_string())?;
        let mut loads = Vec::new();
        for load in &drawing.loads {
            let at = file.parameter.iter().position(|one| one.name == load.name);
            let at = at.ok_or_else(|| {
                let names: Vec<&str> = file.parameter.iter().map(|one| one.name.as_str()).collect();
                format!(
                    "{name} has no parameter \"{}\"\nhelp: give one of: {}",
                    load.name,
                    names.join(", ")
                )
            })?;
            let dimension = file.parameter[at].values.first().map(|one| one.dimension);
            if let Some(dimension) = dimension.filter(|dimension| dimension.si != load.unit) {
                return Err(format!(
                    "the parameter \"{}\" of {name} is {}, its range in the sensor file is in {}",
                    load.name, dimension.name, load.unit
                ));
            }
            loads.push(at);
        }
        loads.sort_unstable();
        let named = |at: &usize| file.parameter[*at].name == drawing.pressing;
        let pressing = loads.iter().position(named);
        let pressing =
            pressing.ok_or_else(|| format!("\"{}\" presses nothing", drawing.pressing))?;
        let mut solved = Self {
            drawing,
            file,
            loads,
            pressing,
            outputs: Vec::new(),
            sketch: Vec::new(),
        };
        let body = solved.body(&vec![0.0; solved.loads.len()])?;
        let columns: Vec<String> = body.columns().into_iter().map(|one| one.name).collect();
        let channels = drawing.channels.iter().map(|(_, output)| output);
        let outputs = std::iter::once(&drawing.force).chain(channels);
        let outputs: Result<_, _> = outputs.map(|one| solved.columns(one, &columns)).collect();
        solved.outputs = outputs?;
        solved.sketch = body.sketch();
        Ok(solved)
    }

    /// Columns whose sum is an output.
    fn columns(&self, output: &BodyOutput, columns: &[String]) -> Result<Vec<usize>, String> {
        let find = |name: &String| columns.iter().position(|column| column == name);
        let missing = |what: String, kind: &str| {
            let known: Vec<&str> = columns
                .iter()
                .map(String::as_str)
                .filter(|name| name.contains(kind))
                .collect();
            format!(
                "{} has no {what}\nhelp: it has {}",
                self.drawing.problem,
                if known.is_empty() {
                    "none".into()
                } else {
                    known.join(", ")
                }
            )
        };
        match output {
            BodyOutput::Column { name, .. } => {
                let kinds = ["_force_", "_reaction_", "_displacement_", "_resistance"];
                let kind = kinds.into_iter().find(|kind| name.contains(kind));
                let at = find(name)
                    .ok_or_else(|| missing(format!("output {name}"), kind.unwrap_or("")))?;
                Ok(vec![at])
            }
            BodyOutput::Capacitance(asked) => {
                let of = |one: &str, other: &str| format!("capacitance_{one}_{other}");
                let what = || {
                    missing(
                        format!("capacitance of {}", asked.join(" and ")),
                        "capacitance_",
                    )
                };
                if let [one, other] = &asked[..] {
                    let at = find(&of(one, other)).or_else(|| find(&of(other, one)));
                    return at.map(|at| vec![at]).ok_or_else(what);
                }
                let electrodes = self.file.capacitance.iter().flat_map(|of| &of.electrodes);
                let others: Vec<&str> = electrodes.map(|group| group.name.as_str()).collect();
                let found = asked.iter().flat_map(|one| {
                    let ground = find(&of(one, "ground"));
                    let pairs = others.iter().filter_map(|other| {
                        find(&of(one, other)).or_else(|| find(&of(other, one)))
                    });
                    pairs.chain(ground).collect::<Vec<_>>()
                });
                let found: Vec<usize> = found.collect();
                if found.is_empty() {
                    Err(what())
                } else {
                    Ok(found)
                }
            }
        }
    }

    fn response_file(&self) -> ResponseFile {
        let parameters = self.loads.iter().filter_map(|at| {
            let name = &self.file.parameter[*at].name;
            let load = self.drawing.loads.iter().find(|load| load.name == *name)?;
            Some(TableParameter {
                name: name.clone(),
                unit: load.unit.into(),
                range: load.range,
            })
        });
        let output = |name: &str, output: &BodyOutput| TableOutput {
            name: name.into(),
            unit: output.unit().into(),
        };
        let channels = self.drawing.channels.iter();
        let file = ResponseFile::new(
            self.drawing.lines(),
            parameters.collect(),
            self.pressing,
            std::iter::once(output("force", &self.drawing.force))
                .chain(channels.map(|(name, of)| output(name, of)))
                .collect(),
        );
        ResponseFile {
            sketch: self.sketch.clone(),
            ..file
        }
    }

    /// The steps to a point: what is no load first, then each parameter of the load alone.
    fn steps(&self, at: &[f64]) -> Vec<Vec<f64>> {
        let mut now = vec![0.0; self.file.parameter.len()];
        for (index, parameter) in self.file.parameter.iter().enumerate() {
            if !self.loads.contains(&index) {
                now[index] = parameter.values.last().map_or(0.0, |last| last.value);
            }
        }
        let mut steps = Vec::new();
        if now.iter().any(|value| *value != 0.0) {
            steps.push(now.clone());
        }
        for (load, value) in self.loads.iter().zip(at) {
            if *value != 0.0 {
                now[*load] = *value;
                steps.push(now.clone());
            }
        }
        steps
    }

    /// The body with the steps to a point.
    fn body(&self, at: &[f64]) -> Result<Body, String> {
        let mut steps = self.steps(at);
        if steps.is_empty() {
            steps.push(vec![0.0; self.file.parameter.len()]);
        }
        let mut file = self.file.clone();
        for (index, parameter) in file.parameter.iter_mut().enumerate() {
            let Some(dimension) = parameter.values.first().map(|one| one.dimension) else {
                continue;
            };
            let values = steps.iter().map(|step| AnyQuantity {
                value: step[index],
                dimension,
            });
            parameter.values = values.collect();
        }
        if !file.durations.is_empty() {
            // The answer to a sudden load.
            file.durations = vec![0.0; steps.len()];
        }
        let (name, mesh) = (&self.drawing.problem, self.file.mesh.file.clone());
        let problem = (name.as_str(), self.drawing.files.text.as_str());
        let mesh = (mesh.as_str(), self.drawing.files.mesh.as_slice());
        Body::new(file, problem, mesh).map_err(|error| error.to_string())
    }

    /// Outputs at a point.
    fn at(&self, at: &[f64]) -> PointAnswer {
        let ended = |reached: f64, reason: String| PointEnd { reached, reason };
        let mut body = self.body(at).map_err(|reason| ended(0.0, reason))?;
        let steps = self.steps(at);
        for step in &steps {
            match body.step(|_| true) {
                Ok(Ended::Done) => {}
                Ok(Ended::Stopped) => return Err(ended(0.0, "it was stopped".into())),
                Err(failure) => {
                    let own = self.loads[self.pressing];
                    let before = body
                        .done()
                        .checked_sub(1)
                        .map_or(0.0, |done| steps[done][own]);
                    let reason = body.explain(&failure);
                    // Where something else than the depth moves, no less of it helps.
                    let reached = before + failure.fraction * (step[own] - before);
                    return Err(ended(
                        if step[own] == before { 0.0 } else { reached },
                        reason,
                    ));
                }
            }
        }
        let row = body.cells().pop().unwrap_or_default();
        let number = |column: &usize| match row.get(*column) {
            Some(Cell::Number(value)) => *value,
            _ => f64::NAN,
        };
        let sums = self
            .outputs
            .iter()
            .map(|columns| columns.iter().map(number).sum());
        let mut outputs: Vec<f64> = sums.collect();
        outputs[0] *= self.drawing.sign;
        Ok(outputs)
    }
}
