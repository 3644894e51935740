//! `taxel recording`: inspect, repair, export, cut, decode and compare recordings.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser as _;
use serde_json::{Map, Value, json};
use taxel::shown;
use taxel::table;
use taxel::work::Parts;
use taxel_recording::export::{ExportMeaning, write_csv, write_npz, write_tables};
use taxel_recording::mcap::{
    Companion, Findings, LinkMessage, MAGIC, McapReader, Message, Ros2Messages, Storage, Topic,
    rewrite, write_accompanied,
};

use crate::arguments::{
    Arguments, Command, Compare, Cut, Export, Format, Inspect, RecordFor, Recording,
    RecordingCommand, Repair,
};
use crate::commands::live;
use crate::outputs::{self, cannot_write};
use crate::run_files::{RunFiles, library, messages_for};
use crate::{Done, Stop};

mod compare;
mod decode;
mod import;

pub(crate) fn run(arguments: &Recording) -> Result<Done, Stop> {
    match &arguments.command {
        RecordingCommand::Inspect(inspect) => self::inspect(inspect),
        RecordingCommand::Import(import) => import::run(import),
        RecordingCommand::Repair(repair) => self::repair(repair),
        RecordingCommand::Export(export) => self::export(export),
        RecordingCommand::Cut(cut) => self::cut(cut),
        RecordingCommand::Compare(compare) => compare::run(compare),
        RecordingCommand::Decode(decode) => decode::run(decode),
    }
}

/// The file of a recording.
fn open(path: &Path) -> Result<File, Stop> {
    let wrong = |message: String| Stop::WrongInput(format!("{}: {message}", shown::path(path)));
    let unreadable = |error: std::io::Error| wrong(format!("cannot be read: {error}"));
    // Before it is opened: a pipe would wait for its writer.
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(wrong(
            "is no ordinary file; give a recording of taxel live --record".into(),
        ));
    }
    File::open(path).map_err(unreadable)
}

/// A file whose bytes are counted as they are read.
struct Counted {
    file: File,
    bytes: Parts,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.bytes.done(read as u64);
        Ok(read)
    }
}

type Reader = McapReader<BufReader<Counted>>;

