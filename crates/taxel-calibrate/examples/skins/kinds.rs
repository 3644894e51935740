//! Synthetic skins of many kinds, each from parts: where the channels are, how each answers, what the body
//! remembers, and what is wrong with the electronics. None is drawn after a recording.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How a channel answers to the load on it.
#[derive(Clone, Copy, PartialEq)]
enum Answer {
    /// In proportion.
    Linear,
    /// It stiffens: z = p/(1 + p/p₀).
    Saturates(f64),
    /// The gap of a capacitor closes: z = 1/(g − p) − 1/g.
    Gap(f64),
    /// It grows faster than the load: z = p (1 + p/p₀).
    Stiffens(f64),
    /// Changes alone are seen, for a time, s.
    Changes(f64),
}

/// A kind of skin.
#[derive(Clone, Copy)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    rows: usize,
    columns: usize,
    /// Distance of the channels, mm.
    pitch: f64,
    /// How far a press reaches, over the distance of the channels.
    reach: f64,
    answer: Answer,
    /// Share and time (s) of what follows late.
    settling: [f64; 2],
    /// Share of what plays, and width of the play over the largest load.
    play: [f64; 2],
    /// Share of the neighbours in the rows and columns that is seen, too.
    crosstalk: f64,
    /// Counts at the largest load, noise and drift over a run, counts.
    counts: [f64; 3],
    /// From run to run: deviation of the gain, and of what all channels have in common, counts.
    runs: [f64; 2],
    presses: usize,
    rate: f64,
    /// Numbers of dead, of stuck and of noisy channels.
    faults: [usize; 3],
    shear: bool,
}

const PLAIN: Kind = Kind {
    name: "linear",
    rows: 8,
    columns: 8,
    pitch: 10.0,
    reach: 0.8,
    answer: Answer::Linear,
    settling: [0.0, 1.0],
    play: [0.0, 0.0],
    crosstalk: 0.0,
    counts: [1000.0, 1.2, 0.0],
    runs: [0.0, 0.0],
    presses: 60,
    rate: 20.0,
    faults: [0; 3],
    shear: false,
};

/// 1024 channels and 20 000 rows in three runs: what bounds time and memory.
pub(crate) const HUGE: Kind = Kind {
    name: "huge",
    rows: 32,
    columns: 32,
    pitch: 2.5,
    reach: 1.2,
    answer: Answer::Saturates(0.5),
    settling: [0.2, 4.0],
    presses: 78,
    ..PLAIN
};

/// All kinds but the huge one.
pub(crate) const KINDS: [Kind; 11] = [
    PLAIN,
    Kind {
        name: "few",
        rows: 4,
        columns: 3,
        pitch: 15.0,
        reach: 1.0,
        ..PLAIN
    },
    Kind {
        name: "resistive",
        rows: 6,
        columns: 6,
        answer: Answer::Saturates(0.4),
        settling: [0.3, 5.0],
        play: [0.3, 0.05],
        crosstalk: 0.05,
        counts: [2500.0, 2.0, 10.0],
        ..PLAIN
    },
    Kind {
        name: "capacitive",
        rows: 4,
        columns: 4,
        reach: 1.1,
        answer: Answer::Gap(1.4),
        settling: [0.1, 2.0],
        counts: [6000.0, 2.0, 20.0],
        runs: [0.004, 0.0],
        rate: 25.0,
        ..PLAIN
    },
    Kind {
        name: "chips",
        rows: 3,
        columns: 3,
        reach: 1.2,
        answer: Answer::Stiffens(2.0),
        settling: [0.15, 10.0],
        counts: [8000.0, 4.0, 60.0],
        runs: [0.0, 300.0],
        rate: 25.0,
        ..PLAIN
    },
    Kind {
        name: "faulty",
        rows: 5,
        columns: 5,
        reach: 0.9,
        answer: Answer::Saturates(2.0),
        settling: [0.15, 2.0],
        faults: [2, 1, 2],
        ..PLAIN
    },
    Kind {
        name: "coarse",
        rows: 4,
        columns: 4,
        answer: Answer::Saturates(1.0),
        settling: [0.1, 4.0],
        counts: [200.0, 0.5, 0.0],
        presses: 20,
        ..PLAIN
    },
    Kind {
        name: "strip",
        rows: 1,
        columns: 1,
        pitch: 40.0,
        reach: 3.0,
        answer: Answer::Saturates(1.5),
        settling: [0.2, 3.0],
        play: [0.2, 0.05],
        ..PLAIN
    },
    Kind {
        name: "shear",
        rows: 4,
        columns: 4,
        pitch: 6.0,
        reach: 1.5,
        answer: Answer::Gap(2.0),
        settling: [0.1, 1.5],
        counts: [5000.0, 1.0, 5.0],
        runs: [0.004, 0.0],
        rate: 25.0,
        shear: true,
        ..PLAIN
    },
    Kind {
        name: "many",
        rows: 16,
        columns: 16,
        pitch: 5.0,
        reach: 0.9,
        answer: Answer::Saturates(0.5),
        settling: [0.2, 4.0],
        crosstalk: 0.03,
        ..PLAIN
    },
    Kind {
        name: "changes",
        rows: 3,
        columns: 3,
        reach: 0.7,
        answer: Answer::Changes(0.05),
        presses: 25,
        rate: 50.0,
        ..PLAIN
    },
];

