//! Frames of the twin and of recordings, and what an estimator makes of them.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::ndarray::{Array, Array1, Array2, Array3, Array4};
use numpy::{AllowTypeChange, IntoPyArray, PyArrayLike1, PyArrayLike2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use taxel::acquisition::{Delivery, Frame, Stimulus, Stream, Twin as Simulation};
use taxel::estimation::{Contact, Continuity, FrameError, TouchEvent, TouchSession};
use taxel_files as files;
use taxel_recording::{Columns, RecordingOptions};
use taxel_serve::{Next, ReplaySource, Source as _};

use crate::fault::{Fault, value_error};
use crate::pool::{self, Request};
use crate::sensor::Sensor;

/// Most frames of one call: a year at 60 frames/s would not fit into memory either.
const MOST_FRAMES: usize = 1 << 27;

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Number, device time and values of frames as arrays.
fn arrays(py: Python<'_>, frames: Vec<Frame>, channels: usize) -> PyResult<Bound<'_, PyDict>> {
    let count = frames.len();
    let sequence: Array1<u64> = frames.iter().map(|frame| frame.sequence).collect();
    let time: Array1<i64> = frames
        .iter()
        .map(|frame| frame.time_ns.cast_signed())
        .collect();
    let mut values = Vec::with_capacity(count * channels);
    for frame in frames {
        values.extend_from_slice(&frame.values);
    }
    let values = Array2::from_shape_vec((count, channels), values)
        .map_err(|error| Fault::Frame(format!("frames of different lengths: {error}")))?;
    let found = PyDict::new(py);
    found.set_item("sequence", sequence.into_pyarray(py))?;
    found.set_item("time_ns", time.into_pyarray(py))?;
    found.set_item("values", values.into_pyarray(py))?;
    Ok(found)
}

fn described<'py>(py: Python<'py>, stream: &Stream) -> PyResult<Bound<'py, PyDict>> {
    let about = PyDict::new(py);
    about.set_item("name", &stream.name)?;
    about.set_item("shape", (stream.rows, stream.columns))?;
    about.set_item("channels_per_taxel", stream.channels_per_taxel)?;
    about.set_item("quantity", stream.unit.quantity.name())?;
    about.set_item("unit", &*stream.unit.symbol)?;
    about.set_item("pitch", stream.pitch)?;
    about.set_item("period", stream.period)?;
    Ok(about)
}

/// The simulated twin under a stimulus.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Twin {
    simulation: Mutex<Simulation>,
    stream: Stream,
}

#[pymethods]
impl Twin {
    /// `script` is a shipped name or a file; None plays the usual one.
    #[new]
    fn new(
        py: Python<'_>,
        sensor: &Sensor,
        script: Option<String>,
        text: Option<String>,
        seed: u64,
    ) -> PyResult<Self> {
        let named = &sensor.named;
        let name = script.unwrap_or_else(|| named.sensor.element.usual_script().to_owned());
        pool::run(py, move |_| {
            let text = match (text, Stimulus::shipped_text(&name)) {
                (Some(text), _) => text,
                (None, Some(text)) if !Path::new(&name).exists() => text.to_owned(),
                _ => files::text(Path::new(&name))?,
            };
            let stimulus = Stimulus::parse(&name, &text)?;
            let simulation = Simulation::new(&named.sensor, &stimulus, seed)
                .map_err(|message| Fault::Wrong(format!("{name}: {message}")))?;
            Ok(Self {
                stream: simulation.stream(),
                simulation: Mutex::new(simulation),
            })
        })
    }

