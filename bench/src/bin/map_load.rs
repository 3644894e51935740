//! Time of one frame of a map of 64 x 64 sensels, whatever is on it: contacts, tracks and
//! events on one core. Ends with 1 when frames take more than 5 ms in the mean,
//! which is 200 frames/s.
//!
//!     cargo run --release --bin map_load

use std::process::ExitCode;
use std::time::Instant;

use taxel::acquisition::{Frame, Quantity, SignalUnit, Stream};
use taxel::estimation::{MapNoise, MapOptions, TouchSession};
use taxel_numerics::Noise;

/// Sensels of a side.
const SIDE: usize = 64;
/// Frames of a run, and those at its start that are not counted.
const FRAMES: usize = 600;
const WARMING: usize = 100;
/// Time of a frame at 200 frames/s, s.
const ALLOWED: f64 = 5e-3;

/// What lies on the map.
type Load = fn(&mut Noise, frame: usize, row: usize, column: usize) -> f64;

fn main() -> ExitCode {
    let loads: [(&str, Load); 5] = [
        ("nothing", |_, _, _, _| 0.0),
        ("two hands", |_, frame, row, column| {
            let hand = |at: f64| {
                let [x, y] = [column as f64 - at, row as f64 - 32.0];
                80.0 - 0.6 * (x * x + y * y) + 10.0 * (0.9 * x).sin() * (0.8 * y).cos()
            };
            let moved = 4.0 * (0.05 * frame as f64).sin();
            hand(16.0 + moved).max(hand(48.0 - moved)).max(0.0)
        }),
        ("a body, full", |noise, _, _, _| 60.0 + 5.0 * noise.normal()),
        ("484 points that move", |_, frame, row, column| {
            let on = (row + frame / 3) % 3 == 0 && (column + frame / 5) % 3 == 0;
            if on {
                10.0 + ((frame * 7 + row * 3 + column) % 50) as f64
            } else {
                0.0
            }
        }),
        ("points at random", |noise, _, _, _| {
            let value = noise.normal();
            if value > 1.2 { 30.0 * value } else { 0.0 }
        }),
    ];
    println!(
        "{:22} {:>9} {:>9} {:>9} {:>7}",
        "on the map", "mean ms", "99 % ms", "most ms", "merged"
    );
    let mut late = false;
    for (name, load) in loads {
        let (mut times, merged) = run(load);
        times.sort_unstable_by(f64::total_cmp);
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        let at = |share: f64| times[(share * (times.len() - 1) as f64) as usize];
        let shown = [mean, at(0.99), at(1.0)].map(|time| 1e3 * time);
        println!(
            "{name:22} {:>9.2} {:>9.2} {:>9.2} {merged:>7}",
            shown[0], shown[1], shown[2]
        );
        late |= mean > ALLOWED;
    }
    ExitCode::from(u8::from(late))
}

/// Seconds of each frame, and frames in which contacts were merged.
fn run(load: Load) -> (Vec<f64>, usize) {
    let stream = Stream {
        name: "map".into(),
        rows: SIDE,
        columns: SIDE,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Pressure,
            symbol: "kPa".into(),
            si_per_unit: 1e3,
        },
        pitch: Some([5e-3; 2]),
        period: Some(ALLOWED),
        threshold: None,
        present: vec![true; SIDE * SIDE],
    };
    let mut random = Noise::seeded(1);
    let frame = |at: usize| Frame {
        sequence: at as u64,
        time_ns: at as u64 * 5_000_000,
        values: (0..SIDE * SIDE)
            .map(|sensel| 1e3 * load(&mut random, at, sensel / SIDE, sensel % SIDE))
            .collect(),
        ..Frame::default()
    };
    let frames: Vec<Frame> = (0..FRAMES).map(frame).collect();
    let mut noise = MapNoise::default();
    for frame in &frames {
        noise.push(frame);
    }
    let options = MapOptions {
        noise,
        all_events: true,
        ..MapOptions::default()
    };
    let mut session = TouchSession::map(&stream, &options);
    let (mut times, mut merged) = (Vec::new(), 0);
    for (at, frame) in frames.iter().enumerate() {
        let start = Instant::now();
        let observed = session.push(frame).expect("a frame of the map");
        merged += usize::from(observed.touch.merged > 0);
        if at >= WARMING {
            times.push(start.elapsed().as_secs_f64());
        }
    }
    (times, merged)
}
