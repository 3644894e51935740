//! `taxel recording import`: files of other programs as recordings, and what is in them.

use std::fs::File;
use std::io::{BufRead, BufWriter, Write as _};
use std::path::Path;

use serde_json::{Map, Value, json};
use taxel::shown;
use taxel_recording::foreign::Part;
use taxel_recording::mcap::{Attachment, FrameMessage, McapWriter, Metadata, RecordingHead};
use taxel_recording::{
    ChannelWriter, Format, Frame, Recording, RecordingError, RecordingOptions, Stream,
    description_of,
};
use taxel_serve::{SourceError, open_foreign, open_recording};

use super::{Inspected, NewFile, check_new};
use crate::arguments::{self, Import};
use crate::outputs::{self, cannot_write};
use crate::run_files::library;
use crate::{Done, Stop};

pub(super) fn run(arguments: &Import) -> Result<Done, Stop> {
    let Import { file, output, .. } = arguments;
    let existing = arguments.overwrite.existing();
    check_new(file, output, existing)?;
    let options = RecordingOptions {
        // Rows without names are refused unless their columns are said.
        bare: false,
        part: arguments.part.clone(),
        columns: arguments.columns.clone().unwrap_or_default(),
    };
    if outputs::is_standard(file) {
        let recording = Recording::open_with("-", std::io::stdin().lock(), &options);
        return write(
            arguments,
            recording.map_err(|error| Stop::WrongInput(error.to_string()))?,
        );
    }
    write(
        arguments,
        open_recording(file, &options).map_err(|error| stop(&error))?,
    )
}

fn stop(error: &SourceError) -> Stop {
    Stop::WrongInput(error.to_string())
}

/// Writes the frames of a recording, and what was taken for what.
fn write<R: BufRead>(arguments: &Import, mut recording: Recording<R>) -> Result<Done, Stop> {
    let output = &arguments.output;
    let failed = |error: std::io::Error| cannot_write(output, &error);
    let taken = recording.taken().map(|taken| taken.to_string());
    let stream = recording.stream().clone();
    let comments = comments(arguments, &recording, taken.as_deref());
    if let Some(taken) = &taken {
        note!("note: {}: {taken}", shown::path(&arguments.file));
    }
    let mut cut = None;
    let mut frames = 0_u64;
    outputs::write_file(output, arguments.overwrite.existing(), |new| {
        let mut writer = Writer::new(output, new, &stream, &comments)?;
        for frame in &mut recording {
            match frame {
                Ok(frame) => writer.frame(frame).map_err(failed)?,
                // What stands before is whole.
                Err(error @ RecordingError::Truncated { .. }) if frames > 0 => {
                    cut = Some(error.to_string());
                    break;
                }
                Err(error) => return Err(Stop::WrongInput(error.to_string())),
            }
            frames += 1;
        }
        writer.end().map_err(failed)
    })?;
    outputs::print(&format!("{}: {frames} frames\n", shown::path(output)))?;
    if let Some(cut) = cut {
        note!("note: {cut}");
        return Ok(Done::WithLosses);
    }
    Ok(Done::Complete)
}

fn comments<R: BufRead>(
    arguments: &Import,
    recording: &Recording<R>,
    taken: Option<&str>,
) -> Vec<String> {
    let from = format!(
        "from {}, {}",
        shown::path(&arguments.file),
        recording.format()
    );
    [library(), from]
        .into_iter()
        .chain(taken.map(str::to_owned))
        .collect()
}

/// A recording that is written, by the ending of its name.
enum Writer<'a> {
    Table(ChannelWriter<BufWriter<&'a mut File>>),
    Chunks(Box<McapWriter<NewFile<'a>>>),
}

impl<'a> Writer<'a> {
    fn new(
        output: &Path,
        new: &'a mut File,
        stream: &Stream,
        comments: &[String],
    ) -> Result<Self, Stop> {
        let failed = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::InvalidInput => Stop::WrongInput(error.to_string()),
            _ => cannot_write(output, &error),
        };
        let ending = output.extension().and_then(|ending| ending.to_str());
        match ending {
            Some("csv") => {
                let out = BufWriter::with_capacity(1 << 16, new);
                let comments = [comments, &["end = marked".to_owned()]].concat();
                let writer = ChannelWriter::new(out, stream, &comments).map_err(failed)?;
                Ok(Self::Table(writer))
            }
            Some("mcap") => {
                let pairs = comments.iter().zip(["version", "source", "taken"]);
                let pairs = pairs.map(|(text, key)| (key.to_owned(), text.clone()));
                let head = RecordingHead {
                    library: library(),
                    description: description_of(stream).map_err(failed)?,
                    attachments: Vec::<Attachment>::new(),
                    metadata: vec![Metadata {
                        name: "taxel".into(),
                        pairs: pairs.collect(),
                    }],
                    ..RecordingHead::default()
                };
                let writer = McapWriter::new(NewFile(new), &head).map_err(failed)?;
                Ok(Self::Chunks(Box::new(writer)))
            }
            _ => Err(Stop::WrongInput(format!(
                "-o {}: must end in .csv or .mcap",
                shown::path(output)
            ))),
        }
    }

    fn frame(&mut self, frame: Frame) -> std::io::Result<()> {
        match self {
            Self::Table(writer) => writer.write(&frame),
            Self::Chunks(writer) => {
                let utc_ns = frame.time_ns;
                writer.message(utc_ns, &FrameMessage { utc_ns, frame })
            }
        }
    }

    fn end(self) -> std::io::Result<()> {
        match self {
            Self::Table(writer) => writer.end()?.flush(),
            Self::Chunks(writer) => writer.finish().map(drop),
        }
    }
}

