//! Text exports of Tekscan: a fingertip on an I-Scan map, a foot on an F-Scan insole.

use std::fmt::Write as _;

use super::{Contact, Random, ramp, walk};

/// Pitch of the fingertip's map, m.
pub(crate) const FINGER_PITCH: f64 = 1.27e-3;
/// Force on a sensel that reads one count more, N: 500 Pa.
pub(crate) const FINGER_FORCE_PER_COUNT: f64 = 500.0 * FINGER_PITCH * FINGER_PITCH;
/// Frames of the fingertip.
pub(crate) const FINGER_FRAMES: usize = 60;
/// Readings below this are suppressed, counts.
pub(crate) const NOISE_THRESHOLD: f64 = 3.0;
/// The readings are whole counts: those that carry less than 2.5 are suppressed.
pub(crate) const LEAST_COUNTS: f64 = NOISE_THRESHOLD - 0.5;
/// Noise of a loaded sensel, counts.
pub(crate) const FINGER_NOISE: f64 = 0.7;
/// Sensels that always read [`STUCK_READING`] or up to two counts more.
pub(crate) const STUCK: [[usize; 2]; 3] = [[2, 2], [3, 12], [16, 3]];
/// Least reading of a stuck sensel, counts.
pub(crate) const STUCK_READING: f64 = 5.0;
/// A sensel that reads nothing any more: a hole in the second touch.
pub(crate) const WORN: [usize; 2] = [20, 7];
/// Reduced modulus of the pulp, Pa, and radius of the fingertip, m.
const PULP: [f64; 2] = [150e3, 8e-3];
/// Force of a touch, N.
const PRESS: f64 = 3.0;

/// Time of a frame, s, as its line has it: the clock is 1 % slower than the stated period of 0.1 s.
pub(crate) fn finger_time(frame: usize) -> f64 {
    (0.101 * frame as f64 * 100.0).round() / 100.0
}

/// The fingertip at a time, s: it lands, slides by three sensels, leaves, lands on the next field and stays.
pub(crate) fn finger(time: f64) -> Contact {
    let first = ramp(time, 0.3, 0.9) * (1.0 - ramp(time, 3.4, 4.0));
    let second = ramp(time, 4.4, 5.0);
    let slide = ramp(time, 1.2, 3.2);
    let cells = if time < 4.2 {
        [20.2 + 1.0 * slide, 19.0 + 3.0 * slide]
    } else {
        [20.6, 7.4]
    };
    let force = PRESS * (first + second);
    Contact {
        centre: cells.map(|cell| cell * FINGER_PITCH),
        // Hertz: a^3 = 3 F R/(4 E*).
        radius: (0.75 * force * PULP[1] / PULP[0]).cbrt(),
        force,
    }
}

/// True where a map has a sensel: four fields of 11 x 11.
pub(crate) fn finger_has(row: usize, column: usize) -> bool {
    [row, column]
        .iter()
        .all(|at| (2..13).contains(at) || (15..26).contains(at))
}

/// 28 x 28 sensels, raw counts.
pub(crate) fn fingertip() -> String {
    let mut text = String::from(
        "DATA_TYPE MOVIE\nVERSION sample in the format of I-Scan 6.10I\nHARDWARE none\nMAP_VERSION 6.4\n\
         HW_TYPE 3\nVersaPogoFsx 0\nFILENAME C:\\Documents and Settings\\a user\\Desktop\\fingertip.fsx\n\
         SENSOR_TYPE fingertip\nROWS 28\nCOLS 28\nROW_SPACING 0.127 centimeters\n\
         COL_SPACING 0.127 centimeters\nSENSEL_AREA 0.016129 cm2\nNOISE_THRESHOLD 3\nSECONDS_PER_FRAME 0.1\n\
         MICRO_SECOND 0\nTIME 3/14/2026 9:26:53.10AM\nSENSITIVITY S-21\nMAP_INDEX 0\nSUBMAP 0\nSTART_FRAME 1\n\
         END_FRAME 60\nUNITS raw\nMIRROR_ROW 0\nMIRROR_COL 0\nASCII_DATA @@\n",
    );
    let mut random = Random(3);
    for frame in 0..FINGER_FRAMES {
        let time = finger_time(frame);
        let contact = finger(time);
        let mut reading = |row: usize, column: usize| {
            let counts = contact.on_sensel(row, column, FINGER_PITCH) * FINGER_PITCH * FINGER_PITCH;
            let counts = (counts / FINGER_FORCE_PER_COUNT).round();
            match [row, column] {
                at if STUCK.contains(&at) => STUCK_READING + (3.0 * random.uniform()).floor(),
                WORN => 0.0,
                _ if counts < NOISE_THRESHOLD => 0.0,
                _ => (counts + FINGER_NOISE * random.normal())
                    .round()
                    .max(NOISE_THRESHOLD),
            }
        };
        let cells = (0..28 * 28).map(|at| (at / 28, at % 28));
        let readings: Vec<Option<f64>> = cells
            .map(|(row, column)| finger_has(row, column).then(|| reading(row, column)))
            .collect();
        let sum: f64 = readings.iter().flatten().sum();
        let (number, seconds) = (frame + 1, 53.1 + time);
        let _ = writeln!(
            text,
            "\nFrame {number}, {time},, 3/14/2026 9:26:{seconds:.2}AM,,,Raw Sum=,,{sum}"
        );
        rows(&mut text, &readings, 28);
    }
    text + "@@\n"
}