fn reader(path: &Path) -> Result<Reader, Stop> {
    let file = open(path)?;
    let size = file.metadata().map_err(|error| unreadable(path, &error))?;
    let bytes = Parts::new("reading the recording", size.len());
    let counted = Counted { file, bytes };
    Ok(McapReader::new(BufReader::with_capacity(1 << 18, counted)))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Stop {
    Stop::Failed(format!("{}: cannot be read: {error}", shown::path(path)))
}

/// Refuses a file that is no recording in chunks.
fn known(path: &Path, findings: &Findings) -> Result<(), Stop> {
    let mut begin = [0; MAGIC.len()];
    let is_mcap = open(path)?.read(&mut begin).is_ok() && begin == MAGIC;
    let message = match &findings.foreign {
        Some(foreign) => format!("is an MCAP file, but no recording of taxel: {foreign}"),
        None if findings.chunks == 0 && !is_mcap => {
            "is no recording of taxel live --record\nhelp: CSV recordings are played with taxel live --source replay:FILE; taxel recording import makes one of the files of other programs".into()
        }
        None => return Ok(()),
    };
    Err(Stop::WrongInput(format!(
        "{}: {message}",
        shown::path(path)
    )))
}

/// What a recording has, and what is wrong with it.
struct Survey {
    findings: Findings,
    links: Vec<LinkMessage>,
    channels: usize,
    device_times: Option<[u64; 2]>,
    longest_pause_ns: u64,
    /// Messages of each topic, in the order of [`Topic::ALL`], that this version cannot read.
    unreadable: [u64; Topic::ALL.len()],
}

fn survey(path: &Path) -> Result<Survey, Stop> {
    import::refuse(path)?;
    let mut reader = reader(path)?;
    let (mut links, mut channels) = (Vec::new(), 0);
    let mut device_times: Option<[u64; 2]> = None;
    let mut newest = None;
    let mut longest_pause_ns = 0;
    let mut unread = [0; Topic::ALL.len()];
    while let Some(entry) = reader.next().map_err(|error| unreadable(path, &error))? {
        if !entry.topic.reads(entry.bytes) {
            unread[usize::from(entry.topic.number()) - 1] += 1;
        }
        match entry.topic {
            Topic::Raw => {
                let time = entry.publish_time;
                let [first, last] = device_times.unwrap_or([time; 2]);
                device_times = Some([first.min(time), last.max(time)]);
                let pause = entry
                    .log_time
                    .saturating_sub(newest.unwrap_or(entry.log_time));
                longest_pause_ns = longest_pause_ns.max(pause);
                newest = Some(entry.log_time);
                if channels == 0 {
                    let frame = taxel_recording::mcap::FrameMessage::decode(entry.bytes);
                    channels = frame.map_or(0, |message| message.frame.values.len());
                }
            }
            Topic::Link => links.extend(LinkMessage::decode(entry.bytes)),
            _ => {}
        }
    }
    let findings = reader.into_findings();
    known(path, &findings)?;
    Ok(Survey {
        findings,
        links,
        channels,
        device_times,
        longest_pause_ns,
        unreadable: unread,
    })
}

impl Survey {
    fn well(&self) -> bool {
        self.findings.finished && self.has_all()
    }

    /// True if nothing is missing or damaged in what was written.
    fn has_all(&self) -> bool {
        let findings = &self.findings;
        !findings.is_damaged()
            && findings.missing.iter().all(|missing| *missing == 0)
            && findings.second.is_none()
            && self.unreadable == [0; Topic::ALL.len()]
    }

    /// In words.
    fn state(&self) -> String {
        let findings = &self.findings;
        let mut faults = Vec::new();
        if findings.damage_count > 0 && findings.is_damaged() {
            faults.push(format!("damaged in {} places", findings.damage_count));
        }
        let missing: u64 = findings.missing.iter().sum();
        if missing > 0 {
            faults.push(format!("{missing} messages are missing"));
        }
        for (topic, unreadable) in Topic::ALL.into_iter().zip(self.unreadable) {
            if unreadable > 0 {
                let (all, name) = (findings.messages(topic), topic.name());
                faults.push(format!(
                    "{unreadable} of {all} messages of {name} cannot be read"
                ));
            }
        }
        if findings.late_chunks + findings.foreign_chunks > 0 {
            faults.push("parts are out of order or of another recording".into());
        }
        if let Some(at) = findings.second {
            faults.push(format!("another recording follows at byte {at}"));
        }
        if !findings.finished {
            faults.push("not finished".into());
        }
        if faults.is_empty() {
            return "whole".into();
        }
        faults.join("; ")
    }

    fn fields(&self, path: &Path) -> Map<String, Value> {
        let findings = &self.findings;
        let seconds = |ns: u64| json!(ns as f64 * 1e-9);
        let span = |times: Option<[u64; 2]>| {
            times.map_or(Value::Null, |[first, last]| {
                seconds(last.saturating_sub(first))
            })
        };
        let frames = findings.messages(Topic::Raw);
        let rate = self.device_times.and_then(|[first, last]| {
            let span = last.saturating_sub(first) as f64 * 1e-9;
            (frames > 1 && span > 0.0).then(|| (frames - 1) as f64 / span)
        });
        let counts = |of: &dyn Fn(Topic) -> u64| -> Value {
            let known = Topic::ALL.into_iter().filter(|channel| of(*channel) > 0);
            let counts = known.map(|channel| (channel.name().to_owned(), json!(of(channel))));
            counts.collect::<Map<_, _>>().into()
        };
        let start = findings.times.map_or(0, |[first, _]| first);
        let damages = findings.damages.iter().map(|damage| {
            let after = damage.after_utc_ns;
            json!({
                "from_byte": damage.from,
                "to_byte": damage.to,
                "after_s": after.map(|after| after.saturating_sub(start) as f64 * 1e-9),
            })
        });
        let segments = self.links.iter().map(|link| link.segment).max();
        let attachments = findings.attachments.iter();
        let attachments =
            attachments.map(|one| json!({ "name": one.name, "bytes": one.bytes.len() }));
        let pairs = [
            ("file", json!(shown::path(path))),
            ("state", json!(self.state())),
            ("finished", json!(findings.finished)),
            ("bytes", json!(findings.bytes)),
            ("chunks", json!(findings.chunks)),
            (
                "begun_utc_ns",
                findings
                    .times
                    .map_or(Value::Null, |[first, _]| json!(first)),
            ),
            ("duration_s", span(findings.times)),
            ("device_duration_s", span(self.device_times)),
            ("frames", json!(frames)),
            ("rate_hz", json!(rate)),
            ("longest_pause_s", seconds(self.longest_pause_ns)),
            ("channels", json!(self.channels)),
            ("segments", json!(segments.map_or(1, |segment| segment + 1))),
            ("messages", counts(&|channel| findings.messages(channel))),
            ("missing", counts(&|channel| findings.missing(channel))),
            (
                "unreadable",
                counts(&|channel| self.unreadable[usize::from(channel.number()) - 1]),
            ),
            ("damages", damages.collect()),
            ("damage_count", json!(findings.damage_count)),
            ("attachments", attachments.collect()),
        ];
        let facts = findings
            .metadata
            .iter()
            .flat_map(|metadata| &metadata.pairs);
        let listed = [
            "command",
            "version",
            "commit",
            "source",
            "sensor",
            "sensor_sha256",
        ];
        let facts = facts.filter(|(key, _)| listed.contains(&key.as_str()));
        let facts = facts.map(|(key, value)| (format!("recorded_{key}"), json!(value)));
        let pairs = pairs
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value));
        pairs.chain(facts).collect()
    }
}

