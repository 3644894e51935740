//! Recordings in chunks: read by another program, torn, damaged and written to full disks.
//!
//! The long forms are run by `cargo test --release -p taxel-recording --test mcap -- --ignored --nocapture`.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::print_stdout, reason = "the long forms print their figures")]

use std::collections::BTreeMap;
use std::io::{Cursor, Error, ErrorKind, Result, Write};

use taxel_recording::foreign::{ForeignFile, Seekable};
use taxel_recording::mcap::{
    Attachment, EventMessage, FrameMessage, LinkMessage, MarkMessage, McapReader, McapWriter,
    Message, Metadata, RecordingHead, RestMessage, Storage, Topic, TouchMessage, WireMessage,
    rewrite,
};
use taxel_recording::{
    ForeignFormat, Format, Frame, Recording, RecordingError, Stream, description_of,
};

const START: u64 = 1_800_000_000_000_000_000;
const CHANNELS: usize = 16;
const LIBRARY: &str = "taxel test";

/// Numbers that follow from a seed (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// The frame of a number: every byte follows from it.
fn frame(run: u64, sequence: u64) -> Frame {
    let mut random = Random(run << 32 ^ sequence);
    Frame {
        sequence,
        time_ns: sequence * 1_000_000,
        values: (0..CHANNELS).map(|_| random.next() as f64).collect(),
        host_ns: Some(sequence * 1_000_000 + 17),
        ..Frame::default()
    }
}

fn stream() -> Stream {
    let mut stream = Stream::of_counts([4, 4], [2e-3; 2], 1, 1e-3);
    stream.name = "test".into();
    stream
}

fn head() -> RecordingHead {
    RecordingHead {
        library: LIBRARY.into(),
        utc_ns: START,
        description: description_of(&stream()).unwrap(),
        attachments: vec![Attachment {
            name: "sensor.toml".into(),
            media_type: "application/toml".into(),
            bytes: b"schema = 2\n# and so on\n".repeat(100),
        }],
        metadata: vec![Metadata {
            name: "run".into(),
            pairs: vec![("command".into(), "taxel live".into())],
        }],
    }
}

/// Writes frames from `from` on, a chunk every 100 ms and a sync every second, and gives the
/// number of the first frame that is not surely kept to `synced`.
fn record<S: Storage>(
    writer: &mut McapWriter<S>,
    run: u64,
    frames: std::ops::Range<u64>,
    mut synced: impl FnMut(&McapWriter<S>, u64),
) -> Result<()> {
    for sequence in frames {
        let utc_ns = START + run * 3_600_000_000_000 + sequence * 1_000_000;
        let frame = frame(run, sequence);
        writer.message(utc_ns, &FrameMessage { utc_ns, frame })?;
        let touch = TouchMessage {
            sequence,
            device_time_ns: sequence * 1_000_000,
            components: 1,
            values: vec![sequence as f32; CHANNELS],
            ..TouchMessage::default()
        };
        writer.message(utc_ns, &touch)?;
        if sequence % 250 == 0 {
            let text = format!("mark {sequence}");
            let mark = MarkMessage {
                utc_ns,
                text,
                ..MarkMessage::default()
            };
            writer.message(utc_ns, &mark)?;
        }
        if sequence % 1000 == 999 {
            writer.sync()?;
            synced(writer, sequence + 1);
        } else if sequence % 100 == 99 {
            writer.flush()?;
        }
    }
    Ok(())
}

fn recorded(run: u64, frames: u64) -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new(), &head()).unwrap();
    record(&mut writer, run, 0..frames, |_, _| ()).unwrap();
    writer.finish().unwrap()
}

