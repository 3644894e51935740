//! The recorder from several threads, and on disks that fail.

use std::io::{Error, ErrorKind, Result, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use taxel_recording::Frame;
use taxel_recording::mcap::{McapReader, Message as _};

use super::*;

fn stream() -> Stream {
    Stream::of_counts([4, 4], [2e-3; 2], 1, 1e-3)
}

fn file(path: PathBuf, told: fn(&str)) -> RecordFile {
    RecordFile {
        path,
        library: "test".into(),
        attachments: Vec::new(),
        metadata: Vec::new(),
        companion: None,
        when_failing: WhenRecordingFails::GoOn,
        told,
    }
}

fn frame(sequence: u64) -> FrameMessage {
    let frame = Frame {
        sequence,
        time_ns: sequence * 1_000_000,
        values: vec![sequence as f64; 16],
        ..Frame::default()
    };
    FrameMessage { utc_ns: 0, frame }
}

#[test]
fn every_topic_is_recorded_from_any_thread() {
    let path = std::env::temp_dir().join(format!("taxel-recorder-{}.mcap", std::process::id()));
    let _ = std::fs::remove_file(&path);
    let file = file(path.clone(), |_| ());
    let recorder = Recorder::create(&file, &stream(), false, Pace::Waits).unwrap();
    std::thread::scope(|scope| {
        scope.spawn(|| (0..500).for_each(|sequence| recorder.raw(frame(sequence))));
        let link = recorder.clone();
        scope.spawn(move || {
            for host_ns in 0..100 {
                link.wire(WireMessage {
                    host_ns,
                    bytes: vec![7; 20],
                    ..WireMessage::default()
                });
            }
            link.link(LinkMessage::default());
            link.clock(ClockMessage::default());
        });
    });
    recorder.touch(TouchMessage::default());
    recorder.event(EventMessage::default());
    recorder.rest(RestMessage::default());
    recorder.health(HealthMessage::default());
    recorder.mark(MarkMessage::default());
    let summary = recorder.finish();
    assert_eq!(
        (summary.messages, summary.lost, summary.failure),
        (607, 0, None)
    );
    // What comes later is left out.
    recorder.mark(MarkMessage::default());
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(bytes.len() as u64, summary.bytes);
    let mut reader = McapReader::new(bytes.as_slice());
    let mut numbers = Vec::new();
    while let Some(entry) = reader.next().unwrap() {
        if entry.topic == Topic::Raw {
            numbers.push(FrameMessage::decode(entry.bytes).unwrap().frame.sequence);
        }
    }
    assert!(numbers.into_iter().eq(0..500));
    let findings = reader.findings();
    assert!(findings.finished && !findings.is_damaged());
    assert_eq!(findings.messages, [100, 500, 1, 1, 1, 1, 1, 1, 1]);
}

/// A disk that takes so many bytes, or whose sync fails.
struct Failing {
    room: usize,
    syncs: bool,
}

impl Write for Failing {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let taken = bytes.len().min(self.room);
        if taken == 0 {
            return Err(Error::from(ErrorKind::StorageFull));
        }
        self.room -= taken;
        Ok(taken)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Storage for Failing {
    fn sync(&mut self) -> Result<()> {
        Ok(())
    }

    fn cut(&mut self, _: u64) -> Result<()> {
        Ok(())
    }
}

impl disk::Syncs for Failing {
    fn syncer(&self) -> Result<Box<dyn FnMut() -> Result<()> + Send>> {
        let syncs = self.syncs;
        Ok(Box::new(move || {
            if syncs {
                return Ok(());
            }
            Err(Error::other("the disk is gone"))
        }))
    }
}

static TOLD: AtomicU64 = AtomicU64::new(0);

#[test]
fn a_failing_disk_is_told_once_and_nothing_waits() {
    let file = file(PathBuf::from("a.mcap"), |_| {
        TOLD.fetch_add(1, Ordering::Relaxed);
    });
    let disks = [(40_000, true), (1 << 30, false)];
    for (count, (room, syncs)) in disks.into_iter().enumerate() {
        let disk = Failing { room, syncs };
        let description = description_of(&stream()).unwrap();
        let recorder = Recorder::start(&file, description, None, Pace::Device, disk).unwrap();
        let begun = Instant::now();
        let mut sequence = 0;
        while recorder.failure().is_none() {
            assert!(
                begun.elapsed() < Duration::from_secs(30),
                "no failure is noticed"
            );
            recorder.raw(frame(sequence));
            sequence += 1;
            std::thread::sleep(Duration::from_millis(1));
        }
        // The run goes on.
        (0..10_000).for_each(|sequence| recorder.raw(frame(sequence)));
        let summary = recorder.finish();
        assert!(summary.failure.unwrap().contains("the measurement goes on"));
        assert_eq!(TOLD.load(Ordering::Relaxed), count as u64 + 1);
    }
}
