//! A CSV export of XSENSOR: a left and a right insole while both feet are on the ground.

use std::fmt::Write as _;

use super::{Contact, walk};

/// Rows and columns of an insole.
pub(crate) const SHAPE: [usize; 2] = [31, 11];
/// Pitch, m.
pub(crate) const PITCH: f64 = 8.6e-3;
/// Pascals of the conventional millimetre of mercury.
pub(crate) const MMHG: f64 = 133.322387415;
/// Readings below this are suppressed, mmHg.
pub(crate) const THRESHOLD: f64 = 51.72;
/// Names of the two sensors.
pub(crate) const NAMES: [&str; 2] = ["SAMPLE.11.31-LF S0001", "SAMPLE.11.31-RF S0001"];
/// Number of the first of three frames, and the times of day of all, the second after the hour.
pub(crate) const FIRST_FRAME: usize = 1464;
const TIMES: [&str; 3] = ["09:59:59.990", "10:00:00.003", "10:00:00.016"];
/// Regions of an insole and their first rows.
const REGIONS: [(&str, usize); 4] = [("Heel", 22), ("Midfoot", 13), ("Metatarsal", 6), ("Toe", 0)];
/// Fields of a line.
const FIELDS: usize = 20;

/// What touches an insole (0: left) in a frame (0 to 2): the left foot rolls off while the right one lands.
pub(crate) fn contacts(side: usize, frame: usize) -> Vec<Contact> {
    let stance = [0.88, 0.12][side] + 0.02 * frame as f64;
    walk::contacts(stance, SHAPE.map(|cells| cells as f64 * PITCH))
}

/// Readings of an insole, mmHg with two digits.
fn readings(side: usize, frame: usize) -> Vec<f64> {
    let contacts = contacts(side, frame);
    let reading = |at: usize| {
        let [row, column] = [at / SHAPE[1], at % SHAPE[1]];
        let pressure: f64 = contacts
            .iter()
            .map(|one| one.on_sensel(row, column, PITCH))
            .sum();
        let shown = (pressure / MMHG * 100.0).round() / 100.0;
        if shown < THRESHOLD { 0.0 } else { shown }
    };
    (0..SHAPE[0] * SHAPE[1]).map(reading).collect()
}

/// Lines that are padded with commas, each followed by one of commas only.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn put(&mut self, fields: usize, line: &str) {
        let _ = writeln!(self.0, "{line}{}", ",".repeat(FIELDS - fields));
        self.blank();
    }

    fn blank(&mut self) {
        self.0.push_str(&",".repeat(FIELDS - 1));
        self.0.push('\n');
    }

    fn entry(&mut self, key: &str, value: &str) {
        self.put(2, &format!("{key},{value}"));
    }

    /// Statistics over the cells above zero.
    fn statistics(&mut self, cells: &[f64]) {
        let loaded: Vec<f64> = cells.iter().copied().filter(|&value| value > 0.0).collect();
        let count = loaded.len().max(1) as f64;
        let mean = loaded.iter().sum::<f64>() / count;
        let square = loaded
            .iter()
            .map(|value| (value - mean).powi(2))
            .sum::<f64>()
            / count;
        let area = PITCH * PITCH * 1e4;
        let share = loaded.len() as f64 / cells.len() as f64;
        let smallest = loaded.iter().copied().reduce(f64::min).unwrap_or(0.0);
        for (key, value) in [
            ("Average Pressure (mmHg)", mean),
            ("Minimum Pressure (mmHg)", smallest),
            (
                "Peak Pressure (mmHg)",
                loaded.iter().copied().fold(0.0, f64::max),
            ),
            ("Contact Area (cm²)", area * loaded.len() as f64),
            ("Total Area (cm²)", area * cells.len() as f64),
            ("Contact %", 100.0 * share),
            ("Est. Load (N)", mean * MMHG * count * PITCH * PITCH),
            ("Std Dev.", square.sqrt()),
        ] {
            self.entry(key, &((value * 100.0).round() / 100.0).to_string());
        }
    }

    fn sensels(&mut self, cells: &[f64], to_a_line: usize) {
        self.blank();
        self.put(1, "SENSELS");
        for line in cells.chunks(to_a_line) {
            let line: Vec<String> = line.iter().map(f64::to_string).collect();
            self.put(line.len(), &line.join(","));
        }
        self.blank();
    }
}

/// 31 x 11 sensels each, mmHg, with the lists of four regions of each.
pub(crate) fn insoles() -> String {
    let mut lines = Lines("\u{feff}".to_owned());
    lines.entry(
        "File:",
        "\"C:\\Users\\a user\\XSENSOR\\Foot\\step-03,14,2026.XSN\"",
    );
    lines.entry("Units:", "mmHg");
    lines.entry("Threshold:", &THRESHOLD.to_string());
    for (frame, time) in TIMES.iter().enumerate() {
        let both = [0, 1].map(|side| readings(side, frame));
        lines.blank();
        lines.entry("FRAME", &(FIRST_FRAME + frame).to_string());
        lines.entry("Date", " 2026 Mar 14");
        lines.entry("Time", &format!(" {time}"));
        for (name, cells) in NAMES.iter().zip(&both) {
            lines.blank();
            lines.entry("SENSOR", name);
            lines.entry("Rows", &SHAPE[0].to_string());
            lines.entry("Columns", &SHAPE[1].to_string());
            lines.entry("Sensel Width (cm)", "0.86");
            lines.entry("Sensel Height (cm)", "0.86");
            lines.statistics(cells);
            lines.entry("Stride Time", "1092");
            lines.sensels(cells, SHAPE[1]);
        }
        let mut end = SHAPE[0];
        let mut group = 0;
        for (region, start) in REGIONS {
            for (side, cells) in ["Left", "Right"].iter().zip(&both) {
                group += 1;
                let cells = &cells[start * SHAPE[1]..end * SHAPE[1]];
                lines.entry("GROUP", &group.to_string());
                lines.entry("Name", &format!("{side} {region}"));
                lines.entry("Cells", &cells.len().to_string());
                lines.statistics(cells);
                lines.sensels(cells, FIELDS);
            }
            end = start;
        }
    }
    lines.0
}
