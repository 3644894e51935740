//! `taxel live`: frames to touch.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use taxel::acquisition::{Quantity, Stimulus, Twin};
use taxel::device::Device;
use taxel::estimation::{FrameError, State, TouchSession};
use taxel::sensor::Element;
use taxel::table::{self, Cell, Column, number_or_null};
use taxel_recording::RecordingError;
use taxel_serve::{
    EventFile, Failure, Provenance, PumpOptions, RecordingSize, ReplaySource, ServeError, Session,
    Source, SourceError, Summary, TwinSource, run_headless, run_with_page,
};

use crate::arguments::{COMMIT, Format, Live, VERSION};
use crate::commands::calibrate;
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Live) -> Result<Done, Stop> {
    let options = options(arguments)?;
    let mut session = session(arguments, options)?;
    session.options.provenance = saved_provenance(&session.provenance, arguments.seed);
    let about = about(&session, arguments.seed);
    let ends = arguments.frames.is_some();
    let summary = if arguments.headless {
        run_headless(session)
    } else {
        let address = SocketAddr::new(arguments.host, arguments.port);
        if !arguments.host.is_loopback() {
            eprintln!(
                "note: {address} can be reached from other machines; the token in the address is the only key"
            );
        }
        run_with_page(session, address, |page| {
            println!("{page}");
            if !ends {
                eprintln!("open the address above in a browser; Ctrl-C ends");
            }
        })
    };
    let summary = summary.map_err(|error| stop_of_serving(&error))?;
    report(arguments, &about, &summary)
}

fn options(arguments: &Live) -> Result<PumpOptions, Stop> {
    let speed = match arguments.speed.as_str() {
        "max" => Some(f64::INFINITY),
        text => text
            .parse()
            .ok()
            .filter(|speed: &f64| *speed > 0.0 && speed.is_finite()),
    };
    let Some(speed) = speed else {
        let message = format!(
            "--speed \"{}\": must be a number above 0, or max",
            arguments.speed
        );
        return Err(Stop::WrongInput(message));
    };
    if arguments.headless
        && arguments.frames.is_none()
        && arguments.source.starts_with("sim:")
        && speed.is_infinite()
    {
        let message = "--headless --speed max on the twin would never end: give --frames N";
        return Err(Stop::WrongInput(message.into()));
    }
    if arguments.save.as_ref().is_some_and(|path| path.exists()) {
        let path = arguments.save.clone().unwrap_or_default();
        let message = format!("--save {}: the file exists; name a new one", path.display());
        return Err(Stop::WrongInput(message));
    }
    let events = arguments.events.as_deref().map(EventFile::new).transpose();
    let events = events.map_err(|error| Stop::WrongInput(format!("--events {error}")))?;
    Ok(PumpOptions {
        speed,
        frames: arguments.frames,
        tare_frames: arguments.tare_frames as usize,
        tare_at_start: !arguments.no_tare,
        save: arguments.save.clone(),
        events,
        provenance: Vec::new(),
    })
}

fn session(arguments: &Live, options: PumpOptions) -> Result<Session, Stop> {
    let (kind, rest) = arguments
        .source
        .split_once(':')
        .unwrap_or((&arguments.source, ""));
    match kind {
        "sim" => twin_session(arguments, rest, options),
        "replay" if !rest.is_empty() => replay_session(arguments, &PathBuf::from(rest), options),
        _ => Err(Stop::WrongInput(format!(
            "--source \"{}\" is no source\nhelp: use sim:, sim:SCRIPT.toml or replay:RECORDING",
            arguments.source
        ))),
    }
}

fn twin_session(arguments: &Live, script: &str, options: PumpOptions) -> Result<Session, Stop> {
    let named = files::sensor(&arguments.sensor)?;
    let usual = named.sensor.element.usual_script();
    let name = if script.is_empty() { usual } else { script };
    let text = match Stimulus::shipped_text(name) {
        Some(text) if !Path::new(name).exists() => text.to_owned(),
        _ => files::text(Path::new(name))?,
    };
    let stimulus = Stimulus::parse(name, &text)?;
    let twin = Twin::new(&named.sensor, &stimulus, arguments.seed)
        .map_err(|message| Stop::WrongInput(format!("{name}: {message}")))?;
    let source = TwinSource::new(twin);
    sensed(named, source, options, arguments)
}

/// A session whose frames mean what the sensor says.
fn sensed(
    named: files::NamedSensor,
    source: impl Source + 'static,
    options: PumpOptions,
    arguments: &Live,
) -> Result<Session, Stop> {
    let named = calibrate::applied(named, arguments.calibration.as_deref())?;
    let device = files::device(&named.sensor)?;
    let touch = touch(device.as_ref(), &source, arguments)?;
    let drawing = device.drawing().svg();
    drop(device);
    Ok(Session {
        touch,
        drawing,
        source: Box::new(source),
        options,
        provenance: provenance(arguments, named.sensor.name, named.hash),
    })
}

