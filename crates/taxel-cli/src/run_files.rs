//! The files of a run as its recording keeps them, so that it can be played without them.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::{Value, json};
use taxel::estimation::{Meaning, State};
use taxel_files::{COMMIT, VERSION};
use taxel_recording::described_stream;
use taxel_recording::export::ExportMeaning;
use taxel_recording::mcap::{Attachment, Companion, Findings, Metadata, Ros2Messages};
use taxel_serve::{
    PumpOptions, RecordFile, RecordFolder, RecordTo, WhenRecordingFails, foxglove_messages,
};

use crate::arguments::{Live, RecordFor};
use crate::files;

/// A file by its name.
#[derive(Debug, Clone)]
pub(crate) struct NamedText {
    pub(crate) name: String,
    pub(crate) text: String,
}

/// What a run was made with.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunFiles {
    pub(crate) sensor: Option<NamedText>,
    pub(crate) calibration: Option<NamedText>,
    /// Of a device on a link.
    pub(crate) board: Option<NamedText>,
    pub(crate) stimulus: Option<NamedText>,
    /// True for a map of raw readings.
    pub(crate) raw: bool,
    /// True if a map reports all events.
    pub(crate) all_events: bool,
    /// True if the noise of a map was found by reading the whole recording before.
    pub(crate) surveyed: bool,
}

/// Names of the attachments.
const SENSOR: &str = "sensor.toml";
const CALIBRATION: &str = "calibration.toml";
const BOARD: &str = "board.toml";
const STIMULUS: &str = "stimulus.toml";
const RUN: &str = "run.json";

impl RunFiles {
    /// The files that are part of a recording.
    pub(crate) fn of(findings: &Findings) -> Self {
        let attached = |name: &str| {
            let mut attachments = findings.attachments.iter();
            let found = attachments.find(|attachment| attachment.name == name)?;
            String::from_utf8(found.bytes.clone()).ok()
        };
        let run: Value = attached(RUN)
            .and_then(|text| serde_json::from_str(&text).ok())
            .unwrap_or_default();
        let named = |name: &str, key: &str| {
            let text = attached(name)?;
            let name = run[key].as_str().unwrap_or(name).to_owned();
            Some(NamedText { name, text })
        };
        Self {
            sensor: named(SENSOR, "sensor"),
            calibration: named(CALIBRATION, "calibration"),
            board: named(BOARD, "board"),
            stimulus: named(STIMULUS, "stimulus"),
            raw: run["raw"] == true,
            all_events: run["all_events"] == true,
            surveyed: run["surveyed"] == true,
        }
    }

    /// What the numbers of a recording of `channels` channels are.
    pub(crate) fn meaning(findings: &Findings, channels: usize) -> ExportMeaning {
        let description = findings.description.as_deref();
        let stream = description.and_then(|text| described_stream("recording", text).ok());
        let mut meaning = ExportMeaning::of(stream.as_ref(), channels);
        let mut attachments = findings.attachments.iter();
        let run = attachments.find(|attachment| attachment.name == RUN);
        let run = run.and_then(|run| serde_json::from_slice::<Value>(&run.bytes).ok());
        let Some(run) = run else { return meaning };
        let texts = |value: &Value| -> Vec<String> {
            let texts = value.as_array().into_iter().flatten();
            texts
                .filter_map(|text| Some(text.as_str()?.to_owned()))
                .collect()
        };
        let names = texts(&run["channels"]);
        if names.len() == meaning.channels.len() {
            meaning.channels = names;
        }
        if let ([quantity, symbol], Some(scale)) =
            (&texts(&run["value"])[..], run["value_si_per_unit"].as_f64())
        {
            meaning.value = (quantity.clone(), symbol.clone(), scale);
        }
        if let Some(columns) = run["columns"].as_u64().filter(|columns| *columns > 0) {
            meaning.columns = columns as usize;
        }
        for (unit, key) in [
            (&mut meaning.force, "force_unit"),
            (&mut meaning.length, "length_unit"),
        ] {
            if let Some(symbol) = run[key].as_str() {
                symbol.clone_into(unit);
            }
        }
        meaning.states = texts(&run["states"]);
        meaning
    }

