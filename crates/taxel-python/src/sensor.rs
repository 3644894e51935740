//! The sensor: what its file says, what follows from it, what a load reads.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rayon::prelude::*;
use taxel::information::{InformationOptions, RadiusKnowledge};
use taxel::mechanics::Mechanics;
use taxel::predict::{LoadColumn, LoadKind, LoadRefused, Loads, Predictor};
use taxel::summary::{Value, summary};
use taxel::table::{Cell, Column};
use taxel::{InputError, quantity, shown};
use taxel_files::{self as files, NamedSensor};

use crate::fault::{Fault, value_error};
use crate::loads::{LOAD, loads};
use crate::pool::{self, Request};
use crate::table::{Filled, Part, Piece, Table, Values, si_symbol};

/// Loads that are answered without leaving the thread: fewer than it takes longer to ask others.
const FEW: usize = 256;
/// Loads that one core answers at a time.
const PIECE: usize = 4096;
/// Loads whose answers are put into their columns together: they stay within the first cache.
const BLOCK: usize = 24;

/// Name and text of a sensor file, or of a shipped one.
#[pyfunction]
pub(crate) fn sensor_text(path: PathBuf) -> PyResult<(String, String)> {
    Ok(files::sensor_text(&path).map_err(Fault::from)?)
}

/// Text of a file.
#[pyfunction]
pub(crate) fn read_text(path: PathBuf) -> PyResult<String> {
    Ok(files::text(&path).map_err(Fault::from)?)
}

/// Writes a file: all of it or nothing.
#[pyfunction]
pub(crate) fn write_text(path: PathBuf, text: &str) -> PyResult<()> {
    Ok(files::outputs::replace(&path, text).map_err(Fault::from)?)
}

/// Names of what is shipped, by kind.
#[pyfunction]
pub(crate) fn shipped(kind: &str) -> PyResult<Vec<&'static str>> {
    match kind {
        "sensor" => Ok(taxel::sensor::Sensor::shipped_names().collect()),
        "stimulus" => Ok(taxel::acquisition::Stimulus::shipped_names().collect()),
        "study" => Ok(taxel_study::shipped_names().collect()),
        _ => Err(value_error(
            "shipped: give \"sensor\", \"stimulus\" or \"study\"",
        )),
    }
}

/// A sensor as its file describes it.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Sensor {
    pub(crate) named: Arc<NamedSensor>,
    /// By the mechanics of the file, once it was asked for.
    predictor: OnceLock<Box<dyn Predictor>>,
}

impl Sensor {
    fn of(named: NamedSensor) -> Self {
        Self {
            named: Arc::new(named),
            predictor: OnceLock::new(),
        }
    }

    /// The sensor with the values of a calibration: its name and text.
    pub(crate) fn calibrated(
        &self,
        calibration: Option<&(String, String)>,
    ) -> Result<NamedSensor, Fault> {
        let named = NamedSensor::clone(&self.named);
        Ok(match calibration {
            Some((name, text)) => files::applied_text(named, name, text)?,
            None => named,
        })
    }

    fn predictor_of(
        &self,
        mechanics: Option<Mechanics>,
        calibration: Option<&(String, String)>,
    ) -> Result<Box<dyn Predictor>, Fault> {
        let of = |sensor: &taxel::sensor::Sensor| -> Result<_, Fault> {
            Ok(files::predictor(sensor, mechanics.as_ref())?)
        };
        let Some((name, text)) = calibration else {
            return of(&self.named.sensor);
        };
        let calibrated = self.calibrated(calibration)?;
        files::propagated_text(of(&calibrated.sensor)?, &self.named, name, text, of)
    }
}

