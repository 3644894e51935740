//! A fast board for as long as a session: nothing is lost, and the program takes no more memory
//! at the end than at the beginning.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

#[path = "common/board.rs"]
mod board;
mod common;

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use board::{device, wait_until, web_socket};
use common::Folder;
use serde_json::Value;

/// A number from the environment, or the one of the short form.
fn setting(name: &str, usual: f64) -> f64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Memory of a process over time: s, MiB. Empty where the system does not tell.
struct Memory {
    samples: Vec<[f64; 2]>,
    descriptors: Vec<usize>,
}

impl Memory {
    /// Looks at the process ten times a second until it is over.
    fn watch(process: u32, over: &AtomicBool) -> Self {
        let began = Instant::now();
        let mut memory = Self {
            samples: Vec::new(),
            descriptors: Vec::new(),
        };
        while !over.load(Ordering::Relaxed) {
            if let Some(resident) = resident(process) {
                let seconds = began.elapsed().as_secs_f64();
                memory.samples.push([seconds, resident]);
            }
            if let Ok(folder) = fs::read_dir(format!("/proc/{process}/fd")) {
                memory.descriptors.push(folder.count());
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        memory
    }

    /// The samples without the start and without the end of the run, at which memory is given back.
    fn settled(&self) -> &[[f64; 2]] {
        let count = self.samples.len();
        &self.samples[count / 5..count - count / 20 - count.min(1)]
    }

    /// Slope of the least-squares line through the settled samples, MiB/h.
    fn slope(&self) -> Option<f64> {
        let settled = self.settled();
        let count = settled.len() as f64;
        let mean = |of: usize| settled.iter().map(|sample| sample[of]).sum::<f64>() / count;
        let (time, size) = (mean(0), mean(1));
        let [mut joint, mut square] = [0.0; 2];
        for sample in settled {
            joint += (sample[0] - time) * (sample[1] - size);
            square += (sample[0] - time).powi(2);
        }
        (square > 0.0).then(|| joint / square * 3600.0)
    }

    fn ends(&self) -> Option<[f64; 2]> {
        let settled = self.settled();
        Some([settled.first()?[1], settled.last()?[1]])
    }
}

/// Resident memory of a process without the files that it maps, MiB.
fn resident(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("RssAnon:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1024.0)
}

/// With the recorder, a client that reads and four that do not. At full length, on an idle machine:
/// `TAXEL_LOAD_HZ=1000 TAXEL_LOAD_SECONDS=600 cargo test --release -p taxel-cli --test load -- --nocapture`
#[test]
fn nothing_is_lost_with_a_recorder_and_four_stalled_clients() {
    let rate = setting("TAXEL_LOAD_HZ", 200.0);
    let seconds = setting("TAXEL_LOAD_SECONDS", 3.0);
    let folder = Folder::new("load");
    let board = board::board(&folder);
    let frames = (rate * seconds) as u64;
    for place in ["pty", "tcp:0"] {
        let device = device(&board, place, &["--rate", &format!("{rate} Hz")]);
        let source = match place {
            "pty" => format!("serial:{}", device.line),
            _ => device.line.clone(),
        };
        let recording = folder.path(&format!("{}.mcap", &place[..3]));
        let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(["live", "three-axis-8x8", "--port", "0", "--format", "json"])
            .args(["--board", &board, "--source", &source])
            .args(["--frames", &frames.to_string(), "--record", &recording])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let mut address = String::new();
        output.read_line(&mut address).unwrap();
        let stalled: Vec<_> = (0..4).map(|_| web_socket(address.trim())).collect();
        let mut reader = web_socket(address.trim());
        let read = std::thread::spawn(move || {
            std::io::copy(&mut reader, &mut std::io::sink()).unwrap_or(0)
        });
        let over = Arc::new(AtomicBool::new(false));
        let (process, ended) = (child.id(), Arc::clone(&over));
        let memory = std::thread::spawn(move || Memory::watch(process, &ended));
        let mut text = String::new();
        output.read_to_string(&mut text).unwrap();
        over.store(true, Ordering::Relaxed);
        child.wait().unwrap();
        drop(stalled);
        let memory = memory.join().unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        println!(
            "{place}: {} frames, lost {}, arrival to message p50 {} p99 {} s, to socket p50 {} p99 {} s",
            found["frames"],
            found["lost"],
            found["latency_s"]["p50"],
            found["latency_s"]["p99"],
            found["sent_latency_s"]["p50"],
            found["sent_latency_s"]["p99"]
        );
        println!(
            "{place}: memory {:.2?} MiB at the beginning and at the end, slope {:.2?} MiB/h, at most {:?} descriptors, recording {} MB",
            memory.ends(),
            memory.slope(),
            memory.descriptors.iter().max(),
            fs::metadata(&recording).unwrap().len() / 1_000_000
        );
        assert_eq!(
            (&found["frames"], &found["lost"]),
            (&frames.into(), &0.into()),
            "{place}"
        );
        assert_eq!(
            (&found["link"]["overrun"], &found["late"]),
            (&0.into(), &0.into())
        );
        assert!(
            found["recording"]["failure"].is_null(),
            "{}",
            found["recording"]
        );
        wait_until(|| read.is_finished());
        assert!(read.join().unwrap() > frames * 1000);
        // A queue that is not bounded would take this much within the short form.
        if let Some([begin, end]) = memory.ends() {
            assert!(end - begin < 16.0, "{place}: {begin} to {end} MiB");
        }
        if seconds >= 600.0 {
            assert!(memory.slope().is_none_or(|slope| slope < 1.0), "{place}");
        }
        drop(device);
        fs::remove_file(&recording).unwrap();
    }
}