/// Largest force, N, and of shear over the pressing force.
const PEAK: f64 = 20.0;
const SHEAR: f64 = 0.5;

/// How a run differs from those of training.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Further {
    /// Not at all.
    Alike,
    /// The probe is half as wide again.
    Probe,
    /// Presses come and go three times as fast.
    Speed,
}

/// A skin: what its specimen has of its own.
pub(crate) struct Skin {
    pub(crate) kind: Kind,
    seed: u64,
    gains: Vec<f64>,
}

struct Step {
    place: [f64; 2],
    force: f64,
    shear: [f64; 2],
    touches: bool,
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

impl Skin {
    pub(crate) fn new(kind: Kind, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = kind.rows * kind.columns;
        let gains = (0..count).map(|_| (0.2 * normal(&mut random)).exp());
        Self {
            kind,
            seed,
            gains: gains.collect(),
        }
    }

    /// The sensor file.
    pub(crate) fn sensor(&self) -> String {
        let Kind {
            name,
            rows,
            columns,
            pitch,
            rate,
            ..
        } = self.kind;
        let names: Vec<String> = (1..=rows * columns).map(|n| format!("\"{n}\"")).collect();
        format!(
            "schema = 2\nname = \"{name}\"\n[array]\nrows = {rows}\ncolumns = {columns}\npitch = \"{pitch} mm\"\nmount = \"flat\"\n\
             [element.trained]\nfull_scale = \"{} N\"\ngroups = [{{ name = \"skin\", channels = [{}] }}]\n[electronics]\n\
             frame_rate = \"{rate} Hz\"\nscan = \"simultaneous\"\nreadout = {{ digital = {{ unit = \"counts\" }} }}\n",
            1.25 * PEAK,
            names.join(", ")
        )
    }

    /// A run as a table: time, channels, the scale, and the position while something touches.
    pub(crate) fn run(&self, number: u64, further: Further) -> String {
        let kind = self.kind;
        let mut random = ChaCha8Rng::seed_from_u64(1000 * self.seed + 10 * number + further as u64);
        let course = self.course(&mut random, further);
        let readings = self.readings(&mut random, &course, further);
        let channels: Vec<String> = (1..=self.gains.len())
            .map(|n| format!("channel_{n}"))
            .collect();
        let shear = if kind.shear {
            "force_x [N],force_y [N],"
        } else {
            ""
        };
        let mut text = format!(
            "time [s],{},{shear}force_z [N],x [mm],y [mm]\n",
            channels.join(",")
        );
        let mut scale = |force: f64| format!("{:.3}", force + 0.02 * normal(&mut random));
        for (at, (step, row)) in course.iter().zip(&readings).enumerate() {
            let mut cells = vec![format!("{:.4}", at as f64 / kind.rate)];
            cells.extend(row.iter().map(|value| format!("{value:.0}")));
            if kind.shear {
                cells.extend(step.shear.map(&mut scale));
            }
            cells.push(scale(step.force));
            let placed = step.touches && self.gains.len() > 1;
            let place = step.place.map(|x| format!("{x:.3}"));
            cells.extend(if placed { place } else { Default::default() });
            text += &cells.join(",");
            text.push('\n');
        }
        text
    }

    /// Presses of random places, sizes and durations with pauses.
    fn course(&self, random: &mut ChaCha8Rng, further: Further) -> Vec<Step> {
        let kind = self.kind;
        let dt = 1.0 / kind.rate;
        let half = [kind.columns, kind.rows].map(|count| 0.45 * count as f64 * kind.pitch);
        let faster = if further == Further::Speed { 3.0 } else { 1.0 };
        let mut course = Vec::new();
        let rest = || Step {
            place: [0.0; 2],
            force: 0.0,
            shear: [0.0; 2],
            touches: false,
        };
        let pause = |course: &mut Vec<Step>, seconds: f64| {
            course.extend((0..(seconds / dt) as usize).map(|_| rest()));
        };
        pause(&mut course, 4.0);
        for _ in 0..kind.presses {
            let place = half.map(|half| random.random_range(-half..half));
            let peak = random.random_range(0.05 * PEAK..PEAK);
            let angle = random.random_range(0.0..std::f64::consts::TAU);
            let shear = if kind.shear {
                random.random_range(0.0..SHEAR)
            } else {
                0.0
            };
            let [up, hold, down] =
                [(0.3, 1.5), (0.2, 3.0), (0.3, 1.5)].map(|(a, b)| random.random_range(a..b));
            let [up, down] = [up, down].map(|time| time / faster);
            let end = up + hold + down;
            let mut time = 0.0_f64;
            while time < end {
                let share = (time / up).min((end - time) / down).clamp(0.0, 1.0);
                let force = peak * share * share * (3.0 - 2.0 * share);
                course.push(Step {
                    place,
                    force,
                    shear: [angle.cos(), angle.sin()].map(|part| shear * force * part),
                    touches: true,
                });
                time += dt;
            }
            pause(&mut course, random.random_range(0.4..2.0));
        }
        course
    }