    /// The next frames. Those that the script loses are missing in their number.
    fn frames<'py>(&self, py: Python<'py>, count: i64) -> PyResult<Bound<'py, PyDict>> {
        let count = usize::try_from(count)
            .ok()
            .filter(|count| *count <= MOST_FRAMES);
        let count =
            count.ok_or_else(|| value_error(format!("frames: must be from 0 to {MOST_FRAMES}")))?;
        let frames = pool::run(py, |request: Request<'_>| {
            let mut simulation = lock(&self.simulation);
            let mut frames = Vec::with_capacity(count);
            while frames.len() < count && !request.asked() {
                if let Delivery::Frame(frame) = simulation.next_delivery() {
                    frames.push(frame);
                }
            }
            Ok(frames)
        })?;
        arrays(py, frames, self.stream.channels())
    }

    /// Force x, y, pressing on each taxel at these times, N: times x taxels x 3.
    fn truth<'py>(
        &self,
        py: Python<'py>,
        time_ns: PyArrayLike1<'py, i64, AllowTypeChange>,
    ) -> PyResult<Bound<'py, numpy::PyArray3<f64>>> {
        let times: Vec<u64> = time_ns
            .as_array()
            .iter()
            .map(|time| u64::try_from(*time).unwrap_or(0))
            .collect();
        let taxels = self.stream.rows * self.stream.columns;
        let count = times.len();
        let forces = pool::run(py, |_| {
            let simulation = lock(&self.simulation);
            let forces = times.iter().flat_map(|time| simulation.true_forces(*time));
            Ok(forces.flatten().collect::<Vec<f64>>())
        })?;
        let forces = Array3::from_shape_vec((count, taxels, 3), forces)
            .map_err(|error| Fault::Solve(format!("true forces: {error}")))?;
        Ok(forces.into_pyarray(py))
    }

    /// Number of the next frame.
    fn next_sequence(&self) -> u64 {
        lock(&self.simulation).next_sequence()
    }

    fn stream<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        described(py, &self.stream)
    }
}

/// Frames to touch; remembers between calls.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Estimator {
    inner: Mutex<Inner>,
    channels: usize,
}

struct Inner {
    session: TouchSession,
    continuity: Continuity,
    /// True for rest values that are not those of the piece itself: of a drawing.
    as_drawn: bool,
    /// What a rest capture came to.
    captured: Option<Result<(), String>>,
}

/// Columns of results, frame after frame.
#[derive(Default)]
struct Gathered {
    sequence: Vec<u64>,
    time_ns: Vec<i64>,
    value: Vec<f64>,
    deviation: Vec<f64>,
    residual: Vec<f64>,
    state: Vec<u8>,
    counted: Vec<bool>,
    total: Vec<f64>,
    total_deviation: Vec<f64>,
    moment: Vec<f64>,
    total_certainty: Vec<u8>,
    total_reason: Vec<i16>,
    zero_known: Vec<bool>,
    sum: Vec<f64>,
    centre: Vec<f64>,
    clipped: Vec<i64>,
    contacts: Vec<(u64, i64, Contact)>,
    events: Vec<(u64, TouchEvent)>,
    /// Frames that were late or twice.
    skipped: i64,
}

impl Gathered {
    fn push(&mut self, session: &TouchSession, zero_known: bool) {
        let touch = session.estimator().touch();
        self.sequence.push(touch.sequence);
        self.time_ns.push(touch.time_ns.cast_signed());
        for taxel in &touch.taxels {
            self.value.extend(taxel.value);
            self.deviation.extend(taxel.deviation());
            self.residual.push(taxel.residual);
            self.state.push(taxel.state as u8);
            self.counted.push(taxel.counted);
        }
        self.total.extend(touch.total.force);
        self.total_deviation.extend(touch.total_deviation());
        self.moment.extend(touch.total.moment);
        self.total_certainty.push(touch.total_certainty as u8);
        self.total_reason
            .push(touch.total_reason.map_or(-1, |state| state as i16));
        self.zero_known.push(touch.zero_known && zero_known);
        self.sum.push(touch.sum);
        self.centre.extend(
            touch
                .centre_of_pressure
                .map_or([f64::NAN; 2], |(centre, _)| centre),
        );
        self.clipped
            .push(i64::try_from(touch.clipped).unwrap_or(i64::MAX));
        let (sequence, time) = (touch.sequence, touch.time_ns.cast_signed());
        self.contacts.extend(
            touch
                .contacts
                .iter()
                .map(|contact| (sequence, time, *contact)),
        );
    }
}

