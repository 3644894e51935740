//! The live service under load: 1000 frames/s of the 256 channels of the 8 x 8 array to its recorder
//! and to four WebSocket clients, one of which never reads. Ends with 1 when a frame was lost at the
//! source, a message of the recording at the disk, or the memory of the service grew.
//!
//!     cargo run --release --bin live_load -- --seconds 60
//!
//! It starts itself as the service, so that its memory is measured without the clients'.

use std::error::Error;
use std::net::{Ipv4Addr, SocketAddr};
use std::process::{ExitCode, Stdio};
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use serde_json::{Value, json};
use taxel::acquisition::{Stimulus, Twin};
use taxel::sensor::Sensor;
use taxel_bench::figure;
use taxel_serve::{
    Latencies, Provenance, PumpOptions, RecordFile, RecordTo, Session, Source, TwinSource,
    WhenRecordingFails, run_with_page,
};
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::Command;
use tokio::task::JoinHandle;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;

/// Frames per second of the source.
const RATE: u64 = 1000;
/// Clients that read.
const READERS: usize = 3;
/// The memory is measured first after this time, s.
const SETTLED: u64 = 10;
/// Most growth of the memory after that.
const MOST_GROWTH: f64 = 0.1;
/// Offset of the sequence number in a frame's message (docs/live-protocol.md).
const SEQUENCE: std::ops::Range<usize> = 8..16;

type Failed = Box<dyn Error + Send + Sync>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let number = |text: &str| text.parse::<u64>().ok().filter(|number| *number > 0);
    let result = match words[..] {
        [] => load(60),
        ["--seconds", text] => number(text).map_or_else(usage, load),
        ["serve", text] => number(text).map_or_else(usage, serve),
        _ => usage(),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> Result<bool, Failed> {
    Err("usage: live_load [--seconds N]".into())
}

/// The service: prints its address, and its summary after `frames` frames.
fn serve(frames: u64) -> Result<bool, Failed> {
    let shipped = Sensor::shipped_text("three-axis-8x8").ok_or("not shipped")?;
    let text = shipped
        .replace("frame_rate = \"60 Hz\"", "frame_rate = \"1 kHz\"")
        .replace("row_time = \"1 ms\"", "row_time = \"50 us\"");
    let sensor = Sensor::parse("three-axis-8x8 at 1 kHz", &text)?;
    let script = Stimulus::shipped_text("finger").ok_or("not shipped")?;
    let twin = Twin::new(&sensor, &Stimulus::parse("finger", script)?, 1)?;
    let source = TwinSource::new(twin);
    if source.stream().period != Some(1.0 / RATE as f64) {
        return Err("the shipped sensor file has changed: its rate was not replaced".into());
    }
    let path = std::env::temp_dir().join(format!("live_load-{}.mcap", std::process::id()));
    let session = Session {
        touch: sensor.device()?.session(source.stream())?,
        source: Box::new(source),
        options: PumpOptions {
            frames: Some(frames),
            record: Some(RecordTo::File(Box::new(RecordFile {
                path: path.clone(),
                library: "live_load".into(),
                attachments: Vec::new(),
                metadata: Vec::new(),
                companion: None,
                when_failing: WhenRecordingFails::GoOn,
                told: |message| eprintln!("{message}"),
            }))),
            ..PumpOptions::default()
        },
        provenance: Provenance::default(),
        drawing: String::new(),
        marks: Vec::new(),
        replay: None,
        last_zero: None,
    };
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let summary = run_with_page(session, address, |page| {
        println!("{page}");
        Ok(())
    })?;
    if let Some(failure) = summary.failure {
        return Err(failure.into());
    }
    let counts = &summary.continuity;
    let recording = summary.recording.ok_or("nothing was recorded")?;
    std::fs::remove_file(&path)?;
    if let Some(failure) = recording.failure {
        return Err(failure.into());
    }
    let report = json!({
        "recorded": recording.messages,
        "recording_lost": recording.lost,
        "accepted": counts.accepted,
        "lost": counts.lost,
        "late": counts.late,
        "duplicate": counts.duplicate,
        "duration_s": summary.duration,
        "encoded": percentiles(&summary.latency),
        "sent": percentiles(&summary.sent),
        "messages": summary.sent.count(),
    });
    println!("{report}");
    Ok(true)
}

/// p50, p90, p99, p99.9 and largest, us.
fn percentiles(latencies: &Latencies) -> [f64; 5] {
    let [p50, p90, p99, p999] = [0.5, 0.9, 0.99, 0.999].map(|share| latencies.quantile(share));
    [p50, p90, p99, p999, latencies.largest()].map(|seconds| 1e6 * seconds)
}

fn load(seconds: u64) -> Result<bool, Failed> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()?;
    runtime.block_on(run(seconds))
}