/// Numbers of the frames that a file gives; every one of them is right.
fn good(bytes: &[u8], run: u64, about: &str) -> Vec<u64> {
    let mut reader = McapReader::new(bytes);
    let mut numbers = Vec::new();
    while let Some(entry) = reader.next().unwrap() {
        match entry.topic {
            Topic::Raw => {
                let message = FrameMessage::decode(entry.bytes).unwrap();
                let number = message.frame.sequence;
                assert_eq!(message.frame, frame(run, number), "wrong frame: {about}");
                assert_eq!(u64::from(entry.sequence), number, "{about}");
                numbers.push(number);
            }
            Topic::Touch => {
                let touch = TouchMessage::decode(entry.bytes).unwrap();
                let value = touch.sequence as f32;
                assert_eq!(touch.values, [value; CHANNELS], "wrong touch: {about}");
            }
            _ => {}
        }
    }
    numbers
}

#[test]
fn another_program_reads_every_channel() {
    let mut writer = McapWriter::new(Vec::new(), &head()).unwrap();
    record(&mut writer, 0, 0..2500, |_, _| ()).unwrap();
    writer.message(START, &WireMessage::default()).unwrap();
    writer.message(START, &EventMessage::default()).unwrap();
    writer.message(START, &LinkMessage::default()).unwrap();
    writer.message(START, &RestMessage::default()).unwrap();
    let file = writer.finish().unwrap();
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut last = 0;
    for message in mcap::MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
        let known = Topic::of_number(message.channel.id).unwrap();
        assert_eq!(message.channel.topic, known.name());
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!(
            (&*schema.name, &*schema.encoding),
            (known.type_name(), "ros2msg")
        );
        assert_eq!(message.channel.message_encoding, "cdr");
        assert!(message.log_time >= last);
        last = message.log_time;
    }
    assert_eq!(counts["/taxel/raw"], 2500);
    assert_eq!(counts["/taxel/touch"], 2500);
    assert_eq!(counts["/taxel/wire"], 1);
    // The summary says the same, and leads to each chunk and its index.
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let statistics = summary.stats.as_ref().unwrap();
    assert_eq!(statistics.message_count, counts.values().sum::<u64>());
    assert_eq!(statistics.chunk_count as usize, summary.chunk_indexes.len());
    assert_eq!(statistics.channel_message_counts[&2], 2500);
    let mut found = 0;
    for chunk in &summary.chunk_indexes {
        found += summary.stream_chunk(&file, chunk).unwrap().count();
        let indices = summary.read_message_indexes(&file, chunk).unwrap();
        for (channel, entries) in indices {
            for entry in entries {
                let message = summary.seek_message(&file, chunk, &entry).unwrap();
                assert_eq!(message.channel.id, channel.id);
                assert_eq!(message.log_time, entry.log_time);
            }
        }
    }
    assert_eq!(found as u64, statistics.message_count);
    let attachment = &summary.attachment_indexes[1];
    let attachment = mcap::read::attachment(&file, attachment).unwrap();
    assert_eq!(attachment.name, "sensor.toml");
    assert_eq!(*attachment.data, *head().attachments[0].bytes);
    let metadata = mcap::read::metadata(&file, &summary.metadata_indexes[0]).unwrap();
    assert_eq!(metadata.metadata["command"], "taxel live");
}

#[test]
fn frames_are_played_like_those_of_any_recording() {
    let file = recorded(3, 500);
    let mut recording = Recording::open("a.mcap", file.as_slice()).unwrap();
    assert_eq!(recording.format(), Format::Chunks);
    assert_eq!(recording.stream(), &stream());
    let frames: Vec<_> = (&mut recording)
        .map(|frame: std::result::Result<_, RecordingError>| frame.unwrap())
        .collect();
    assert_eq!(frames.len(), 500);
    assert!((0..500).all(|at| frames[at as usize] == frame(3, at)));
    // One that was not finished is told from one that was, and gives its frames.
    let cut = &file[..file.len() * 3 / 4];
    let mut recording = Recording::open("a.mcap", cut).unwrap();
    let mut last = None;
    let frames = (&mut recording).map_while(|frame| {
        frame
            .inspect_err(|error| last = Some(error.to_string()))
            .ok()
    });
    let count = frames.count();
    assert!(count >= 300 && count % 100 == 0, "{count}");
    assert!(last.unwrap().contains("is cut off after"));
    let mut damaged = file.clone();
    damaged[file.len() / 2] ^= 1;
    let error = Recording::open("a.mcap", damaged.as_slice())
        .unwrap()
        .find_map(std::result::Result::err)
        .unwrap();
    assert!(error.to_string().contains("repair"), "{error}");
}

