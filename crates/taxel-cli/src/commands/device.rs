//! `taxel device`: a virtual device on a wire.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use taxel::acquisition::{Stimulus, Stream, Twin};
use taxel::quantity::FREQUENCY;
use taxel::shown;
use taxel_recording::RecordingOptions;
use taxel_serve::device::{
    ControlPlace, Device as Virtual, DeviceError, DeviceOptions, DevicePlace, Faults, Player,
};
use taxel_serve::{BoardEncoder, ReplaySource, Source as _};

use crate::arguments::Device;
use crate::boards::NamedBoard;
use crate::interrupt::Interrupt;
use crate::outputs::{self, Existing};
use crate::{Done, Stop, boards, files, hello};

/// Frames a second where neither board nor sensor says how many, Hz.
const USUAL_RATE: f64 = 100.0;

pub(crate) fn run(arguments: &Device) -> Result<Done, Stop> {
    let place = DevicePlace::parse(&arguments.on).map_err(|error| wrong(&error))?;
    let control = arguments.control.as_deref().map(ControlPlace::parse);
    let control = control.transpose().map_err(|error| wrong(&error))?;
    let existing = arguments.overwrite.existing();
    check_outputs(arguments, existing)?;
    let faults = match &arguments.faults {
        Some(path) => Faults::parse(&shown::path(path), &files::text(path)?)?,
        None => Faults::default(),
    };
    let (player, stream, mut named) = player(arguments, boards::board(&arguments.board)?)?;
    if control.is_some() && matches!(player, Player::Source(_)) {
        let message = "--control moves the twin: leave --replay out";
        return Err(Stop::WrongInput(message.into()));
    }
    let rate = rate(arguments, named.board.rate, &stream)?;
    // A hello says what is sent.
    named.board.rate = Some(rate);
    let on_standard_output = place == DevicePlace::StandardOutput;
    let options = DeviceOptions {
        place,
        rate,
        faults,
        seed: arguments.seed,
        truth: arguments.truth.clone(),
        replace_files: existing == Existing::Replaced,
        control,
        frames: arguments.frames,
        hello: named.board.hello(),
    };
    let encoder = Box::new(BoardEncoder::new(&named.board));
    let interrupt = Interrupt::listen();
    let device = Virtual::open(player, encoder, options).map_err(|error| wrong(&error))?;
    if !on_standard_output {
        let mut output = std::io::stdout();
        let told = writeln!(output, "{}", device.name()).and_then(|()| output.flush());
        if told.is_err() {
            // Nobody learned the name of the port.
            return Ok(Done::Complete);
        }
    }
    if let Some(name) = device.control_name() {
        note!("commands are taken on {name}");
    }
    let summary = device
        .run(interrupt.flag())
        .map_err(|error| Stop::Failed(error.to_string()))?;
    note!(
        "{} frames taken, {} sent, {} of them damaged; {} connects",
        summary.frames,
        summary.sent,
        summary.damaged,
        summary.connects
    );
    Ok(Done::Complete)
}

fn wrong(error: &DeviceError) -> Stop {
    Stop::WrongInput(error.to_string())
}

fn check_outputs(arguments: &Device, existing: Existing) -> Result<(), Stop> {
    let inputs: Vec<&PathBuf> = [&arguments.sensor, &arguments.board]
        .into_iter()
        .chain(&arguments.script)
        .chain(&arguments.faults)
        .chain(&arguments.replay)
        .collect();
    let outputs = [("--truth", arguments.truth.as_ref())];
    outputs::check(&outputs, &inputs, existing)
}

/// What is played, the meaning of its frames, and the board, which they fit.
fn player(arguments: &Device, named: NamedBoard) -> Result<(Player, Stream, NamedBoard), Stop> {
    let sensor = files::sensor(&arguments.sensor)?;
    if let Some(path) = &arguments.replay {
        let source = ReplaySource::open(path, &RecordingOptions::default());
        let source = source.map_err(|error| Stop::WrongInput(error.to_string()))?;
        let stream = source.stream().clone();
        let named = hello::with_channels(named, &stream)?;
        fits(&named, &stream, path)?;
        return Ok((Player::Source(Box::new(source)), stream, named));
    }
    let named = hello::with_channels(named, &boards::sensor_stream(&sensor.sensor)?)?;
    boards::fit(&named, &sensor.sensor, &arguments.sensor)?;
    let usual = PathBuf::from(sensor.sensor.element.usual_script());
    let script = arguments.script.as_ref().unwrap_or(&usual);
    let name = shown::path(script);
    let text = match Stimulus::shipped_text(&name) {
        Some(text) if !script.exists() => text.to_owned(),
        _ => files::text(script)?,
    };
    let stimulus = Stimulus::parse(&name, &text)?;
    let twin = Twin::new(&sensor.sensor, &stimulus, arguments.seed)
        .map_err(|message| Stop::WrongInput(format!("{name}: {message}")))?;
    let stream = twin.stream();
    Ok((Player::Twin(Box::new(twin)), stream, named))
}

fn fits(named: &NamedBoard, stream: &Stream, path: &Path) -> Result<(), Stop> {
    let fitted = taxel_board::Wiring::fit(&named.board, stream);
    fitted.map(drop).map_err(|mismatch| {
        Stop::WrongInput(format!(
            "{} and {} do not fit: {mismatch}",
            shown::path(path),
            named.name
        ))
    })
}

/// Frames a second: asked for, of the board, or of the sensor.
fn rate(arguments: &Device, board: Option<f64>, stream: &Stream) -> Result<f64, Stop> {
    let Some(text) = &arguments.rate else {
        let sensor = stream.period.map(f64::recip);
        return Ok(board.or(sensor).unwrap_or(USUAL_RATE));
    };
    let rate = FREQUENCY.parse(text);
    let rate = rate.map_err(|message| Stop::WrongInput(format!("--rate: {message}")))?;
    if (1e-3..=1e6).contains(&rate) {
        Ok(rate)
    } else {
        let message = format!("--rate \"{text}\": must be from 1 mHz to 1 MHz, such as \"1 kHz\"");
        Err(Stop::WrongInput(message))
    }
}