/// What is known of a file, and whether it is whole.
struct Inspected {
    fields: Map<String, Value>,
    whole: bool,
}

fn inspect(arguments: &Inspect) -> Result<Done, Stop> {
    let inspected = arguments.files.iter().map(|file| {
        if let Some(foreign) = import::inspect(file, arguments.format)? {
            return Ok(foreign);
        }
        let survey = survey(file)?;
        Ok(Inspected {
            fields: survey.fields(file),
            whole: survey.well(),
        })
    });
    let inspected: Vec<_> = inspected.collect::<Result<_, Stop>>()?;
    outputs::print(&in_format(&inspected, arguments.format))?;
    Ok(if inspected.iter().all(|file| file.whole) {
        Done::Complete
    } else {
        Done::WithLosses
    })
}

/// Facts one below the other, or a row for each file; in JSON an object, of several files a list.
fn in_format(files: &[Inspected], format: Format) -> String {
    let plain = |value: &Value| match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    let all = files.iter().map(|file| &file.fields);
    match format {
        Format::Json => {
            let mut objects: Vec<_> = all.cloned().map(Value::Object).collect();
            let one = objects.pop_if(|_| files.len() == 1);
            table::json(&one.unwrap_or(Value::Array(objects)))
        }
        Format::Csv => {
            let mut keys: Vec<&String> = Vec::new();
            for key in all.clone().flat_map(Map::keys) {
                if !keys.contains(&key) {
                    keys.push(key);
                }
            }
            let row = |fields: &Map<String, Value>| {
                let text = |key| fields.get(key).map_or_else(String::new, plain);
                keys.iter().map(|key| text(*key).into()).collect()
            };
            let columns: Vec<_> = keys.iter().copied().map(table::Column::plain).collect();
            table::render(
                table::Format::Csv,
                &Map::new(),
                &columns,
                &all.map(row).collect::<Vec<_>>(),
            )
        }
        Format::Table => {
            let line = |(key, value): (&String, &Value)| match value {
                Value::Null => String::new(),
                value => format!("{key:<24} {}\n", plain(value)),
            };
            let files: Vec<String> = all
                .map(|fields| fields.iter().map(line).collect())
                .collect();
            files.join("\n")
        }
    }
}

/// A file that is written.
struct NewFile<'a>(&'a mut File);

impl Write for NewFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl Storage for NewFile<'_> {
    fn sync(&mut self) -> std::io::Result<()> {
        self.0.sync_data()
    }

    fn cut(&mut self, length: u64) -> std::io::Result<()> {
        self.0.set_len(length)
    }
}

/// Writes the whole chunks of `file` within `times`, ns of UTC, as a new recording.
fn rewritten(
    file: &Path,
    output: &Path,
    times: &RangeInclusive<u64>,
    existing: outputs::Existing,
) -> Result<u64, Stop> {
    outputs::write_file(output, existing, |new| {
        let done = rewrite(open(file)?, times, &library(), NewFile(new));
        let done = done.map_err(|error| cannot_write(output, &error))?;
        if done.messages == 0 {
            let file = shown::path(file);
            let message = format!("{file}: no whole chunk of a recording of taxel is in it");
            return Err(Stop::WrongInput(message));
        }
        Ok(done.messages)
    })
}

