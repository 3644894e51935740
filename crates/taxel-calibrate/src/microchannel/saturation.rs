//! From which signal on a channel says no more: the plateau at its largest
//! loads, where there is one.

use super::problem::Reading;
use super::{CHANNEL, MicrochannelCalibrator};
use crate::device_model::Judged;
use crate::outcome::Constants;
use crate::remark::Remark;
use crate::split::series_of;
use taxel::signal::ResistanceSignal;
use taxel_numerics::least_squares::{Estimate, Parameter, Status, student_quantile};

/// Name of the parameter behind that of its channel.
pub(super) fn saturation_name(signal: &ResistanceSignal) -> &'static str {
    match signal {
        ResistanceSignal::Divider { .. } => "saturation_voltage",
        ResistanceSignal::Resistance { .. } => "saturation_resistance",
    }
}

/// Fewer readings at the largest loads are no plateau.
const LEAST: usize = 6;
/// Chances on one side that a reading of a plateau is taken for none: where it is
/// looked for, two in a row end it; of the others a single one that is taken for
/// no plateau spoils the curve, and a few too many do not matter. The scatter
/// of few readings is often too small: hence Student's quantiles.
const IN_A_ROW: f64 = 1e-4;
const ALONE: f64 = 1e-6;
/// The same for its slope.
const FLAT: f64 = 1e-5;
/// The curve before a plateau would have risen along it by this many deviations
/// of a reading.
const RISING: f64 = 8.0;

/// Readings of one channel that no longer change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plateau {
    /// Mean.
    signal: f64,
    /// Scatter of one reading.
    scatter: f64,
    /// Least and largest load, Pa.
    from: f64,
    to: f64,
    count: usize,
}

/// Distance from the mean of `count` readings that another one of theirs exceeds with no
/// more than this chance, in their scatter.
fn apart(chance: f64, count: usize) -> f64 {
    student_quantile(1.0 - chance, (count - 1) as f64) * (1.0 + 1.0 / count as f64).sqrt()
}

impl Plateau {
    /// The plateau of readings of loading of one channel: from the largest load
    /// down until two readings in a row are out, or all so far rise.
    ///
    /// The last quarter of these may be of the curve before, which joins it little
    /// by little where loads are close to one another: the others determine it.
    pub(super) fn find(of: &[Reading]) -> Option<Self> {
        let mut points: Vec<[f64; 2]> = of
            .iter()
            .map(|reading| [reading.load.pressure(0.0), reading.signal])
            .collect();
        points.sort_by(|a, b| b[0].total_cmp(&a[0]));
        let mut count = LEAST;
        points.get(..LEAST)?;
        while let Some(next) = points.get(count) {
            let [mean, scatter] = spread(&points[..count]);
            let out = |point: &[f64; 2]| (point[1] - mean).abs() > apart(IN_A_ROW, count) * scatter;
            let ends = out(next) && points.get(count + 1).is_none_or(out);
            if ends || !is_flat(&points[..count]) {
                break;
            }
            count += 1;
        }
        let rest = &points[count..];
        let top = &points[..(3 * count / 4).max(LEAST)];
        let [signal, scatter] = spread(top);
        let [before, _] = line(&rest[..rest.len().min(count)])?;
        let length = top[0][0] - top[top.len() - 1][0];
        let found = is_flat(top) && before * length > RISING * scatter;
        found.then_some(Self {
            signal,
            scatter,
            from: points[count - 1][0],
            to: points[0][0],
            count: top.len(),
        })
    }

    /// True if the drawn channel, of which `drawn` is the signal under a load in Pa, would rise along
    /// it: behind the first touch a channel closes so little that noise hides it, which is no
    /// plateau. Beyond the closing curve nothing is known.
    pub(super) fn stands_out(&self, drawn: impl Fn(f64) -> Option<f64>) -> bool {
        let ends = drawn(self.from).zip(drawn(self.to));
        ends.is_none_or(|(low, high)| (high - low).abs() > RISING * self.scatter)
    }

    /// True if a reading belongs to it.
    pub(super) fn holds(&self, reading: &Reading) -> bool {
        reading.signal > self.signal - apart(ALONE, self.count) * self.scatter
    }
}

/// Mean and standard deviation of the signals.
fn spread(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len() as f64;
    let mean = points.iter().map(|point| point[1]).sum::<f64>() / count;
    let squares: f64 = points.iter().map(|point| (point[1] - mean).powi(2)).sum();
    [mean, (squares / (count - 1.0)).sqrt()]
}

/// True if the signals do not clearly change along the loads.
fn is_flat(points: &[[f64; 2]]) -> bool {
    line(points).is_some_and(|[slope, deviation]| {
        slope.abs() <= student_quantile(1.0 - FLAT, (points.len() - 2) as f64) * deviation
    })
}

/// Slope of a straight line and its deviation.
fn line(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let freedom = points.len().checked_sub(2).filter(|left| *left > 0)?;
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let square: f64 = points.iter().map(|point| (point[0] - x).powi(2)).sum();
    let product: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    let slope = product / square;
    let misfit = |point: &[f64; 2]| (point[1] - y - slope * (point[0] - x)).powi(2);
    let variance = points.iter().map(misfit).sum::<f64>() / freedom as f64;
    let deviation = (variance / square).sqrt();
    (square > 0.0).then_some([slope, deviation])
}

impl MicrochannelCalibrator<'_> {
    /// The saturation of each channel that was read with its estimate, and what
    /// there is to say of it. A saturation that was not reached lies between the
    /// largest signal that was read and the largest there can be.
    pub(super) fn saturations(
        &self,
        of: &Judged<'_, Self>,
        remarks: &mut Vec<Remark>,
    ) -> Constants {
        let signal = &self.board.signal;
        let (unit, largest) = (signal.unit().1, signal.largest());
        let (mut saturated, mut open) = (Vec::new(), Vec::new());
        let one = |channel: &usize| {
            let name = format!("{CHANNEL}_{channel}");
            let read = of.series.iter().flatten();
            let read = read.filter(|r| r.channel == *channel && !r.saturated);
            let most = read.map(|reading| reading.signal).fold(0.0, f64::max);
            let parameter = Parameter {
                unit,
                bounds: [most, largest],
                ..Parameter::new(
                    format!("{name}.{}", saturation_name(signal)),
                    self.board.saturation,
                )
            };
            let Some(plateau) = of.context[*channel] else {
                open.push(format!("{most:.4} {unit} ({name})"));
                let estimate = Estimate {
                    value: self.board.saturation,
                    deviation: (largest - most) / 12.0_f64.sqrt(),
                    interval: parameter.bounds,
                    status: Status::NotIdentifiable,
                };
                return (parameter, estimate);
            };
            let deviation = plateau.scatter / (plateau.count as f64).sqrt();
            let half = student_quantile(0.975, (plateau.count - 1) as f64) * deviation;
            saturated.push(format!(
                "{:.4} kPa on, {} readings of loading ({name})",
                plateau.from * 1e-3,
                plateau.count
            ));
            let estimate = Estimate {
                value: plateau.signal,
                deviation,
                interval: [plateau.signal - half, plateau.signal + half],
                status: Status::Identified,
            };
            (parameter, estimate)
        };
        let found = series_of(&of.fits[0].readings).iter().map(one).collect();
        remarks.extend(Remark::of_each("saturated from", &saturated));
        let what = "saturation was not reached and is at least";
        remarks.extend(Remark::of_each(what, &open));
        found
    }
}