    /// Puts the recording that a run is asked to make, and those that a page may begin, into its options.
    pub(crate) fn record(&self, arguments: &Live, meaning: &Meaning, options: &mut PumpOptions) {
        let file = self.recording(arguments, meaning);
        let folder = &arguments.recording.record_folder;
        options.record_folder = (!arguments.headless).then(|| RecordFolder {
            // People are to find it whatever folder the program runs in.
            folder: std::path::absolute(folder).unwrap_or_else(|_| folder.clone()),
            file: RecordFile {
                when_failing: WhenRecordingFails::GoOn,
                ..file.clone()
            },
        });
        options.record = arguments.recording.record.clone().map(|path| {
            let file = RecordFile { path, ..file };
            RecordTo::File(Box::new(file))
        });
    }

    /// What a recording of the run is made with, without its path.
    fn recording(&self, arguments: &Live, meaning: &Meaning) -> RecordFile {
        let command: Vec<_> = std::env::args_os()
            .map(|argument| argument.to_string_lossy().into_owned())
            .collect();
        let files = [
            (SENSOR, "sensor", &self.sensor),
            (CALIBRATION, "calibration", &self.calibration),
            (BOARD, "board", &self.board),
            (STIMULUS, "stimulus", &self.stimulus),
        ];
        let mut run = json!({
            "command": command,
            "version": VERSION,
            "commit": COMMIT,
            "source": arguments.source,
            "seed": arguments.seed,
            "raw": self.raw,
            "all_events": self.all_events,
            "surveyed": self.surveyed,
            "channels": meaning.channels,
            "columns": meaning.layout.columns,
            "value": [meaning.value.quantity, meaning.value.symbol],
            "value_si_per_unit": meaning.value.si_per_unit,
            "force_unit": meaning.force_unit(),
            "length_unit": if meaning.in_metres { "m" } else { "cells" },
            "states": State::ALL.map(State::name),
        });
        let mut attachments = Vec::new();
        for (attached, key, file) in files {
            let Some(NamedText { name, text }) = file else {
                continue;
            };
            run[key] = Value::from(name.as_str());
            run[format!("{key}_sha256")] = Value::from(files::sha256(text.as_bytes()));
            attachments.push(Attachment {
                name: attached.into(),
                media_type: "application/toml".into(),
                bytes: text.clone().into_bytes(),
            });
        }
        let text = |value: &Value| match value {
            Value::String(text) => text.clone(),
            value => value.to_string(),
        };
        let pairs = run.as_object().into_iter().flatten();
        let pairs = pairs.map(|(key, value)| (key.clone(), text(value)));
        let metadata = Metadata {
            name: "taxel".into(),
            pairs: pairs.collect(),
        };
        attachments.push(Attachment {
            name: RUN.into(),
            media_type: "application/json".into(),
            bytes: run.to_string().into_bytes(),
        });
        RecordFile {
            path: PathBuf::new(),
            library: library(),
            attachments,
            metadata: vec![metadata],
            companion: arguments
                .recording
                .record_for
                .map(|program| messages_for(program, meaning)),
            when_failing: arguments.recording.when_failing(),
            told: |message| note!("warning: {message}"),
        }
    }
}

/// What makes messages for a program.
pub(crate) fn messages_for(program: RecordFor, meaning: &Meaning) -> Arc<dyn Companion> {
    match program {
        RecordFor::Ros2 => Arc::new(Ros2Messages {
            columns: meaning.layout.columns,
        }),
        RecordFor::Foxglove => foxglove_messages(meaning),
    }
}

/// Program and version as recordings name them.
pub(crate) fn library() -> String {
    format!("taxel {VERSION} {COMMIT}")
}
