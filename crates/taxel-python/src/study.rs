//! Design studies: designs by the arrays of their variables.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{AllowTypeChange, PyArrayLike2};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict};
use taxel_files::{self as files, Folder};
use taxel_study::answers::{Outcome, WAY_COLUMN};
use taxel_study::optimise::{self, Candidate};
use taxel_study::run::Runner;
use taxel_study::store::{Kept, Store, StoreError, key_of};
use taxel_study::study::{Row, SensorText, Status, Study as Posed, header};
use taxel_study::sweep;
use taxel_study::tolerance::{self, NoTolerance};

use crate::fault::{Fault, value_error};
use crate::pool::{self, Request};
use crate::table::Table;

/// Name and text of a study file, or of a shipped one.
#[pyfunction]
pub(crate) fn study_text(path: PathBuf) -> PyResult<(String, String)> {
    let found = files::study::text(&path).map_err(Fault::from)?;
    Ok((found.name, found.text))
}

/// A study, ready to evaluate designs.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Study {
    posed: Arc<Posed>,
    file: String,
    text: String,
    sensor: String,
}

/// A row as it travels between processes: point, state, reason and answers by kind and value.
type Carried = (Vec<f64>, String, String, Vec<(String, f64, String)>);

fn carried(row: &Row) -> Carried {
    let answers = row.answers.iter().map(|outcome| match outcome {
        Outcome::Number(number) => ("number".into(), *number, String::new()),
        // A word has no number; one that is not a number would not be equal to itself.
        Outcome::Word(word) => ("word".into(), 0.0, word.clone()),
        Outcome::Outside(why) => ("outside".into(), f64::NAN, why.clone()),
        Outcome::Ended(why) => ("ended".into(), f64::NAN, why.clone()),
        Outcome::None => ("none".into(), f64::NAN, String::new()),
    });
    (
        row.point.clone(),
        row.status.name().into(),
        row.reason.clone(),
        answers.collect(),
    )
}

fn arrived((point, status, reason, answers): Carried) -> Result<Row, Fault> {
    let strange = || {
        Fault::Wrong(String::from(
            "a worker answered with something that is no design",
        ))
    };
    let answers = answers
        .into_iter()
        .map(|(kind, number, text)| match kind.as_str() {
            "number" => Ok(Outcome::Number(number)),
            "word" => Ok(Outcome::Word(text)),
            "outside" => Ok(Outcome::Outside(text)),
            "ended" => Ok(Outcome::Ended(text)),
            "none" => Ok(Outcome::None),
            _ => Err(strange()),
        });
    let answers = answers.collect::<Result<_, _>>()?;
    let status = Status::of(&status).ok_or_else(strange)?;
    Ok(Row {
        point,
        status,
        reason,
        answers,
    })
}

/// What calls Python from within work: designs that other processes compute.
struct Workers<'a> {
    submit: &'a Py<PyAny>,
    /// The first exception.
    raised: Mutex<Option<PyErr>>,
}

impl Workers<'_> {
    fn compute(&self, points: &[Vec<f64>], request: Request<'_>) -> Vec<Option<Row>> {
        let computed = Python::attach(|py| -> Result<Vec<Option<Row>>, Fault> {
            let flag = request.flag();
            let stopped = PyCFunction::new_closure(py, None, None, move |_, _| {
                PyResult::Ok(flag.load(Ordering::Relaxed))
            })?;
            let rows = self.submit.call1(py, (points.to_vec(), stopped))?;
            let rows: Vec<Option<Carried>> = rows.extract(py)?;
            let row = |row: Option<Carried>| row.map(arrived).transpose();
            rows.into_iter().map(row).collect()
        });
        computed.unwrap_or_else(|fault| {
            let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
            raised.get_or_insert_with(|| fault.into());
            vec![None; points.len()]
        })
    }

    fn failed(&self) -> bool {
        self.raised
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .is_some()
    }
}

impl Study {
    fn store(&self, folder: Option<&Path>, designs: usize) -> Result<Option<Store>, Fault> {
        let Some(folder) = folder else {
            return Ok(None);
        };
        let block = files::study::block(&self.posed, &self.text, designs);
        let store = Store::open(folder, block, &self.text)?;
        if store.damaged > 0 {
            let folder = taxel::shown::path(folder);
            let note = format!(
                "{} damaged blocks in {folder}: their designs are computed again",
                store.damaged
            );
            crate::warn(&note);
        }
        Ok(Some(store))
    }