fn check_new(file: &PathBuf, output: &PathBuf, existing: outputs::Existing) -> Result<(), Stop> {
    if outputs::is_standard(output) {
        let message = "-o -: a recording cannot go to the standard output; name a file";
        return Err(Stop::WrongInput(message.into()));
    }
    outputs::check(&[("-o", Some(output))], &[file], existing)
}

fn repair(arguments: &Repair) -> Result<Done, Stop> {
    let Repair { file, output, .. } = arguments;
    let existing = arguments.overwrite.existing();
    check_new(file, output, existing)?;
    let survey = survey(file)?;
    let messages = rewritten(file, output, &(0..=u64::MAX), existing)?;
    let findings = &survey.findings;
    let mut report = format!(
        "{}: {}\n{}: {messages} messages, {} frames\n",
        shown::path(file),
        survey.state(),
        shown::path(output),
        findings.messages(Topic::Raw)
    );
    let start = findings.times.map_or(0, |[first, _]| first);
    let at = |utc_ns: u64| utc_ns.saturating_sub(start) as f64 * 1e-9;
    for damage in &findings.damages {
        let after = damage
            .after_utc_ns
            .map_or("before the first message".into(), |utc_ns| {
                format!("after {:.3} s", at(utc_ns))
            });
        let _ = writeln!(
            report,
            "  bytes {} to {} left out, {after}",
            damage.from, damage.to
        );
    }
    for topic in Topic::ALL {
        let missing = findings.missing(topic);
        if missing > 0 {
            let topic = topic.name();
            let _ = writeln!(report, "  {missing} messages of {topic} are missing");
        }
    }
    outputs::print(&report)?;
    // One that was not finished is now.
    Ok(if survey.has_all() {
        Done::Complete
    } else {
        Done::WithLosses
    })
}

fn cut(arguments: &Cut) -> Result<Done, Stop> {
    let Cut { file, output, .. } = arguments;
    let existing = arguments.overwrite.existing();
    check_new(file, output, existing)?;
    let survey = survey(file)?;
    let Some([first, last]) = survey.findings.times else {
        let message = format!("{}: there is no message in it", shown::path(file));
        return Err(Stop::WrongInput(message));
    };
    let duration = (last - first) as f64 * 1e-9;
    let to = arguments.to.unwrap_or(duration);
    if arguments.from >= to || arguments.from > duration {
        return Err(Stop::WrongInput(format!(
            "--from {} s --to {to} s: must be a stretch of the {duration:.3} s of the recording, from before to",
            arguments.from
        )));
    }
    let time = |seconds: f64| first + (seconds * 1e9) as u64;
    let end = if to >= duration { last } else { time(to) };
    let messages = rewritten(file, output, &(time(arguments.from)..=end), existing)?;
    let text = format!("{}: {messages} messages\n", shown::path(output));
    outputs::print(&text)?;
    Ok(if survey.findings.is_damaged() {
        note!("note: {} is {}", shown::path(file), survey.state());
        Done::WithLosses
    } else {
        Done::Complete
    })
}

/// The library in the head of a recording for another program, which is none of ours: its parts are topics.
const TOPICS: &str = concat!("ROS 2 topics by taxel ", env!("CARGO_PKG_VERSION"));

/// What makes the messages of the program that a recording is exported for.
fn companion(arguments: &Export, meaning: &ExportMeaning) -> Result<Arc<dyn Companion>, Stop> {
    Ok(match arguments.program.unwrap_or(RecordFor::Ros2) {
        // Nothing but this is needed, so that the sensor may be unknown.
        RecordFor::Ros2 => Arc::new(Ros2Messages {
            columns: meaning.columns,
        }),
        RecordFor::Foxglove => {
            let live = played(&arguments.file)?;
            let session = live::session(&live, live::options(&live)?)?;
            messages_for(RecordFor::Foxglove, session.touch.meaning())
        }
    })
}