/// Lists a file of another program, or a table; `None` if it is a recording in chunks.
pub(super) fn inspect(path: &Path, shown_as: arguments::Format) -> Result<Option<Inspected>, Stop> {
    if let Some(foreign) = open_foreign(path).map_err(|error| stop(&error))? {
        let parts: Vec<Value> = foreign.parts().iter().map(part).collect();
        let mut fields = Map::new();
        fields.insert("file".into(), json!(shown::path(path)));
        fields.insert("format".into(), json!(foreign.format().to_string()));
        let cut = foreign.cut();
        fields.insert("state".into(), json!(cut.as_deref().unwrap_or("whole")));
        match shown_as {
            arguments::Format::Table => {
                for (at, one) in foreign.parts().iter().enumerate() {
                    fields.insert(format!("part {}", at + 1), json!(in_words(one)));
                }
            }
            _ => drop(fields.insert("parts".into(), parts.into())),
        }
        return Ok(Some(Inspected {
            fields,
            whole: cut.is_none(),
        }));
    }
    let Ok(recording) = open_recording(path, &RecordingOptions::default()) else {
        return Ok(None);
    };
    if recording.format() == Format::Chunks {
        return Ok(None);
    }
    let (format, taken, stream) = (
        recording.format(),
        recording.taken(),
        recording.stream().clone(),
    );
    let (mut frames, mut times, mut state) = (0_u64, None, "whole".to_owned());
    for frame in recording {
        match frame {
            Ok(frame) => {
                frames += 1;
                let [first, _] = times.unwrap_or([frame.time_ns; 2]);
                times = Some([first, frame.time_ns]);
            }
            Err(error) => state = error.to_string(),
        }
    }
    let span = times.map(|[first, last]| last.saturating_sub(first) as f64 * 1e-9);
    let rate = span
        .filter(|span| *span > 0.0)
        .map(|span| (frames - 1) as f64 / span);
    let whole = state == "whole";
    let fields = [
        ("file", json!(shown::path(path))),
        ("format", json!(format.to_string())),
        ("state", json!(state)),
        ("taken", json!(taken.map(|taken| taken.to_string()))),
        (
            "shape",
            json!(format!(
                "{} x {} x {}",
                stream.rows, stream.columns, stream.channels_per_taxel
            )),
        ),
        ("unit", json!(stream.unit.symbol)),
        ("frames", json!(frames)),
        ("duration_s", json!(span)),
        ("rate_hz", json!(rate)),
    ];
    let fields = fields
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
    Ok(Some(Inspected { fields, whole }))
}

fn part(part: &Part) -> Value {
    json!({
        "name": part.name,
        "kind": part.kind,
        "count": part.count,
        "rate_hz": part.rate,
        "unread": part.unread,
    })
}

fn in_words(part: &Part) -> String {
    let rate = part
        .rate
        .map_or_else(String::new, |rate| format!(", {rate:.4} Hz"));
    let unread = part
        .unread
        .as_ref()
        .map_or_else(String::new, |why| format!("; not read: {why}"));
    format!(
        "{}: {}, {} rows{rate}{unread}",
        part.name, part.kind, part.count
    )
}

/// Says what a file of another program is where only recordings in chunks can be read.
pub(super) fn refuse(path: &Path) -> Result<(), Stop> {
    let Some(foreign) = open_foreign(path).map_err(|error| stop(&error))? else {
        return Ok(());
    };
    let parts: Vec<_> = foreign.parts().iter().map(in_words).collect();
    Err(Stop::WrongInput(format!(
        "{}: is {}, no recording of taxel; it holds\n  {}\nhelp: taxel recording import FILE -o NEW.csv makes a recording of one of them",
        shown::path(path),
        foreign.format(),
        parts.join("\n  ")
    )))
}