    /// Does `work` with a runner that stops when the user asks, and that asks other processes
    /// where `submit` is given.
    fn running<T: Send>(
        &self,
        py: Python<'_>,
        store: Option<Store>,
        submit: Option<&Py<PyAny>>,
        work: impl FnOnce(&mut Runner<'_>) -> Result<T, StoreError> + Send,
    ) -> PyResult<(T, usize)> {
        let workers = submit.map(|submit| Workers {
            submit,
            raised: Mutex::new(None),
        });
        let found = pool::run(py, |request: Request<'_>| {
            let failed = || workers.as_ref().is_some_and(Workers::failed);
            let stop = || request.asked() || failed();
            let compute = |points: &[Vec<f64>]| {
                Ok(workers
                    .as_ref()
                    .map_or_else(Vec::new, |workers| workers.compute(points, request)))
            };
            let mut runner = Runner {
                store,
                stop: &stop,
                ..Runner::new(&self.posed)
            };
            if workers.is_some() {
                runner.elsewhere = Some(&compute);
            }
            let found = work(&mut runner)?;
            Ok((found, runner.computed))
        });
        if let Some(raised) = workers.and_then(|workers| workers.raised.into_inner().ok().flatten())
        {
            return Err(raised);
        }
        found
    }

    fn table(&self, rows: &[Row]) -> Table {
        let (columns, cells) = sweep::all(&self.posed, rows);
        Table::of_rows(columns, &cells)
    }

    fn points(&self, points: &PyArrayLike2<'_, f64, AllowTypeChange>) -> PyResult<Vec<Vec<f64>>> {
        let points = points.as_array();
        let (expected, found) = (self.posed.variables.len(), points.ncols());
        if found != expected {
            let names: Vec<_> = self
                .posed
                .variables
                .iter()
                .map(|one| one.name.as_str())
                .collect();
            let message = format!(
                "points have {found} columns; the study varies {expected}: {}",
                names.join(", ")
            );
            return Err(value_error(message));
        }
        if let Some(number) = points.iter().find(|number| !number.is_finite()) {
            return Err(value_error(format!(
                "a point holds {number}; give finite numbers in SI"
            )));
        }
        Ok(points.rows().into_iter().map(|row| row.to_vec()).collect())
    }
}

#[pymethods]
impl Study {
    #[new]
    #[pyo3(signature = (file, text, sensor = None))]
    fn new(
        py: Python<'_>,
        file: String,
        text: String,
        sensor: Option<(String, String)>,
    ) -> PyResult<Self> {
        pool::run(py, move |_| {
            let head = header(&file, &text)?;
            let (name, sensor) = if let Some(sensor) = sensor {
                sensor
            } else {
                let path = files::study::sensor_path(Path::new(&file), &head.sensor);
                let text = files::study::sensor_text(&file, &path)?;
                (head.sensor, text)
            };
            let solutions =
                Box::new(|| Box::new(Folder::of_user()) as Box<dyn taxel::solutions::Solutions>);
            let named = SensorText {
                name: &name,
                text: &sensor,
            };
            let posed = Posed::parse(&file, &text, &named, solutions)?;
            Ok(Self {
                posed: Arc::new(posed),
                file,
                text,
                sensor,
            })
        })
    }