fn export(arguments: &Export) -> Result<Done, Stop> {
    let Export { file, output, .. } = arguments;
    let existing = arguments.overwrite.existing();
    let ending = output.extension().and_then(|ending| ending.to_str());
    if arguments.program.is_some() && ending != Some("mcap") {
        let output = shown::path(output);
        let message = format!(
            "--for: -o {output} is for any program; end its name in .mcap, or leave --for out"
        );
        return Err(Stop::WrongInput(message));
    }
    let survey = survey(file)?;
    let meaning = RunFiles::meaning(&survey.findings, survey.channels);
    let failed = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::InvalidInput => {
            Stop::WrongInput(format!("{}: {error}", shown::path(file)))
        }
        _ => cannot_write(output, &error),
    };
    let text = match ending {
        Some("csv" | "npz" | "mcap") => {
            check_new(file, output, existing)?;
            let frames = outputs::write_file(output, existing, |new| {
                let out = BufWriter::with_capacity(1 << 16, new);
                let source = reader(file)?;
                let frames = match ending {
                    Some("csv") => write_csv(source, &meaning, out),
                    Some("npz") => write_npz(source, &meaning, out),
                    _ => write_accompanied(source, &*companion(arguments, &meaning)?, TOPICS, out),
                };
                frames.map_err(failed)
            })?;
            format!("{}: {frames} frames\n", shown::path(output))
        }
        Some(other) if !output.is_dir() => {
            return Err(Stop::WrongInput(format!(
                "-o {}: \".{other}\" is not written; end the name in .csv, .npz or .mcap, or name a folder without a point in its name",
                shown::path(output)
            )));
        }
        _ => {
            let names = tables(file, output, &survey.findings, &meaning)?;
            format!("{}: {}\n", shown::path(output), names.join(", "))
        }
    };
    outputs::print(&text)?;
    if survey.well() {
        return Ok(Done::Complete);
    }
    note!("note: {} is {}", shown::path(file), survey.state());
    Ok(Done::WithLosses)
}

/// Writes a folder that is new: it is made beside its place and then moved there.
fn tables(
    file: &Path,
    output: &Path,
    findings: &Findings,
    meaning: &ExportMeaning,
) -> Result<Vec<String>, Stop> {
    let failed = |error: std::io::Error| cannot_write(output, &error);
    if std::fs::symlink_metadata(output).is_ok() {
        let output = shown::path(output);
        let message = format!("-o {output}: the folder exists; name a new one");
        return Err(Stop::WrongInput(message));
    }
    let parent = output
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty());
    let parent = parent.unwrap_or(Path::new("."));
    let beside = parent.join(format!(".taxel-{}.part", std::process::id()));
    let source = reader(file)?;
    std::fs::create_dir(&beside).map_err(failed)?;
    let write = || -> std::io::Result<Vec<String>> {
        let mut open = |name: &str| -> std::io::Result<Box<dyn Write>> {
            let file = File::create_new(beside.join(name))?;
            Ok(Box::new(BufWriter::with_capacity(1 << 16, file)))
        };
        let names = write_tables(source, meaning, &mut open)?;
        let mut names: Vec<String> = names.into_iter().map(str::to_owned).collect();
        for (place, attachment) in findings.attachments.iter().enumerate() {
            // The names in a file are anyone's.
            let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
            let is_plain = attachment.name.chars().all(plain)
                && !attachment.name.starts_with('.')
                && (1..100).contains(&attachment.name.len())
                && !names.contains(&attachment.name);
            let name = if is_plain {
                attachment.name.clone()
            } else {
                format!("attachment-{place}")
            };
            File::create_new(beside.join(&name))?.write_all(&attachment.bytes)?;
            names.push(name);
        }
        std::fs::rename(&beside, output)?;
        Ok(names)
    };
    write().map_err(|error| {
        let _ = std::fs::remove_dir_all(&beside);
        failed(error)
    })
}

/// `taxel live` on the frames of a recording, as fast as possible.
fn played(file: &Path) -> Result<crate::arguments::Live, Stop> {
    let source = format!("--source=replay:{}", shown::path(file));
    let line = ["taxel", "live", "--headless", "--speed", "max", &source];
    let live = match Arguments::try_parse_from(line).map(|arguments| arguments.command) {
        Ok(Command::Live(live)) => live.each().ok().and_then(|mut each| each.pop()),
        _ => None,
    };
    live.ok_or_else(|| Stop::Failed(format!("{}: cannot be played", shown::path(file))))
}