#[test]
fn files_of_other_programs_are_known_by_kind_and_topics() {
    let mut out = Vec::new();
    let mut writer = mcap::Writer::new(Cursor::new(&mut out)).unwrap();
    let channel = writer
        .add_channel(0, "/camera", "json", &BTreeMap::new())
        .unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 1,
        publish_time: 1,
    };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    drop(writer);
    let error = Recording::open("a.mcap", out.as_slice()).unwrap_err();
    assert!(
        error.to_string().contains("MCAP of another program"),
        "{error}"
    );
    let files: Vec<(String, Box<dyn Seekable>)> =
        vec![("a.mcap".into(), Box::new(Cursor::new(out)))];
    let found = ForeignFile::open("a.mcap", ForeignFormat::Mcap, files).unwrap();
    assert_eq!(
        (&*found.parts()[0].name, found.parts()[0].count),
        ("/camera", 1)
    );
    let why = found.parts()[0].unread.as_deref();
    assert!(why.is_some_and(|why| why.contains("json")), "{why:?}");
}

// --- What a power cut leaves -------------------------------------------------------------

/// What was done to a file, in its order.
#[derive(Debug, Clone)]
enum Step {
    Write(Vec<u8>),
    Sync,
}

/// Logs the writes of a run.
#[derive(Debug, Default)]
struct Log(Vec<Step>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.push(Step::Write(bytes.to_vec()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Storage for Log {
    fn sync(&mut self) -> Result<()> {
        self.0.push(Step::Sync);
        Ok(())
    }

    fn cut(&mut self, _: u64) -> Result<()> {
        Ok(())
    }
}

/// Bytes that a disk writes whole.
const SECTOR: usize = 512;

/// The file after a power cut before step `end`: all that was synced, and of the writes behind
/// it each sector or not. The length may be that of any of them, with zeros where none came.
fn after_power_cut(steps: &[Step], random: &mut Random) -> Vec<u8> {
    let synced = steps.iter().rposition(|step| matches!(step, Step::Sync));
    // From every second sector to one in thousands: whole chunks may follow lost ones.
    let rarity = [2, 100, 1000, 5000][random.below(4)];
    let mut file = Vec::new();
    for (at, step) in steps.iter().enumerate() {
        let Step::Write(bytes) = step else { continue };
        let offset = file.len();
        file.extend_from_slice(bytes);
        if synced.is_none_or(|synced| at > synced) {
            for sector in file[offset..].chunks_mut(SECTOR) {
                if random.below(rarity) == 0 {
                    sector.fill(0);
                }
            }
        }
    }
    file
}

fn power_cuts(cases: usize) {
    // The log of 12 s, and how many frames were synced before each step.
    let mut writer = McapWriter::new(Log::default(), &head()).unwrap();
    record(&mut writer, 0, 0..12_000, |_, _| ()).unwrap();
    let steps = writer.finish().unwrap().0;
    let mut kept = vec![0; steps.len() + 1];
    let mut seconds = 0;
    for (at, step) in steps.iter().enumerate() {
        seconds += u64::from(matches!(step, Step::Sync));
        kept[at + 1] = (seconds * 1000).min(12_000);
    }
    let mut random = Random(1);
    let mut lost_most = 0;
    for case in 0..cases {
        let end = 1 + random.below(steps.len());
        let about = format!("case {case}, cut before step {end}");
        let mut file = after_power_cut(&steps[..end], &mut random);
        if random.below(2) == 0 {
            // Or only a beginning of what was not synced.
            let synced: usize = steps[..end]
                .iter()
                .rposition(|step| matches!(step, Step::Sync))
                .map_or(0, |synced| {
                    let writes = steps[..synced].iter();
                    writes
                        .map(|step| {
                            if let Step::Write(bytes) = step {
                                bytes.len()
                            } else {
                                0
                            }
                        })
                        .sum()
                });
            file = steps[..end]
                .iter()
                .flat_map(|step| {
                    if let Step::Write(bytes) = step {
                        &bytes[..]
                    } else {
                        &[]
                    }
                })
                .copied()
                .collect();
            let length = synced + random.below(file.len() - synced + 1);
            file.truncate(length);
        }
        let numbers = good(&file, 0, &about);
        let expected = kept[end];
        assert!(
            (0..expected).all(|number| numbers.get(number as usize) == Some(&number)),
            "{about}: {expected} frames were synced, {} are left",
            numbers.len()
        );
        let written = numbers.last().map_or(0, |last| last + 1);
        lost_most = lost_most.max(written - numbers.len() as u64);
    }
    println!(
        "{cases} power cuts: 0 wrong, nothing synced lost; largest hole behind the sync {lost_most} frames"
    );
}

#[test]
fn a_power_cut_costs_nothing_that_was_synced() {
    power_cuts(40);
}

#[test]
#[ignore = "long form"]
fn a_power_cut_costs_nothing_that_was_synced_long() {
    power_cuts(10_000);
}

// --- Damaged files -----------------------------------------------------------------------

/// What was done to a file.
#[derive(Debug, Clone, Copy)]
enum Harm {
    Bit,
    Zeros,
    CutOut,
    Swapped,
    Tail,
    Joined,
}

const HARMS: [Harm; 6] = [
    Harm::Bit,
    Harm::Zeros,
    Harm::CutOut,
    Harm::Swapped,
    Harm::Tail,
    Harm::Joined,
];

fn harm(file: &mut Vec<u8>, other: &[u8], kind: Harm, random: &mut Random) {
    let length = file.len();
    let block = 1 + random.below(SECTOR);
    let at = random.below(length - 2 * block);
    match kind {
        Harm::Bit => file[at] ^= 1 << random.below(8),
        Harm::Zeros => file[at..at + block].fill(0),
        Harm::CutOut => drop(file.drain(at..at + block)),
        Harm::Swapped => {
            let to = at + block + random.below(length - at - 2 * block + 1);
            let (front, back) = file.split_at_mut(to);
            front[at..at + block].swap_with_slice(&mut back[..block]);
        }
        Harm::Tail => file.truncate(at),
        Harm::Joined => file.extend_from_slice(other),
    }
}

fn damages(cases: usize) {
    let (file, other) = (recorded(0, 1500), recorded(1, 700));
    let mut random = Random(2);
    let mut most = [0; HARMS.len()];
    for case in 0..cases {
        let place = case % HARMS.len();
        let kind = HARMS[place];
        let about = format!("case {case}, {kind:?}");
        let mut harmed = file.clone();
        harm(&mut harmed, &other, kind, &mut random);
        let numbers = good(&harmed, 0, &about);
        let lost = match kind {
            // What follows a cut is not there.
            Harm::Tail => numbers.last().map_or(0, |last| last + 1) - numbers.len() as u64,
            _ => 1500 - numbers.len() as u64,
        };
        // A stretch may lie across the border of two chunks.
        let allowed = match kind {
            Harm::Bit => 100,
            Harm::Zeros | Harm::CutOut => 200,
            Harm::Swapped => 400,
            Harm::Tail | Harm::Joined => 0,
        };
        assert!(lost <= allowed, "{about}: {lost} frames lost");
        most[place] = most[place].max(lost);
        // The repaired file is whole, and has the same frames.
        if case % 10 < 6 {
            let again = repair(&harmed);
            let mut sorted = numbers.clone();
            sorted.sort_unstable();
            assert_eq!(good(&again, 0, &about), sorted, "{about}");
        }
    }
    for (kind, most) in HARMS.iter().zip(most) {
        println!(
            "{kind:?}: {} files, 0 wrong, at most {most} of 1500 frames lost (100 a chunk)",
            cases / HARMS.len()
        );
    }
}

/// What is whole of a file, as a finished recording.
fn repair(bytes: &[u8]) -> Vec<u8> {
    let shared = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    rewrite(
        Cursor::new(bytes),
        &(0..=u64::MAX),
        LIBRARY,
        Kept(shared.clone()),
    )
    .unwrap();
    let bytes = shared.borrow().clone();
    assert!(bytes.ends_with(&taxel_recording::mcap::MAGIC));
    bytes
}

/// A file in memory that is still there when its writer is gone.
#[derive(Debug, Clone)]
struct Kept(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

impl Write for Kept {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Storage for Kept {
    fn sync(&mut self) -> Result<()> {
        Ok(())
    }

    fn cut(&mut self, length: u64) -> Result<()> {
        self.0.borrow_mut().cut(length)
    }
}

#[test]
fn damage_costs_at_most_its_chunk_and_gives_nothing_wrong() {
    damages(120);
}

#[test]
#[ignore = "long form"]
fn damage_costs_at_most_its_chunk_and_gives_nothing_wrong_long() {
    damages(10_000);
}

// --- A full disk -------------------------------------------------------------------------

/// A disk with room for so many bytes.
#[derive(Debug, Clone)]
struct Full {
    file: Kept,
    room: usize,
    /// False for a disk that cannot even cut what is half written.
    cuts: bool,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let room = self.room - self.file.0.borrow().len();
        if room == 0 {
            return Err(Error::from(ErrorKind::StorageFull));
        }
        self.file.write(&bytes[..bytes.len().min(room)])
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Storage for Full {
    fn sync(&mut self) -> Result<()> {
        Ok(())
    }

    fn cut(&mut self, length: u64) -> Result<()> {
        if self.cuts {
            return self.file.cut(length);
        }
        Err(Error::from(ErrorKind::PermissionDenied))
    }
}

fn full_disks(rooms: impl Iterator<Item = usize>) {
    let mut count = 0;
    for room in rooms {
        let bytes = Kept(std::rc::Rc::default());
        let disk = Full {
            file: bytes.clone(),
            room,
            cuts: count % 2 == 0,
        };
        count += 1;
        let mut whole = 0;
        // The run goes on: later messages fail, and nothing panics.
        let Ok(mut writer) = McapWriter::new(disk, &head()) else {
            continue;
        };
        // 600 frames, each flushed alone, or as ever.
        for sequence in 0..60 {
            let utc_ns = START + sequence * 1_000_000;
            let frame = frame(0, sequence);
            let taken = writer.message(utc_ns, &FrameMessage { utc_ns, frame });
            if taken.and_then(|()| writer.flush()).is_ok() {
                assert_eq!(whole, sequence, "room for {room} bytes");
                whole += 1;
            }
        }
        let _ = writer.finish();
        let file = bytes.0.borrow().clone();
        let about = format!("room for {room} bytes");
        let repaired = repair(&file);
        // The last chunk may be whole when its index is not.
        let found = good(&repaired, 0, &about).len() as u64;
        assert!((whole..=whole + 1).contains(&found), "{about}");
    }
    println!("{count} full disks: no panic, every repaired file has all whole chunks");
}

#[test]
fn a_full_disk_keeps_all_whole_chunks() {
    full_disks((0..40_000).step_by(211));
}

#[test]
#[ignore = "long form"]
fn a_full_disk_keeps_all_whole_chunks_long() {
    full_disks(0..40_000);
    // 10 MB in chunks of the usual size, at every 1009th byte.
    for (count, room) in (0..10_000_000).step_by(1009).enumerate() {
        let bytes = Kept(std::rc::Rc::default());
        let disk = Full {
            file: bytes.clone(),
            room,
            cuts: count % 2 == 0,
        };
        let mut whole = 0;
        if let Ok(mut writer) = McapWriter::new(disk, &head()) {
            let ended = record(&mut writer, 0, 0..40_000, |_, _| ());
            assert!(ended.is_err() || writer.written() < room as u64);
            whole = writer.written();
            drop(writer);
        }
        let file = bytes.0.borrow().clone();
        assert!(file.len() as u64 >= whole);
        // Every whole chunk is read: all frames up to the last one.
        let about = format!("room for {room} bytes");
        let numbers = good(&file, 0, &about);
        assert_eq!(numbers.len() % 100, 0, "{about}");
        if count % 100 == 0 {
            assert_eq!(good(&repair(&file), 0, &about), numbers);
        }
    }
}

#[test]
fn any_bytes_are_read_to_their_end() {
    let mut random = Random(3);
    let file = recorded(0, 120);
    for _ in 0..200 {
        let mut bytes = file.clone();
        for _ in 0..=random.below(200) {
            let at = random.below(bytes.len());
            bytes[at] = random.next() as u8;
        }
        good(&bytes, 0, "random bytes");
        let _ = Recording::open("a.mcap", bytes.as_slice()).map(Iterator::count);
    }
    for length in 0..300 {
        let bytes: Vec<u8> = (0..length).map(|_| (random.next() & 15) as u8).collect();
        assert!(good(&bytes, 0, "noise").is_empty());
    }
    for length in (0..file.len()).step_by(97) {
        good(&file[..length], 0, "a beginning");
    }
}

#[test]
fn a_stretch_of_time_is_cut_out() {
    let file = recorded(0, 1000);
    let bytes = Kept(std::rc::Rc::default());
    let times = START + 300_000_000..=START + 499_000_000;
    let done = rewrite(Cursor::new(&file), &times, LIBRARY, bytes.clone()).unwrap();
    let mut reader = McapReader::new(Cursor::new(bytes.0.borrow().clone()));
    let mut numbers = Vec::new();
    while let Some(entry) = reader.next().unwrap() {
        if entry.topic == Topic::Raw {
            numbers.push(FrameMessage::decode(entry.bytes).unwrap().frame.sequence);
        }
    }
    assert!(numbers.into_iter().eq(300..500));
    assert_eq!(reader.findings().missing(Topic::Raw), 0);
    assert_eq!(done.messages, 400);
}

/// The package of messages for ROS 2 has the types of recordings, and builds all of them.
#[test]
fn the_package_of_messages_is_what_recordings_carry() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../clients/ros2/taxel_msgs/"
    );
    let read = |name: &str| std::fs::read_to_string(format!("{folder}{name}")).unwrap();
    let rule = "=".repeat(80);
    let mut types = BTreeMap::new();
    for topic in Topic::ALL {
        let definition = topic.definition();
        let mut parts = definition.split(&*rule);
        let own = parts.next().unwrap();
        types.insert(topic.type_name().to_owned(), own.to_owned());
        for part in parts {
            let (name, fields) = part.trim_start().split_once('\n').unwrap();
            let name = name.strip_prefix("MSG: ").unwrap();
            if let Some(name) = name.strip_prefix("taxel_msgs/") {
                types.insert(format!("taxel_msgs/msg/{name}"), fields.to_owned());
            }
        }
    }
    let built = read("CMakeLists.txt");
    let files = std::fs::read_dir(format!("{folder}msg")).unwrap();
    assert_eq!(files.count(), types.len());
    for (name, fields) in types {
        let file = name.replace("taxel_msgs/", "") + ".msg";
        assert_eq!(read(&file), fields, "{file}");
        assert!(built.contains(&format!("\"{file}\"")), "{file}");
    }
}