/// Where loads come from.
enum Given<'a, 'py> {
    Values(&'a Bound<'py, PyDict>),
    Words(&'a str),
    File(&'a Path),
}

impl Given<'_, '_> {
    fn read(&self, columns: &[LoadColumn]) -> Result<Loads, Fault> {
        match self {
            Self::Values(values) => loads(values, columns),
            Self::Words(spec) => Ok(Loads::one(spec, columns)?),
            Self::File(path) => {
                let text = files::text(path)?;
                Ok(Loads::parse(&shown::path(path), &text, columns)?)
            }
        }
    }

    /// A load without meaning, at its place.
    fn refused(
        &self,
        row: usize,
        count: usize,
        line: usize,
        why: &LoadRefused,
        columns: &[LoadColumn],
    ) -> Fault {
        let key = columns.get(why.column).map_or("", |column| column.name);
        let (file, message) = match self {
            Self::File(path) => (shown::path(path), format!("line {line}: {}", why.message)),
            Self::Words(_) => (String::from("--load"), why.message.clone()),
            Self::Values(_) if count > 1 => (LOAD.into(), format!("value {row}: {}", why.message)),
            Self::Values(_) => (LOAD.into(), why.message.clone()),
        };
        InputError::whole(&file, message)
            .key(key)
            .help(&why.help)
            .into()
    }
}

/// Answers to loads in columns.
fn answers(
    predictor: &dyn Predictor,
    loads: &Loads,
    given: &Given<'_, '_>,
    py: Python<'_>,
) -> PyResult<Table> {
    let others = loads.given.others.iter().map(Column::plain);
    let columns: Vec<Column> = others.chain(predictor.columns()).collect();
    let width = columns.len();
    let has_others = !loads.given.others.is_empty();
    // Appends a row.
    let answer = |index: usize, rows: &mut Vec<Cell>| {
        let before = rows.len();
        if has_others {
            rows.extend(loads.others(index).iter().cloned().map(Cell::from));
        }
        let answered = predictor.answer(&loads.load(index), rows);
        debug_assert!(answered.is_err() || rows.len() == before + width);
        answered.map_err(|why| (index, why))
    };
    let count = loads.len();
    let mut first = Vec::with_capacity(width);
    let found: Result<Vec<Values>, (usize, LoadRefused)> = if count <= FEW {
        let mut values: Vec<Values> = (0..width).map(|_| Values::Nothing).collect();
        let mut row = first;
        let mut fill = || {
            for index in 0..count {
                row.clear();
                answer(index, &mut row)?;
                let cells = values.iter_mut().zip(&row);
                cells.for_each(|(values, cell)| values.push(cell));
            }
            Ok(())
        };
        fill().map(|()| values)
    } else if let Err(refused) = answer(0, &mut first) {
        Err(refused)
    } else {
        let mut filled = Filled::new(py, &first, count, PIECE)?;
        let pieces = filled.pieces();
        let parts = pool::run(py, |request: Request<'_>| {
            let fill = |(number, mut piece): (usize, Vec<Piece<'_>>)| {
                request.leave();
                let mut rows = Vec::with_capacity(BLOCK * width);
                let end = ((number + 1) * PIECE).min(count);
                for start in (number * PIECE..end).step_by(BLOCK) {
                    rows.clear();
                    for index in start..(start + BLOCK).min(end) {
                        answer(index, &mut rows)?;
                    }
                    for (column, piece) in piece.iter_mut().enumerate() {
                        piece.extend(&rows, column, width);
                    }
                }
                Ok(piece.into_iter().map(Piece::part).collect())
            };
            let pieces = pieces.into_par_iter().enumerate();
            let parts: Vec<Result<Vec<Part>, _>> = pieces.map(fill).collect();
            // Of several loads without meaning the first one.
            Ok(parts.into_iter().collect::<Result<Vec<Vec<Part>>, _>>())
        })?;
        parts.map(|parts| filled.values(parts))
    };
    let found = found.map_err(|(index, why)| {
        given.refused(
            index,
            count,
            loads.line(index),
            &why,
            predictor.load_columns(),
        )
    })?;
    Ok(Table::new(columns, found, count))
}

/// The mechanics of this name.
fn mechanics_of(name: Option<&str>) -> PyResult<Option<Mechanics>> {
    match name {
        None => Ok(None),
        Some("closed_form" | "closed-form") => Ok(Some(Mechanics::ClosedForm)),
        Some("fem") => Ok(Some(Mechanics::Fem)),
        Some(other) => Err(Fault::Wrong(format!(
            "mechanics: \"{other}\" is not one of the words\nhelp: use one of: closed_form, fem"
        ))
        .into()),
    }
}

#[pymethods]
impl Sensor {
    #[new]
    fn new(py: Python<'_>, name: String, text: String) -> PyResult<Self> {
        pool::run(py, move |_| {
            Ok(Self::of(files::sensor_of_text(&name, text)?))
        })
    }

    #[getter]
    fn file(&self) -> &str {
        &self.named.name
    }

    #[getter]
    fn text(&self) -> &str {
        &self.named.text
    }

    #[getter]
    fn hash(&self) -> &str {
        &self.named.hash
    }

    #[getter]
    fn name(&self) -> &str {
        &self.named.sensor.name
    }

    #[getter]
    fn element(&self) -> &'static str {
        self.named.sensor.element.key()
    }

    #[getter]
    fn shape(&self) -> (usize, usize) {
        let array = &self.named.sensor.array;
        (array.rows, array.columns)
    }