#[pymethods]
impl Estimator {
    /// The estimator of the frames of a sensor, calibrated as drawn or by a calibration.
    #[new]
    #[pyo3(signature = (sensor, calibration = None))]
    fn new(
        py: Python<'_>,
        sensor: &Sensor,
        calibration: Option<(String, String)>,
    ) -> PyResult<Self> {
        pool::run(py, |_| {
            let named = sensor.calibrated(calibration.as_ref())?;
            let device = named
                .sensor
                .device()
                .map_err(|error| Fault::Wrong(error.to_string()))?;
            let stream = stream_of(&named.sensor)?;
            let session = device.session(&stream).map_err(|error| match error {
                FrameError::Untrained | FrameError::TrainedWithMasked { .. } => Fault::Wrong(format!(
                    "{}: {error}\nhelp: train it with taxel.calibrate(sensor, RECORDINGS), then give calibration=",
                    named.name
                )),
                error => Fault::from(error),
            })?;
            let channels = session.estimator().channels().len();
            let inner = Inner {
                session,
                continuity: Continuity::default(),
                as_drawn: calibration.is_none(),
                captured: None,
            };
            Ok(Self {
                inner: Mutex::new(inner),
                channels,
            })
        })
    }

    /// Touch of each frame.
    fn push<'py>(
        &self,
        py: Python<'py>,
        sequence: PyArrayLike1<'py, u64, AllowTypeChange>,
        time_ns: PyArrayLike1<'py, i64, AllowTypeChange>,
        values: PyArrayLike2<'py, f64, AllowTypeChange>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (numbers, times, values) = (sequence.as_array(), time_ns.as_array(), values.as_array());
        let (count, channels) = values.dim();
        if numbers.len() != count || times.len() != count {
            let message = format!(
                "{} numbers and {} times for {count} frames; one of each belongs to a frame",
                numbers.len(),
                times.len()
            );
            return Err(Fault::Frame(message).into());
        }
        if channels != self.channels {
            let error = FrameError::Channels {
                found: channels,
                expected: self.channels,
            };
            return Err(Fault::from(error).into());
        }
        if let Some(time) = times.iter().find(|time| **time < 0) {
            return Err(
                Fault::Frame(format!("a frame has the time {time} ns; times begin at 0")).into(),
            );
        }
        let (gathered, taxels, shape) = pool::run(py, |request: Request<'_>| {
            let mut inner = lock(&self.inner);
            let inner = &mut *inner;
            let mut found = Gathered::default();
            for ((row, number), time) in values.rows().into_iter().zip(numbers).zip(times) {
                if request.asked() {
                    break;
                }
                let frame = Frame {
                    sequence: *number,
                    time_ns: time.unsigned_abs(),
                    values: row.to_vec(),
                    ..Frame::default()
                };
                if !inner.continuity.accept(&frame) {
                    found.skipped += 1;
                    continue;
                }
                if inner.session.repeats(&frame) {
                    inner.continuity.repeat();
                    found.skipped += 1;
                    continue;
                }
                // The frame that ends a rest capture was read with the rest before it.
                let needed_zero = inner.session.needs_zero();
                let observed = inner.session.push(&frame)?;
                let captured = observed.captured;
                found
                    .events
                    .extend(observed.events.iter().map(|event| (*number, *event)));
                if let Some(captured) = captured {
                    inner.captured = Some(captured.map_err(|why| why.to_string()));
                }
                let zero_known = !(inner.as_drawn && needed_zero);
                found.push(&inner.session, zero_known);
            }
            let layout = &inner.session.meaning().layout;
            Ok((found, layout.taxels(), [layout.rows, layout.columns]))
        })?;
        handed_over(py, gathered, taxels, shape)
    }

    /// Begins a rest capture over the next frames.
    fn begin_rest_capture(&self, frames: i64) -> PyResult<()> {
        let frames = usize::try_from(frames)
            .ok()
            .filter(|frames| (1..=MOST_FRAMES).contains(frames));
        let frames = frames
            .ok_or_else(|| value_error(format!("tare: must be from 1 to {MOST_FRAMES} frames")))?;
        let mut inner = lock(&self.inner);
        inner.captured = None;
        inner.session.begin_rest_capture(frames);
        Ok(())
    }

    /// False while the device needs a rest capture, and has none but the rest of its drawing.
    fn zero_known(&self) -> bool {
        let inner = lock(&self.inner);
        !(inner.as_drawn && inner.session.needs_zero())
    }

    /// True while a rest capture runs.
    fn capturing(&self) -> bool {
        lock(&self.inner).session.capturing()
    }

    /// None while a rest capture runs or before the first; an empty text where it succeeded, or
    /// why it was refused.
    fn captured(&self) -> Option<String> {
        let inner = lock(&self.inner);
        let captured = inner.captured.as_ref()?;
        Some(captured.as_ref().err().cloned().unwrap_or_default())
    }

    /// Returns to the rest values of the calibration.
    fn clear_rest(&self) {
        lock(&self.inner).session.clear_rest();
    }

    /// Meaning of the numbers.
    fn meaning<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = lock(&self.inner);
        let meaning = inner.session.meaning();
        let about = PyDict::new(py);
        about.set_item("shape", (meaning.layout.rows, meaning.layout.columns))?;
        about.set_item("channels", meaning.channels.clone())?;
        about.set_item("quantity", &*meaning.value.quantity)?;
        about.set_item("symbol", &*meaning.value.symbol)?;
        about.set_item("si_per_unit", meaning.value.si_per_unit)?;
        about.set_item("components", meaning.components)?;
        about.set_item("force_unit", meaning.force_unit())?;
        about.set_item("length_unit", if meaning.in_metres { "m" } else { "cells" })?;
        Ok(about)
    }

    /// Frames that were accepted, lost, late, twice and sent again.
    fn counts(&self) -> (u64, u64, u64, u64, u64) {
        let counts = &lock(&self.inner).continuity;
        (
            counts.accepted,
            counts.lost,
            counts.late,
            counts.duplicate,
            counts.repeated,
        )
    }
}