fn replay_session(arguments: &Live, path: &Path, options: PumpOptions) -> Result<Session, Stop> {
    let bare = takes_bare(&arguments.sensor);
    let open = || {
        let open = if bare {
            ReplaySource::open_bare
        } else {
            ReplaySource::open
        };
        open(path)
    };
    let size = match open().and_then(ReplaySource::size) {
        Ok(size) if size.frames == 0 => {
            let message = format!("{}: there is no frame in it", path.display());
            return Err(Stop::WrongInput(message));
        }
        Ok(size) => size,
        Err(error) if arguments.salvage && is_cut(&error) => RecordingSize::default(),
        Err(error) => return Err(stop_of_source(&error)),
    };
    let source = open().map_err(|error| stop_of_source(&error))?.paced(size);
    let stream = source.stream();
    // Counts and capacitances mean something only with the sensor they are of;
    // other recordings describe themselves.
    let needs_sensor =
        bare || stream.channels_per_taxel == 4 || stream.unit.quantity == Quantity::Counts;
    if !needs_sensor {
        if let Some(path) = &arguments.calibration {
            let message = format!(
                "--calibration {}: {} describes itself and takes no calibration",
                path.display(),
                arguments.source
            );
            return Err(Stop::WrongInput(message));
        }
        let provenance = provenance(arguments, stream.name.clone(), String::new());
        return Ok(Session {
            touch: TouchSession::map(stream),
            drawing: String::new(),
            source: Box::new(source),
            options,
            provenance,
        });
    }
    let named = files::sensor(&arguments.sensor)?;
    sensed(named, source, options, arguments)
}

fn touch(
    device: &dyn Device,
    source: &impl Source,
    arguments: &Live,
) -> Result<TouchSession, Stop> {
    device.session(source.stream()).map_err(|error| {
        let stream = source.stream();
        if error == FrameError::Untrained {
            let sensor = arguments.sensor.display();
            return Stop::WrongInput(format!(
                "{sensor}: {error}\nhelp: taxel calibrate {sensor} RECORDINGS -o CAL.toml, then give --calibration CAL.toml"
            ));
        }
        Stop::WrongInput(format!(
            "{} does not fit {}: {error}\nhelp: the frames are of {} x {} taxels; name the sensor file they come from",
            arguments.source,
            arguments.sensor.display(),
            stream.rows,
            stream.columns
        ))
    })
}

/// True if recordings of this sensor may come without a header: its file says
/// what the channels are.
fn takes_bare(sensor: &Path) -> bool {
    let named = files::sensor(sensor);
    named.is_ok_and(|named| matches!(named.sensor.element, Element::Trained(_)))
}

fn is_cut(error: &SourceError) -> bool {
    matches!(error, SourceError::Recording(error) if matches!(**error, RecordingError::Truncated { .. }))
}

fn stop_of_source(error: &SourceError) -> Stop {
    let help = if is_cut(error) {
        "\nhelp: --salvage plays its complete frames"
    } else {
        ""
    };
    Stop::WrongInput(format!("{error}{help}"))
}

fn stop_of_serving(error: &ServeError) -> Stop {
    match error {
        ServeError::Listen { .. } => Stop::WrongInput(error.to_string()),
        _ => Stop::Failed(error.to_string()),
    }
}

fn provenance(arguments: &Live, device: String, sensor_hash: String) -> Provenance {
    Provenance {
        device,
        version: VERSION.into(),
        commit: COMMIT.into(),
        sensor_hash,
        source: arguments.source.clone(),
    }
}

fn saved_provenance(provenance: &Provenance, seed: u64) -> Vec<String> {
    vec![
        format!("taxel {} {}", provenance.version, provenance.commit),
        format!("sensor_hash {}", provenance.sensor_hash),
        format!("source {}", provenance.source),
        format!("seed {seed}"),
    ]
}

