//! A run as numbers, and what live makes of it.

use std::error::Error;

use taxel::estimation::ArrayEstimator;
use taxel_recording::Frame;

use crate::baseline::Inputs;

type Failed = Box<dyn Error>;

/// Share of the largest force above which a position is judged.
const TOUCHES: f64 = 0.05;
/// Frames of the rest capture.
pub(crate) const REST: usize = 50;

/// A run as numbers.
pub(crate) struct Table {
    pub(crate) inputs: Inputs,
    pub(crate) frames: Vec<Vec<f64>>,
    /// Force, its components, position; NaN where there is none.
    pub(crate) targets: Vec<(&'static str, Vec<f64>)>,
    /// First frame that is judged.
    first: usize,
    pub(crate) top: f64,
}

/// Targets and their columns.
pub(crate) const TARGETS: [(&str, &str); 5] = [
    ("force", "force_z [N]"),
    ("fx", "force_x [N]"),
    ("fy", "force_y [N]"),
    ("x", "x [mm]"),
    ("y", "y [mm]"),
];

impl Table {
    pub(crate) fn of(text: &str) -> Result<Self, Failed> {
        let mut lines = text.lines();
        let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| {
                line.split(',')
                    .map(|cell| cell.parse().unwrap_or(f64::NAN))
                    .collect()
            })
            .collect();
        let column = |title: &str| head.iter().position(|other| *other == title);
        let channels: Vec<usize> = (0..head.len())
            .filter(|at| head[*at].starts_with("channel_"))
            .collect();
        let targets = TARGETS.into_iter().filter_map(|(name, title)| {
            let at = column(title)?;
            Some((name, rows.iter().map(|row| row[at]).collect()))
        });
        let mut targets: Vec<(&'static str, Vec<f64>)> = targets.collect();
        let force = targets.first().ok_or("no force")?.1.clone();
        let top = force.iter().copied().fold(0.0, f64::max);
        let touch = force
            .iter()
            .position(|force| *force > TOUCHES * top)
            .unwrap_or(0);
        for (_, own) in targets
            .iter_mut()
            .filter(|(name, _)| ["x", "y"].contains(name))
        {
            for (own, force) in own.iter_mut().zip(&force) {
                *own = if *force > TOUCHES * top {
                    *own
                } else {
                    f64::NAN
                };
            }
        }
        let frames: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| channels.iter().map(|at| row[*at]).collect())
            .collect();
        let quiet = &frames[..(touch * 7 / 10).clamp(5, 25).min(frames.len())];
        let rest: Vec<f64> = (0..channels.len())
            .map(|at| quiet.iter().map(|row| row[at]).sum::<f64>() / quiet.len() as f64)
            .collect();
        let less = |row: &Vec<f64>| row.iter().zip(&rest).map(|(x, rest)| x - rest).collect();
        Ok(Self {
            inputs: Inputs {
                times: rows.iter().map(|row| row[0]).collect(),
                rows: frames.iter().map(less).collect(),
            },
            frames,
            targets,
            first: REST.min(touch * 8 / 10),
            top,
        })
    }

    pub(crate) fn target(&self, name: &str) -> Option<&Vec<f64>> {
        self.targets
            .iter()
            .find(|(other, _)| *other == name)
            .map(|(_, own)| own)
    }

    /// What is known of a target from the first frame that is judged on, with what is said of it.
    fn judged<'a, T>(
        &'a self,
        name: &str,
        said: &'a [T],
    ) -> impl Iterator<Item = (&'a f64, &'a T)> {
        let known = self.target(name).into_iter().flatten().zip(said);
        known
            .skip(self.first)
            .filter(|(known, _)| known.is_finite())
    }

    /// Root mean square error of estimates of a target.
    pub(crate) fn error(&self, name: &str, estimates: &[f64]) -> f64 {
        let known = self.judged(name, estimates);
        let known = known.filter(|(_, own)| own.is_finite());
        let (sum, count) = known.fold((0.0, 0.0), |(s, n), (known, own)| {
            (s + (known - own) * (known - own), n + 1.0)
        });
        (sum / f64::max(count, 1.0)).sqrt()
    }

    /// Share of the known values of a target, in percent, that are within the intervals of estimates that are known.
    pub(crate) fn held(&self, name: &str, estimates: &[[f64; 2]]) -> f64 {
        let known = self.judged(name, estimates);
        let known = known.filter(|(_, said)| said.iter().all(|value| value.is_finite()));
        let (held, count) = known.fold((0.0, 0.0), |(held, n), (known, [own, deviation])| {
            (
                held + f64::from(u8::from((known - own).abs() < 1.96 * deviation)),
                n + 1.0,
            )
        });
        100.0 * held / f64::max(count, 1.0)
    }
}

/// Values with their deviations.
pub(crate) type Estimates = Vec<[f64; 2]>;

/// Values and deviations of each target, and the number of frames in which a channel is called wrong.
pub(crate) fn live(
    estimator: &mut ArrayEstimator,
    table: &Table,
) -> Result<(Vec<Estimates>, usize), Failed> {
    let mut found = vec![Vec::new(); TARGETS.len()];
    let mut wrong = 0;
    let rows = (0..).zip(&table.inputs.times).zip(&table.frames);
    for ((sequence, time), values) in rows {
        let frame = Frame {
            sequence,
            time_ns: (time * 1e9).round() as u64,
            values: values.clone(),
            ..Frame::default()
        };
        let (touch, _) = estimator.push(&frame)?;
        wrong += usize::from(touch.channels.states.iter().any(|state| !state.usable()));
        let unknown = [f64::NAN; 2];
        let total = |axis: usize| {
            let variance = touch.total_covariance[axis][axis];
            let known = [touch.total.force[axis], variance.sqrt()];
            if touch.zero_known { known } else { unknown }
        };
        let contact = touch.contacts.first().filter(|_| touch.zero_known);
        let place = contact.map_or([unknown; 2], |contact| {
            let [xx, _, yy] = contact.covariance;
            [
                [1e3 * contact.centre[0], 1e3 * xx.sqrt()],
                [1e3 * contact.centre[1], 1e3 * yy.sqrt()],
            ]
        });
        let force = touch.pressing_force().filter(|_| touch.zero_known);
        let own = [
            force.unwrap_or(unknown),
            total(0),
            total(1),
            place[0],
            place[1],
        ];
        for (all, own) in found.iter_mut().zip(own) {
            all.push(own);
        }
    }
    Ok((found, wrong))
}