    #[getter]
    fn file(&self) -> &str {
        &self.file
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// Name and text of the sensor that is varied.
    #[getter]
    fn sensor(&self) -> (String, String) {
        (self.posed.sensor.clone(), self.sensor.clone())
    }

    #[getter]
    fn name(&self) -> &str {
        &self.posed.name
    }

    /// Name and key of each variable.
    fn variables(&self) -> Vec<(String, String)> {
        let variables = self.posed.variables.iter();
        variables
            .map(|one| {
                let key = one.key.as_ref();
                (
                    one.name.clone(),
                    key.map_or_else(String::new, |key| key.text.clone()),
                )
            })
            .collect()
    }

    fn answers(&self) -> Vec<String> {
        // What the study asks: which way answered is no question of it.
        let asked = self.posed.answers.iter();
        let asked = asked.filter(|one| one.name != WAY_COLUMN);
        asked.map(|one| one.name.clone()).collect()
    }

    /// The words, where a variable has words: a point holds the index.
    fn words(&self) -> Vec<Option<Vec<String>>> {
        let variables = self.posed.variables.iter();
        variables
            .map(|one| match &one.values {
                taxel_study::study::Values::Words(words) => Some(
                    words
                        .iter()
                        .map(|word| {
                            word.as_str()
                                .map_or_else(|| word.to_string(), str::to_owned)
                        })
                        .collect(),
                ),
                _ => None,
            })
            .collect()
    }

    /// The drawn design, SI.
    fn nominal(&self) -> Vec<f64> {
        self.posed.nominal()
    }

    /// The sensor file of a design.
    fn sensor_of(&self, point: Vec<f64>) -> PyResult<String> {
        if point.len() != self.posed.variables.len() {
            return Err(value_error(format!(
                "a point of this study has {} numbers",
                self.posed.variables.len()
            )));
        }
        Ok(self.posed.text_of(&point).0)
    }

    /// Rows of designs that a worker computes and keeps.
    #[pyo3(signature = (points, store = None))]
    fn evaluate(
        &self,
        py: Python<'_>,
        points: PyArrayLike2<'_, f64, AllowTypeChange>,
        store: Option<PathBuf>,
    ) -> PyResult<Vec<Option<Carried>>> {
        let points = self.points(&points)?;
        let kept = self.store(store.as_deref(), points.len())?;
        let (rows, _) = self.running(py, kept, None, |runner| runner.rows(&points))?;
        Ok(rows.iter().map(|row| row.as_ref().map(carried)).collect())
    }

    /// Keeps rows in a store.
    fn keep(&self, rows: Vec<Carried>, store: PathBuf) -> PyResult<()> {
        let rows = rows
            .into_iter()
            .map(arrived)
            .collect::<Result<Vec<_>, _>>()?;
        let Some(mut kept) = self.store(Some(&store), rows.len())? else {
            return Ok(());
        };
        let designs = rows.into_iter().filter_map(|row| {
            let key = key_of(&self.posed.content(&row.point));
            let known = kept.kept(&key).is_some();
            let Row {
                status,
                reason,
                answers,
                ..
            } = row;
            (!known).then_some((
                key,
                Kept {
                    status,
                    reason,
                    answers,
                },
            ))
        });
        let designs: Vec<_> = designs.collect();
        Ok(kept.keep(designs).map_err(Fault::from)?)
    }

    /// The table of rows.
    fn table_of(&self, rows: Vec<Carried>) -> PyResult<Table> {
        let rows = rows
            .into_iter()
            .map(arrived)
            .collect::<Result<Vec<_>, _>>()?;
        Ok(self.table(&rows))
    }

    /// The designs of the plan; their table and how many were computed, not found.
    #[pyo3(signature = (store = None, submit = None))]
    fn sweep(
        &self,
        py: Python<'_>,
        store: Option<PathBuf>,
        submit: Option<Py<PyAny>>,
    ) -> PyResult<(Table, usize)> {
        let list = if self.posed.sweep.is_list() {
            let path = files::study::beside(Path::new(&self.file), &self.posed.sweep.plan);
            Some(files::text(&path).map_err(Fault::from)?)
        } else {
            None
        };
        let points = sweep::designs(&self.posed, list.as_deref()).map_err(Fault::from)?;
        let kept = self.store(store.as_deref(), points.len())?;
        let (rows, computed) =
            self.running(py, kept, submit.as_ref(), |runner| runner.rows(&points))?;
        let rows: Vec<Row> = rows.into_iter().flatten().collect();
        // As the command: the columns that the study names.
        let (columns, cells) = sweep::table(&self.posed, &rows);
        Ok((Table::of_rows(columns, &cells), computed))
    }

    /// Front, dominated designs and what is said of them.
    #[pyo3(signature = (seed = None, evaluations = None, store = None, submit = None))]
    fn optimize<'py>(
        &self,
        py: Python<'py>,
        seed: Option<u64>,
        evaluations: Option<usize>,
        store: Option<PathBuf>,
        submit: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut again;
        let this = if seed.is_some() || evaluations.is_some() {
            // Another search of the same study.
            again = self.again(py)?;
            let posed =
                Arc::get_mut(&mut again.posed).ok_or_else(|| value_error("the study is in use"))?;
            posed.optimize.seed = seed.unwrap_or(posed.optimize.seed);
            if let Some(evaluations) = evaluations {
                if !(8..=10_000_000).contains(&evaluations) {
                    return Err(value_error("evaluations: must be from 8 to 10000000"));
                }
                posed.optimize.evaluations = evaluations;
            }
            &again
        } else {
            self
        };
        let posed = &this.posed;
        optimise::possible(posed, &self.file).map_err(Fault::from)?;
        let kept = this.store(store.as_deref(), posed.optimize.population * 64)?;
        let (found, computed) = this.running(py, kept, submit.as_ref(), optimise::optimise)?;
        let rows =
            |list: &[Candidate]| -> Vec<Row> { list.iter().map(|one| one.row.clone()).collect() };
        let given = PyDict::new(py);
        given.set_item("front", this.table(&rows(&found.front)))?;
        given.set_item("dominated", this.table(&rows(&found.dominated)))?;
        given.set_item(
            "points",
            rows(&found.front)
                .iter()
                .map(|row| row.point.clone())
                .collect::<Vec<_>>(),
        )?;
        given.set_item("evaluations", found.evaluations)?;
        given.set_item("computed", computed)?;
        let active = found
            .front
            .first()
            .map_or_else(Vec::new, |best| optimise::active(posed, best));
        given.set_item(
            "active",
            active.iter().map(ToString::to_string).collect::<Vec<_>>(),
        )?;
        Ok(given)
    }