/// Meaning of the frames of a sensor's own board.
fn stream_of(sensor: &taxel::sensor::Sensor) -> Result<Stream, Fault> {
    let device = sensor
        .device()
        .map_err(|error| Fault::Wrong(error.to_string()))?;
    if let Some(piece) = device.simulated() {
        return Ok(piece.stream());
    }
    // Bodies without a model have no twin: their frames are what their board delivers.
    let body = sensor
        .trained()
        .map_err(|error| Fault::Wrong(error.to_string()))?;
    Ok(body.stream())
}

fn shaped<D: numpy::ndarray::Dimension>(
    values: Vec<f64>,
    shape: impl Into<numpy::ndarray::StrideShape<D>>,
) -> Result<Array<f64, D>, Fault> {
    Array::from_shape_vec(shape, values)
        .map_err(|error| Fault::Solve(format!("shape of a result: {error}")))
}

fn handed_over(
    py: Python<'_>,
    found: Gathered,
    taxels: usize,
    [rows, columns]: [usize; 2],
) -> PyResult<Bound<'_, PyDict>> {
    let count = found.sequence.len();
    debug_assert_eq!(found.state.len(), count * taxels);
    let four = |values| -> Result<Array4<f64>, Fault> { shaped(values, (count, rows, columns, 3)) };
    let given = PyDict::new(py);
    given.set_item("sequence", found.sequence.into_pyarray(py))?;
    given.set_item("time_ns", found.time_ns.into_pyarray(py))?;
    given.set_item("value", four(found.value)?.into_pyarray(py))?;
    given.set_item("deviation", four(found.deviation)?.into_pyarray(py))?;
    let residual: Array3<f64> = shaped(found.residual, (count, rows, columns))?;
    given.set_item("residual", residual.into_pyarray(py))?;
    let state = Array3::from_shape_vec((count, rows, columns), found.state);
    let counted = Array3::from_shape_vec((count, rows, columns), found.counted);
    let (Ok(state), Ok(counted)) = (state, counted) else {
        return Err(Fault::Solve(String::from("shape of a result")).into());
    };
    given.set_item("state", state.into_pyarray(py))?;
    given.set_item("counted", counted.into_pyarray(py))?;
    for (name, values, width) in [
        ("total_force", found.total, 3),
        ("total_deviation", found.total_deviation, 3),
        ("moment", found.moment, 3),
        ("centre", found.centre, 2),
    ] {
        let values: Array2<f64> = shaped(values, (count, width))?;
        given.set_item(name, values.into_pyarray(py))?;
    }
    given.set_item("total_certainty", found.total_certainty.into_pyarray(py))?;
    given.set_item("total_reason", found.total_reason.into_pyarray(py))?;
    given.set_item("zero_known", found.zero_known.into_pyarray(py))?;
    given.set_item("sum", found.sum.into_pyarray(py))?;
    given.set_item("clipped", found.clipped.into_pyarray(py))?;
    given.set_item("skipped", found.skipped)?;
    let contacts: Vec<_> = found
        .contacts
        .into_iter()
        .map(|(sequence, time, one)| {
            let deviation: [f64; 3] =
                std::array::from_fn(|axis| one.force_covariance[axis][axis].sqrt());
            let bound = one.bound.map_or(-1, |state| state as i16);
            let head = (sequence, time, one.id, one.taxels, one.peak_taxel, bound);
            (
                head,
                (one.area, one.centre, one.covariance, one.velocity),
                (
                    one.force,
                    deviation,
                    one.torsion,
                    one.peak,
                    one.certainty as u8,
                ),
            )
        })
        .collect();
    given.set_item("contacts", contacts)?;
    let events: Vec<_> = found
        .events
        .into_iter()
        .map(|(sequence, one)| {
            (
                sequence,
                one.time_ns.cast_signed(),
                one.contact,
                one.kind.name(),
                one.value,
                one.deviation,
                one.certainty as u8,
            )
        })
        .collect();
    given.set_item("events", events)?;
    Ok(given)
}