fn about(session: &Session, seed: u64) -> Map<String, Value> {
    let stream = session.source.stream();
    let provenance = &session.provenance;
    // The frames of crossing channels are one row of channels; people count taxels.
    let layout = &session.touch.meaning().layout;
    let seed = if provenance.source.starts_with("sim:") {
        Value::from(seed)
    } else {
        Value::Null
    };
    let pairs = [
        ("name", Value::from(provenance.device.clone())),
        ("source", Value::from(provenance.source.clone())),
        ("rows", Value::from(layout.rows)),
        ("columns", Value::from(layout.columns)),
        ("channels", Value::from(stream.channels())),
        ("channel_unit", Value::from(stream.unit.symbol.clone())),
        (
            "pitch_m",
            stream.pitch.map_or(Value::Null, |pitch| json!(pitch)),
        ),
        ("seed", seed),
        ("sensor_hash", Value::from(provenance.sensor_hash.clone())),
        ("version", Value::from(provenance.version.clone())),
        ("commit", Value::from(provenance.commit.clone())),
    ];
    pairs
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

fn report(arguments: &Live, about: &Map<String, Value>, summary: &Summary) -> Result<Done, Stop> {
    let fields = fields(about, summary);
    let report = match arguments.format {
        Format::Json => table::json(&Value::Object(fields)),
        Format::Table => fields
            .iter()
            .filter(|(key, _)| !LISTS.contains(&key.as_str()))
            .map(line)
            .collect(),
        Format::Csv => {
            let columns: Vec<_> = fields.keys().map(Column::plain).collect();
            let row = fields
                .values()
                .map(|value| Cell::from(text(value)))
                .collect();
            table::render(table::Format::Csv, &Map::new(), &columns, &[row])
        }
    };
    if arguments.headless || arguments.frames.is_some() {
        files::write(None, &report)?;
    }
    if !summary.notice.is_empty() && summary.failure.is_none() {
        eprintln!("note: {}", summary.notice);
    }
    let losses =
        summary.continuity.lost > 0 || summary.continuity.late > 0 || summary.clipped_frames > 0;
    match &summary.failure {
        Some(Failure::Source(error)) if arguments.salvage && is_cut(error) => {
            eprintln!("note: {error}");
            Ok(Done::WithLosses)
        }
        Some(failure) => Err(Stop::Failed(failure.to_string())),
        None if losses => Ok(Done::WithLosses),
        None => Ok(Done::Complete),
    }
}

/// More readings than this are not listed.
const MOST_LISTED: usize = 256;
/// Fields that are too long for a line that people read.
const LISTS: [&str; 3] = ["last_taxel_forces_n", "last_events", "wrong_channels"];

fn line((key, value): (&String, &Value)) -> String {
    match value {
        Value::Null => String::new(),
        value => format!("{key:<24} {}\n", text(value)),
    }
}

/// A value as a person writes it: text without quotes, nothing for nothing.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|value| number_or_null(*value)).collect()
}

fn fields(about: &Map<String, Value>, summary: &Summary) -> Map<String, Value> {
    let mut fields = about.clone();
    let counts = &summary.continuity;
    let rate = match counts.accepted {
        0 | 1 => f64::NAN,
        frames => (frames - 1) as f64 / summary.duration,
    };
    let latency = |latencies: &taxel_serve::Latencies| {
        json!({
            "p50": latencies.quantile(0.5),
            "p90": latencies.quantile(0.9),
            "p99": latencies.quantile(0.99),
            "p99_9": latencies.quantile(0.999),
            "largest": latencies.largest(),
        })
    };
    // Without a pitch the positions of a map are counted in cells.
    let in_cells = about.get("pitch_m").is_some_and(Value::is_null)
        && summary.last.as_ref().is_some_and(|last| last.sum.is_some());
    let centre_key = if in_cells {
        "last_centre_of_pressure_cells"
    } else {
        "last_centre_of_pressure_m"
    };
    let mut put = |key: &str, value: Value| fields.insert(key.to_owned(), value);
    put("frames", Value::from(counts.accepted));
    put("lost", Value::from(counts.lost));
    put("late", Value::from(counts.late));
    put("duplicate", Value::from(counts.duplicate));
    put("repeated", Value::from(counts.repeated));
    put("restarts", Value::from(counts.restarts));
    put("clipped_frames", Value::from(summary.clipped_frames));
    put("duration_s", number_or_null(summary.duration));
    put("rate_hz", number_or_null(rate));
    put("latency_s", latency(&summary.latency));
    if summary.sent.count() > 0 {
        put("sent_latency_s", latency(&summary.sent));
    }
    put("tare", json!(summary.tare));
    put("notice", Value::from(summary.notice.clone()));
    put("events", json!(summary.events.counts));
    put("last_events", json!(summary.events.last));
    let conditions = &summary.conditions;
    put(
        "condition",
        Value::from(match conditions.wrong_channels {
            0 => format!("all {} channels well", conditions.channels),
            wrong => format!("{wrong} of {} channels wrong", conditions.channels),
        }),
    );
    put("wrong_channels", json!(conditions.wrong));
    put("swapped", json!(conditions.swapped));
    if let Some(last) = &summary.last {
        put("last_sequence", Value::from(last.sequence));
        put("last_time_ns", Value::from(last.time_ns));
        put("last_force_n", numbers(&last.force));
        put("last_force_deviation_n", numbers(&last.deviation));
        put("last_moment_n_m", numbers(&last.moment));
        put("last_sum_si", last.sum.map_or(Value::Null, number_or_null));
        put(
            centre_key,
            last.centre_of_pressure.map_or(Value::Null, |c| numbers(&c)),
        );
        put("last_contacts", Value::from(last.contacts));
        let states = State::ALL
            .iter()
            .zip(last.states)
            .filter(|(_, count)| *count > 0);
        put(
            "last_states",
            states
                .map(|(state, count)| (state.name().to_owned(), Value::from(count)))
                .collect::<Map<_, _>>()
                .into(),
        );
        let vectors = last.values.iter().filter(|_| last.components == 3);
        put(
            "last_taxel_forces_n",
            vectors.map(|value| numbers(value)).collect(),
        );
        if last.components == 1 && last.readings.len() <= MOST_LISTED {
            let pressed: Vec<f64> = last.values.iter().map(|value| value[2]).collect();
            put("last_signals_si", numbers(&last.readings));
            put("last_taxel_values_si", numbers(&pressed));
        }
    }
    fields
}
