//! Sessions whose frames a board has sent: over a link, or as bytes that were captured.

use std::path::Path;
use std::sync::Arc;

use taxel::acquisition::Stream;
use taxel::estimation::MapNoise;
use taxel::shown;
use taxel_recording::Recording;
use taxel_serve::link::{LinkAddress, LinkError, LinkOptions, Reconnect};
use taxel_serve::{
    BoardDecoder, CaptureSource, LinkSource, PumpOptions, Session, Source, Survey, greeting,
    serial_settings,
};

use super::{asked, map_session, sensed, stop_of_source};
use crate::arguments::Live;
use crate::boards::NamedBoard;
use crate::run_files::{NamedText, RunFiles};
use crate::{Stop, boards, files, hello};

/// A session whose frames come over a link.
pub(super) fn link_session(arguments: &Live, options: PumpOptions) -> Result<Session, Stop> {
    let wrong = |error: LinkError| Stop::WrongInput(error.to_string());
    let address = LinkAddress::parse(&arguments.source).map_err(wrong)?;
    let sensor = sensor(arguments)?;
    let reconnect = if arguments.link.once {
        Reconnect::Once
    } else {
        Reconnect::ForEver
    };
    let named = arguments.link.board.as_deref();
    let (board, heard) = hello::board(named, &arguments.source, &address, reconnect)?;
    let fitted = Fitted::new(arguments, board, sensor)?;
    let board = &fitted.board.board;
    let decoder = Box::new(BoardDecoder::new(board, &address));
    let link = LinkOptions {
        heard,
        serial: serial_settings(board),
        greeting: greeting(board, &address),
        reconnect,
        delay: board.link.delay,
        observers: Vec::new(),
        tell: Arc::new(|line| note!("{line}")),
    };
    let stream = fitted.stream.clone();
    let source = LinkSource::start(address, stream, decoder, link).map_err(wrong)?;
    fitted.session(source, None, options, arguments)
}

/// A session of bytes that a board has sent, in a file.
pub(super) fn capture_session(
    arguments: &Live,
    board: &Path,
    path: &Path,
    options: PumpOptions,
) -> Result<Session, Stop> {
    let named = boards::board(board)?;
    let fitted = Fitted::new(arguments, hello::recorded(named, path)?, sensor(arguments)?)?;
    let open = || CaptureSource::open(path, &fitted.board.board, fitted.stream.clone());
    let open = || open().map_err(|error| stop_of_source(&error));
    let source = open()?;
    if let Some(format) = recording_format(path) {
        return Err(Stop::WrongInput(format!(
            "{}: with --board {} it would be bytes as the board sent them, but it is a recording: {format}\nhelp: leave --board out; taxel recording decode makes the frames of a recording anew with another board file",
            shown::path(path),
            shown::path(board),
        )));
    }
    let (survey, end) = Survey::of(open()?);
    end.map_err(|error| stop_of_source(&error))?;
    if survey.frames == 0 {
        return Err(Stop::WrongInput(format!(
            "{}: no frame of {} is in it\nhelp: is it the file of that board? taxel live --board takes bytes as they came over the wire",
            shown::path(path),
            fitted.board.name,
        )));
    }
    let options = PumpOptions {
        expected: Some(survey.frames),
        ..options
    };
    fitted.session(source, Some(&survey.noise), options, arguments)
}

/// What kind of recording a file is; `None` for one that is none.
fn recording_format(path: &Path) -> Option<taxel_recording::Format> {
    let bytes = std::io::BufReader::new(std::fs::File::open(path).ok()?);
    let recording = Recording::open(&shown::path(path), bytes).ok()?;
    // A board that writes text may write what could be a table.
    Some(recording.format()).filter(|format| *format != taxel_recording::Format::Table)
}

/// The sensor of the command line; `None` for a map of the readings.
fn sensor(arguments: &Live) -> Result<Option<files::NamedSensor>, Stop> {
    match &arguments.named_sensor {
        _ if arguments.map.raw => Ok(None),
        Some(sensor) => files::sensor(sensor).map(Some),
        None => Err(Stop::WrongInput(format!(
            "--source {}: of which sensor? name its file, or give --raw for a map of the readings",
            arguments.source
        ))),
    }
}

/// A board, and the sensor that it reads.
struct Fitted {
    board: NamedBoard,
    /// None for a map of the readings.
    sensor: Option<files::NamedSensor>,
    stream: Stream,
}

impl Fitted {
    /// `sensor` as `board` reads it.
    fn new(
        arguments: &Live,
        board: NamedBoard,
        sensor: Option<files::NamedSensor>,
    ) -> Result<Self, Stop> {
        let stream = match &sensor {
            Some(sensor) => boards::fit(&board, &sensor.sensor, arguments.sensor())?,
            None => board.board.stream(),
        };
        Ok(Self {
            board,
            sensor,
            stream,
        })
    }

    /// A session of frames of the board; `noise` is that of all of them where they are known.
    fn session(
        self,
        source: impl Source + 'static,
        noise: Option<&MapNoise>,
        options: PumpOptions,
        arguments: &Live,
    ) -> Result<Session, Stop> {
        let run = RunFiles {
            board: Some(NamedText {
                name: self.board.name,
                text: self.board.text,
            }),
            surveyed: noise.is_some(),
            ..asked(arguments)?
        };
        if let Some(sensor) = self.sensor {
            return sensed(sensor, source, run, options, arguments);
        }
        let unknown = MapNoise::default();
        map_session(source, noise.unwrap_or(&unknown), &run, options, arguments)
    }
}
