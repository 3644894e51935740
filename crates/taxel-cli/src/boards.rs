//! Board files that the user names, and how they fit a sensor.

use std::path::Path;

use taxel::acquisition::Stream;
use taxel::sensor::Sensor;
use taxel::shown;
use taxel::toml_input;
use taxel_board::{Board, Wiring};

use crate::{Stop, files};

/// A board with what is said of it in files.
pub(crate) struct NamedBoard {
    /// Name of the file, or of a shipped board.
    pub(crate) name: String,
    pub(crate) board: Board,
    pub(crate) text: String,
}

/// The shipped boards, for messages.
pub(crate) fn shipped() -> String {
    Board::shipped_names().collect::<Vec<_>>().join(", ")
}

/// True if `path` is a board file, or the name of a shipped board.
pub(crate) fn is_board(path: &Path) -> Result<bool, Stop> {
    if !path.exists() {
        return Ok(Board::shipped_text(&path.to_string_lossy()).is_some());
    }
    // The standard input is read once.
    if path.as_os_str() == "-" || !path.is_file() {
        return Ok(false);
    }
    let text = files::text(path)?;
    Ok(toml_input::has(&text, &["framing"]) && !toml_input::has(&text, &["element"]))
}

/// Reads a board file, or a shipped one when no such file exists.
pub(crate) fn board(path: &Path) -> Result<NamedBoard, Stop> {
    let name = shown::path(path);
    let text = match Board::shipped_text(&name) {
        Some(text) if !path.exists() => text.to_owned(),
        _ => files::text(path).map_err(|stop| match stop {
            Stop::WrongInput(message) if !path.exists() => Stop::WrongInput(format!(
                "{message}\nhelp: give a file, or a shipped board: {}",
                shipped()
            )),
            stop => stop,
        })?,
    };
    let board = Board::parse(&name, &text)?;
    Ok(NamedBoard { name, board, text })
}

/// Meaning of the frames that the electronics of a sensor give.
pub(crate) fn sensor_stream(sensor: &Sensor) -> Result<Stream, Stop> {
    // Of another element there is none.
    if let Ok(trained) = sensor.trained() {
        return Ok(trained.stream());
    }
    let piece = files::device(sensor)?.simulated();
    piece.map(|piece| piece.stream()).ok_or_else(|| {
        let element = sensor.element.key();
        Stop::WrongInput(format!(
            "{}: it is not known which channels a sensor of [element.{element}] has",
            sensor.name
        ))
    })
}

/// The frames of `board` as those of `sensor`.
pub(crate) fn fit(board: &NamedBoard, sensor: &Sensor, file: &Path) -> Result<Stream, Stop> {
    let needed = sensor_stream(sensor)?;
    let wiring = Wiring::fit(&board.board, &needed).map_err(|mismatch| {
        Stop::WrongInput(format!(
            "{} and {} do not fit: {mismatch}",
            shown::path(file),
            board.name
        ))
    })?;
    Ok(wiring.stream().clone())
}