    fn readings(
        &self,
        random: &mut ChaCha8Rng,
        course: &[Step],
        further: Further,
    ) -> Vec<Vec<f64>> {
        let kind = self.kind;
        let dt = 1.0 / kind.rate;
        let count = self.gains.len();
        let centre = |channel: usize| {
            let at =
                |number: usize, of: usize| (number as f64 - 0.5 * (of - 1) as f64) * kind.pitch;
            [
                at(channel % kind.columns, kind.columns),
                at(channel / kind.columns, kind.rows),
            ]
        };
        let wider = if further == Further::Probe {
            1.5_f64.sqrt()
        } else {
            1.0
        };
        let reach = kind.reach * kind.pitch * wider;
        let gain = 1.0 + kind.runs[0] * normal(random);
        let common = kind.runs[1] * normal(random);
        let drifts: Vec<f64> = (0..count)
            .map(|_| kind.counts[2] * normal(random))
            .collect();
        let full = self.answer(1.0);
        let share = 1.0 - (-dt / kind.settling[1]).exp();
        let change = |time: f64| 1.0 - (-dt / time).exp();
        let (mut late, mut played, mut before) =
            (vec![0.0; count], vec![0.0_f64; count], vec![0.0; count]);
        let mut rows = Vec::with_capacity(course.len());
        for (number, step) in course.iter().enumerate() {
            let mut loads: Vec<f64> = (0..count)
                .map(|channel| {
                    let [x, y] = centre(channel);
                    let square = (step.place[0] - x).powi(2) + (step.place[1] - y).powi(2);
                    // A channel under shear leans to one side of its cell or the other.
                    let side = [channel % kind.columns % 2, channel / kind.columns % 2]
                        .map(|odd| 1.0 - 2.0 * odd as f64);
                    let leans = step.shear[0] * side[0] + step.shear[1] * side[1];
                    let wide = kind.reach * kind.pitch / reach;
                    (step.force + leans) / PEAK
                        * wide
                        * wide
                        * (-square / (2.0 * reach * reach)).exp()
                })
                .collect();
            for ((load, late), played) in loads.iter_mut().zip(&mut late).zip(&mut played) {
                *late += share * (*load - *late);
                *played = played.clamp(*load - kind.play[1], *load + kind.play[1]);
                let settled = (1.0 - kind.settling[0]) * *load + kind.settling[0] * *late;
                *load = (1.0 - kind.play[0]) * settled + kind.play[0] * *played;
            }
            let mut answers: Vec<f64> = match kind.answer {
                Answer::Changes(time) => {
                    let seen = loads.iter().zip(&mut before).map(|(load, before)| {
                        *before += change(time) * (load - *before);
                        load - *before
                    });
                    seen.collect()
                }
                _ => loads.iter().map(|load| self.answer(*load)).collect(),
            };
            if kind.crosstalk > 0.0 {
                let of_row = |row: usize| {
                    (0..kind.columns)
                        .map(|c| answers[row * kind.columns + c])
                        .sum::<f64>()
                };
                let of_column = |column: usize| {
                    (0..kind.rows)
                        .map(|r| answers[r * kind.columns + column])
                        .sum::<f64>()
                };
                let mixed = (0..count).map(|at| {
                    let beside = of_row(at / kind.columns) + of_column(at % kind.columns)
                        - 2.0 * answers[at];
                    answers[at] + kind.crosstalk * beside / (kind.rows + kind.columns) as f64
                });
                answers = mixed.collect();
            }
            let along = number as f64 / course.len() as f64;
            let [dead, stuck, noisy] = kind.faults;
            let row = answers.iter().enumerate().map(|(at, answer)| {
                let noise = kind.counts[1] * normal(random);
                let own = kind.counts[0] * gain * self.gains[at] * answer / full;
                1000.0
                    + common
                    + drifts[at] * along
                    + match at {
                        at if at < dead => noise,
                        at if at < dead + stuck => 0.0,
                        at if at < dead + stuck + noisy => own + 100.0 * noise,
                        _ => own + noise,
                    }
            });
            rows.push(row.map(f64::round).collect());
        }
        rows
    }

    fn answer(&self, load: f64) -> f64 {
        match self.kind.answer {
            Answer::Linear | Answer::Changes(_) => load,
            Answer::Saturates(half) => load / (1.0 + load.max(0.0) / half),
            Answer::Gap(gap) => 1.0 / (gap - load.min(0.9 * gap)) - 1.0 / gap,
            Answer::Stiffens(half) => load * (1.0 + load / half),
        }
    }
}