async fn run(seconds: u64) -> Result<bool, Failed> {
    let frames = RATE * seconds;
    let mut service = Command::new(std::env::current_exe()?)
        .args(["serve", &frames.to_string()])
        .stdout(Stdio::piped())
        .kill_on_drop(true)
        .spawn()?;
    let process = service.id().ok_or("the service has ended")?;
    let mut lines = BufReader::new(service.stdout.take().ok_or("no stdout")?).lines();
    let page = lines
        .next_line()
        .await?
        .ok_or("the service did not start")?;
    let address = page.replace("http://", "ws://").replace("/?", "/ws?");
    let (stalled, _) = connect_async(&address).await?;
    let mut readers = Vec::new();
    for _ in 0..READERS {
        readers.push(tokio::spawn(read(connect_async(&address).await?.0)));
    }
    let settled = SETTLED.min(seconds / 2);
    tokio::time::sleep(Duration::from_secs(settled)).await;
    let early = resident(process)?;
    tokio::time::sleep(Duration::from_secs_f64((seconds - settled) as f64 - 0.5)).await;
    let late = resident(process)?;
    let report = lines
        .next_line()
        .await?
        .ok_or("the service gave no summary")?;
    let report: Value = serde_json::from_str(&report)?;
    drop(stalled);
    let clients = collect(readers).await?;
    Ok(print(&report, frames, &clients, [early, late]))
}

/// Record of a reading client.
#[derive(Default)]
struct Client {
    received: u64,
    missing: u64,
    between: Latencies,
}

/// Reads until the service ends.
async fn read<S>(mut socket: S) -> Client
where
    S: StreamExt<Item = Result<Message, tokio_tungstenite::tungstenite::Error>> + Unpin,
{
    let mut client = Client::default();
    let mut last: Option<(u64, Instant)> = None;
    while let Some(Ok(message)) = socket.next().await {
        let Message::Binary(bytes) = message else {
            continue;
        };
        let Some(sequence) = bytes.get(SEQUENCE).and_then(|bytes| bytes.try_into().ok()) else {
            continue;
        };
        let (sequence, now) = (u64::from_le_bytes(sequence), Instant::now());
        client.received += 1;
        if let Some((before, then)) = last.replace((sequence, now)) {
            client.missing += sequence.saturating_sub(before + 1);
            client.between.push(now.duration_since(then).as_secs_f64());
        }
    }
    client
}

async fn collect(readers: Vec<JoinHandle<Client>>) -> Result<Vec<Client>, Failed> {
    let mut clients = Vec::new();
    for reader in readers {
        clients.push(reader.await?);
    }
    Ok(clients)
}

/// Resident memory of a process, kB.
fn resident(process: u32) -> Result<f64, Failed> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let number = line.and_then(|line| line.split_whitespace().next());
    Ok(number.ok_or("no VmRSS")?.parse()?)
}

fn print(report: &Value, frames: u64, clients: &[Client], memory: [f64; 2]) -> bool {
    let count = |key: &str| report[key].as_u64().unwrap_or(0);
    let duration = report["duration_s"].as_f64().unwrap_or(f64::NAN);
    let rate = (count("accepted").saturating_sub(1)) as f64 / duration;
    println!(
        "source   {} of {frames} frames in {duration:.2} s, {rate:.1} frames/s; lost {}, late {}, duplicate {}",
        count("accepted"),
        count("lost"),
        count("late"),
        count("duplicate"),
    );
    println!(
        "recorder {} messages; lost {}",
        count("recorded"),
        count("recording_lost")
    );
    println!("latency, us                     p50      p90      p99    p99.9  largest");
    let row = |name: &str, values: [f64; 5]| {
        print!("{name:<26}");
        for value in values {
            print!("{value:9.0}");
        }
        println!();
    };
    let of_report =
        |key: &str| [0, 1, 2, 3, 4].map(|i| report[key][i].as_f64().unwrap_or(f64::NAN));
    row("arrival to encoded", of_report("encoded"));
    row("arrival to sent", of_report("sent"));
    for (i, client) in clients.iter().enumerate() {
        row(
            &format!("client {} between frames", i + 1),
            percentiles(&client.between),
        );
    }
    for (i, client) in clients.iter().enumerate() {
        println!(
            "client {} received {}, dropped for it {}",
            i + 1,
            client.received,
            client.missing
        );
    }
    println!(
        "messages sent {} (the stalled client's included)",
        count("messages")
    );
    let [early, late] = memory;
    let growth = late / early - 1.0;
    println!(
        "memory   {:.1} MB, at the end {:.1} MB ({:+.1} %)",
        early / 1e3,
        late / 1e3,
        100.0 * growth
    );
    for name in ["encoded", "sent"] {
        let [median, _, p99, ..] = of_report(name);
        figure(&format!("live.{name}_p50_us"), median);
        figure(&format!("live.{name}_p99_us"), p99);
    }
    let kept_up = (rate / RATE as f64 - 1.0).abs() < 0.01;
    let complete = count("accepted") == frames && count("lost") == 0;
    let recorded = count("recording_lost") == 0;
    for (failed, text) in [
        (!complete, "frames were LOST at the source"),
        (!recorded, "messages were LOST in the recording"),
        (!kept_up, "the estimator did NOT keep up with the source"),
        (growth > MOST_GROWTH, "the memory GREW"),
    ] {
        if failed {
            println!("{text}");
        }
    }
    complete && recorded && kept_up && growth <= MOST_GROWTH
}