    /// Position and normal of each taxel, m: lists of (x, y, z).
    fn poses(&self) -> Vec<([f64; 3], [f64; 3])> {
        let layout = self.named.sensor.layout();
        layout
            .frames
            .iter()
            .map(|frame| (frame.position, frame.normal))
            .collect()
    }

    /// Group, name, value, SI unit and source of each number that follows.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let facts = summary(&self.named.sensor).map_err(|error| Fault::Wrong(error.to_string()))?;
        let list = PyList::empty(py);
        for fact in facts {
            let head = (fact.group, fact.name);
            match fact.value {
                Value::Number {
                    si,
                    key,
                    unit,
                    scale,
                } => {
                    let column = Column::new("", unit, scale, key, 0);
                    list.append((head.0, head.1, si, si_symbol(&column), fact.source))?;
                }
                Value::Text(text) => list.append((head.0, head.1, text, "", fact.source))?,
            }
        }
        Ok(list)
    }

    /// The drawing to scale, SVG.
    fn drawing(&self) -> PyResult<String> {
        let device = self.named.sensor.device();
        let device = device.map_err(|error| Fault::Wrong(error.to_string()))?;
        Ok(device.drawing().svg())
    }

    /// Name, short name, SI unit and meaning of each load that the device takes.
    fn load_columns(
        &self,
    ) -> PyResult<Vec<(&'static str, &'static str, &'static str, &'static str)>> {
        let predictor = files::predictor(&self.named.sensor, None).map_err(Fault::from)?;
        let unit = |column: &LoadColumn| match column.kind {
            LoadKind::Quantity(dimension, _) => dimension.si,
            LoadKind::Number(_) | LoadKind::Word(_) => "",
        };
        let columns = predictor.load_columns().iter();
        Ok(columns
            .map(|column| (column.name, column.short, unit(column), column.about))
            .collect())
    }

    /// Answers to loads.
    #[pyo3(signature = (values = None, spec = None, file = None, mechanics = None, calibration = None))]
    fn predict(
        &self,
        py: Python<'_>,
        values: Option<Bound<'_, PyDict>>,
        spec: Option<&str>,
        file: Option<PathBuf>,
        mechanics: Option<&str>,
        calibration: Option<(String, String)>,
    ) -> PyResult<Table> {
        let given = match (&values, spec, &file) {
            (_, None, Some(file)) => Given::File(file),
            (_, Some(spec), None) => Given::Words(spec),
            (Some(values), None, None) => Given::Values(values),
            _ => {
                return Err(value_error(
                    "give loads in one way: by name, load= or loads=",
                ));
            }
        };
        let mechanics = mechanics_of(mechanics)?;
        let fem = *mechanics.as_ref().unwrap_or(&self.named.sensor.mechanics) == Mechanics::Fem;
        if mechanics.is_none() && calibration.is_none() && !fem {
            let predictor = if let Some(predictor) = self.predictor.get() {
                predictor
            } else {
                let made = files::predictor(&self.named.sensor, None).map_err(Fault::from)?;
                self.predictor.get_or_init(|| made)
            };
            let loads = given.read(predictor.load_columns())?;
            checked(predictor.as_ref(), &loads)?;
            return answers(predictor.as_ref(), &loads, &given, py);
        }
        let mut predictor = self.predictor_of(mechanics, calibration.as_ref())?;
        let loads = given.read(predictor.load_columns())?;
        checked(predictor.as_ref(), &loads)?;
        if fem {
            let (asked, made) = (&loads, &mut predictor);
            let remark = pool::run(py, |request| {
                let mut progress = |_: f64| request.leave();
                made.prepare(asked, &mut progress).map_err(Fault::Solve)
            })?;
            if let Some(remark) = remark {
                crate::warn(&remark);
            }
        }
        answers(predictor.as_ref(), &loads, &given, py)
    }

    /// Seconds that the library alone takes for the answers of [`Self::predict`]: when each is
    /// thrown away, and when their numbers are kept in columns.
    fn library_seconds(&self, py: Python<'_>, values: Bound<'_, PyDict>) -> PyResult<[f64; 2]> {
        let predictor = files::predictor(&self.named.sensor, None).map_err(Fault::from)?;
        let loads = loads(&values, predictor.load_columns())?;
        let seconds = |keep: bool| -> PyResult<f64> {
            let start = std::time::Instant::now();
            pool::run(py, |_| {
                let starts: Vec<usize> = (0..loads.len()).step_by(PIECE).collect();
                let kept = starts.par_iter().map(|start| {
                    let (mut row, mut columns) = (Vec::new(), Vec::new());
                    for index in *start..(start + PIECE).min(loads.len()) {
                        row.clear();
                        // What is refused is answered, too.
                        let _ = predictor.answer(&loads.load(index), &mut row);
                        std::hint::black_box(&row);
                        if keep {
                            columns.resize_with(row.len(), || Vec::with_capacity(PIECE));
                            for (column, cell) in columns.iter_mut().zip(&row) {
                                column.push(match cell {
                                    Cell::Number(number) => *number,
                                    Cell::Whole(whole) => *whole as f64,
                                    Cell::Text(_) | Cell::State(_) | Cell::Missing => f64::NAN,
                                });
                            }
                        }
                    }
                    columns
                });
                std::hint::black_box(kept.collect::<Vec<Vec<Vec<f64>>>>());
                Ok(())
            })?;
            Ok(start.elapsed().as_secs_f64())
        };
        Ok([seconds(false)?, seconds(true)?])
    }

    /// What one frame says of a load.
    #[pyo3(signature = (values = None, spec = None, noise = None, radius = None))]
    fn information<'py>(
        &self,
        py: Python<'py>,
        values: Option<Bound<'py, PyDict>>,
        spec: Option<&str>,
        noise: Option<Bound<'py, PyAny>>,
        radius: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let sensor = &self.named.sensor;
        let device = sensor
            .device()
            .map_err(|error| Fault::Wrong(error.to_string()))?;
        let columns = device.information_loads();
        let loads = match (&values, spec) {
            (_, Some(spec)) => Loads::one(spec, columns).map_err(Fault::from)?,
            (Some(values), None) => loads(values, columns)?,
            (None, None) => return Err(value_error("give a load")),
        };
        if loads.len() != 1 {
            let message = "information: give one load; ask once for each of several";
            return Err(value_error(message));
        }
        let noise = noise
            .map(|noise| sized(&noise, "noise", device.information_noise()))
            .transpose()?;
        let radius = match radius {
            None => RadiusKnowledge::Known,
            Some(word) if word.extract::<&str>().is_ok_and(|word| word == "known") => {
                RadiusKnowledge::Known
            }
            Some(word) if word.extract::<&str>().is_ok_and(|word| word == "unknown") => {
                RadiusKnowledge::Unknown
            }
            Some(ends) => {
                let ends: [Bound<'_, PyAny>; 2] = ends.extract().map_err(|_| {
                    value_error(
                        "radius: give \"known\", \"unknown\" or the least and the greatest length",
                    )
                })?;
                let [least, greatest] = ends.map(|end| sized(&end, "radius", &quantity::LENGTH));
                RadiusKnowledge::Between([least?, greatest?])
            }
        };
        let options = InformationOptions { noise, radius };
        let found = device
            .information(&loads.load(0), &options)
            .map_err(|error| Fault::Wrong(error.to_string()))?;
        let row = PyDict::new(py);
        row.set_item("jacobian", &found.jacobian)?;
        row.set_item("noise", &found.noise)?;
        row.set_item("fisher", found.fisher())?;
        row.set_item("covariance", found.covariance())?;
        row.set_item("condition", found.condition())?;
        row.set_item("a_criterion", found.a_criterion())?;
        row.set_item("d_criterion", found.d_criterion())?;
        row.set_item("e_criterion", found.e_criterion())?;
        row.set_item("place_deviation", found.place_deviation())?;
        let names = found
            .unknowns
            .iter()
            .map(|one| (one.name, one.dimension.si, one.beside));
        row.set_item("unknowns", names.collect::<Vec<_>>())?;
        Ok(row)
    }
}

/// A number in SI, or a text with its unit.
fn sized(value: &Bound<'_, PyAny>, key: &str, dimension: &quantity::Dimension) -> PyResult<f64> {
    let wrong = |message: String| PyErr::from(Fault::Wrong(format!("{key}: {message}")));
    let number = if let Ok(number) = value.extract::<f64>() {
        number
    } else {
        let text: String = value.extract().map_err(|_| {
            wrong(String::from(
                "must be a number in SI or a text with its unit",
            ))
        })?;
        dimension.parse(&text).map_err(wrong)?
    };
    let [least, greatest] = dimension.sizes;
    if (least..=greatest).contains(&number) {
        return Ok(number);
    }
    Err(wrong(format!(
        "{number} is out of range: must be from {least:e} to {greatest:e} {}",
        dimension.si
    )))
}

/// Refuses columns that do not say together what is needed.
fn checked(predictor: &dyn Predictor, loads: &Loads) -> PyResult<()> {
    let combination = predictor.combination(&loads.given.columns);
    Ok(combination.map_err(|message| Fault::from(InputError::whole(LOAD, message)))?)
}