    /// What becomes of made devices: answer, quantity, of which spread, value, error, interval,
    /// SI unit.
    #[pyo3(signature = (seed = None, samples = None, after = None, store = None))]
    fn tolerance<'py>(
        &self,
        py: Python<'py>,
        seed: Option<u64>,
        samples: Option<usize>,
        after: Option<&str>,
        store: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut study = self.again(py)?;
        let posed =
            Arc::get_mut(&mut study.posed).ok_or_else(|| value_error("the study is in use"))?;
        posed.tolerance.seed = seed.unwrap_or(posed.tolerance.seed);
        if let Some(samples) = samples {
            if !(2..=1 << 24).contains(&samples) {
                return Err(value_error("samples: must be from 2 to 16777216"));
            }
            posed.tolerance.samples = samples;
        }
        if let Some(after) = after {
            use taxel_study::file::AfterFile;
            let all = [AfterFile::AsDrawn, AfterFile::Rest, AfterFile::Bench];
            let found = all
                .into_iter()
                .find(|one| tolerance::after_name(*one) == after);
            posed.tolerance.after = found.ok_or_else(|| {
                let names = all.map(tolerance::after_name).join(", ");
                Fault::Wrong(format!(
                    "after: \"{after}\" is not one of the words\nhelp: use one of: {names}"
                ))
            })?;
        }
        let posed = &study.posed;
        let kept = study.store(store.as_deref(), tolerance::devices(posed))?;
        let (found, computed) = study.running(py, kept, None, tolerance::tolerance_by)?;
        let found = match found {
            Ok(found) => Some(found),
            Err(NoTolerance::Stopped) => None,
            Err(error) => return Err(Fault::Wrong(format!("{}: {error}", self.file)).into()),
        };
        let given = PyDict::new(py);
        // A stop raises its own exception.
        let Some(found) = found else { return Ok(given) };
        let (columns, rows) = tolerance::table(posed, &found);
        given.set_item("table", Table::of_rows(columns, &rows))?;
        given.set_item("computed", computed)?;
        given.set_item("devices", found.devices)?;
        given.set_item("failed", found.failed)?;
        given.set_item("reasons", &found.reasons)?;
        given.set_item(
            "tighten_first",
            found.tightened.first().map(|one| one.variable.clone()),
        )?;
        Ok(given)
    }

    /// The same study once more.
    fn again(&self, py: Python<'_>) -> PyResult<Self> {
        Self::new(
            py,
            self.file.clone(),
            self.text.clone(),
            Some(self.sensor()),
        )
    }
}