/// Rows of a frame; `B` is where there is no sensel.
fn rows(text: &mut String, readings: &[Option<f64>], columns: usize) {
    for row in readings.chunks(columns) {
        let cells = row
            .iter()
            .map(|cell| cell.map_or("B".to_owned(), |value| value.to_string()));
        text.push_str(&cells.collect::<Vec<_>>().join(","));
        text.push('\n');
    }
}

/// Pitch of the insole, m.
pub(crate) const FOOT_PITCH: f64 = 5.08e-3;
/// Rows and columns of the insole.
pub(crate) const FOOT_SHAPE: [usize; 2] = [60, 21];
/// Frames of the foot, which are one stance.
pub(crate) const FOOT_FRAMES: usize = 20;
/// Pressure of the highest of 255 counts, Pa.
pub(crate) const SATURATION: f64 = 1514.73e3;

/// Share of the stance that a frame shows.
pub(crate) fn stance(frame: usize) -> f64 {
    (frame as f64 + 0.5) / FOOT_FRAMES as f64
}

/// What touches the insole in a frame.
pub(crate) fn foot_contacts(frame: usize) -> Vec<Contact> {
    walk::contacts(
        stance(frame),
        FOOT_SHAPE.map(|cells| cells as f64 * FOOT_PITCH),
    )
}

/// True where the insole has a sensel: a sole with round ends.
pub(crate) fn foot_has(row: usize, column: usize) -> bool {
    let along = (row as f64 + 0.5) / FOOT_SHAPE[0] as f64;
    let round = |share: f64| (1.0 - share * share).max(0.0).sqrt();
    let half_width = match along {
        toes if toes < 0.25 => 10.5 * round(1.0 - toes / 0.25),
        heel if heel > 0.85 => 8.0 * round((heel - 0.85) / 0.15),
        _ => 10.5 - 2.5 * (along - 0.25) / 0.6,
    };
    (column as f64 + 0.5 - 10.5).abs() < half_width
}

/// 60 x 21 sensels, kPa.
pub(crate) fn foot() -> String {
    let mut text = String::from(
        "DATA_TYPE MOVIE\nVERSION sample in the format of F-Scan 6.33\nHARDWARE none\nMAP_VERSION 6.5\nHW_TYPE 4\n\
         FILENAME C:\\MOVIES\\FOOT.fsx\nSENSOR_TYPE FSCAN\nROWS 60\nCOLS 21\nROW_SPACING 5.08 mm\n\
         COL_SPACING 5.08 mm\nSENSEL_AREA 25.8064 mm2\nNOISE_THRESHOLD 3\nSECONDS_PER_FRAME 0.032\n\
         MICRO_SECOND 0\nTIME Saturday, 14 March 2026 9:26:53 a.m.\nSATURATION_PRESSURE 1514.73 KPa \n\
         CALIBRATION_POINT_1 71.3801 (Kgs) 4570 (Raw Sum) 230 (Number of Loaded Cells)\n\
         CALIBRATION_MODE_1 Walk\nCALIBRATION_INFO C:\\MOVIES\\FOOT.fsx\nSENSITIVITY Custom\nCOMMENTS:\n\
         a step over ground\nSTART_FRAME 1\nEND_FRAME 20\nUNITS KPa\nMIRROR_ROW 0\nMIRROR_COL 0\nASCII_DATA @@\n",
    );
    let [length, width] = FOOT_SHAPE;
    for frame in 0..FOOT_FRAMES {
        let contacts = foot_contacts(frame);
        let reading = |row: usize, column: usize| {
            let on_sensel = contacts
                .iter()
                .map(|one| one.on_sensel(row, column, FOOT_PITCH));
            let counts = (on_sensel.sum::<f64>() / (SATURATION / 255.0))
                .round()
                .min(255.0);
            let counts = if counts < NOISE_THRESHOLD {
                0.0
            } else {
                counts
            };
            (counts * SATURATION / 255.0 / 1e3).round()
        };
        let cells = (0..length * width).map(|at| (at / width, at % width));
        let readings: Vec<Option<f64>> = cells
            .map(|(row, column)| foot_has(row, column).then(|| reading(row, column)))
            .collect();
        let _ = writeln!(text, "\nFrame {}", frame + 1);
        rows(&mut text, &readings, width);
    }
    text + "@@\n"
}