/// The frames of a recording with what it says of them.
#[pyfunction]
#[pyo3(signature = (path, part = None, bare = false, columns = None))]
pub(crate) fn read_recording(
    py: Python<'_>,
    path: PathBuf,
    part: Option<String>,
    bare: bool,
    columns: Option<String>,
) -> PyResult<Bound<'_, PyDict>> {
    let (frames, stream, parts, cut) = pool::run(py, |request| {
        let columns = columns.map(|columns| columns.parse::<Columns>().map_err(Fault::Wrong));
        let options = RecordingOptions {
            bare,
            part,
            columns: columns.transpose()?.unwrap_or_default(),
        };
        let wrong = |error: taxel_serve::SourceError| Fault::Wrong(error.to_string());
        let mut source = ReplaySource::open(&path, &options).map_err(wrong)?;
        let mut frames: Vec<Frame> = Vec::new();
        let mut cut = String::new();
        loop {
            request.leave();
            match source.next() {
                Ok(Next::Frame(frame)) => frames.push(frame),
                Ok(Next::End) => break,
                Ok(_) => {}
                // What stands before the damage is whole.
                Err(error) if !frames.is_empty() => {
                    cut = error.to_string();
                    break;
                }
                Err(error) => return Err(wrong(error)),
            }
        }
        Ok((
            frames,
            source.stream().clone(),
            source.parts().to_vec(),
            cut,
        ))
    })?;
    let found = arrays(py, frames, stream.channels())?;
    found.set_item("about", described(py, &stream)?)?;
    found.set_item("parts", parts)?;
    found.set_item("damage", cut)?;
    Ok(found)
}
