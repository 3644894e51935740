//! One array: force on each taxel to the readings of its board.

use super::MeasuredForceArray;
use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::electronics::LastStage;
use crate::layout::Layout;
use crate::mechanics::ForceAxes;
use taxel_numerics::Noise;

/// One array; nothing of it is scattered.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    layout: Layout,
    axes: ForceAxes,
    last: LastStage,
    deviation: [f64; 3],
    period: f64,
    delays: Vec<f64>,
}

impl Piece {
    pub(super) fn new(array: &MeasuredForceArray<'_>) -> Self {
        let layout = array.layout();
        Self {
            axes: array.element.axes,
            last: array.last(),
            deviation: array.board.deviations(),
            period: array.sensor.electronics.period(),
            delays: (0..layout.taxels())
                .map(|taxel| array.delay(taxel))
                .collect(),
            layout,
        }
    }
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        let channels = self.axes.count();
        crate::device::stream_of(&self.layout, channels, self.period, self.last.unit())
    }

    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.axes.count() * self.layout.taxels());
        for (taxel, delay) in self.delays.iter().enumerate() {
            let time = start + delay;
            let force = script.force(taxel, time);
            for (channel, axis) in (self.axes.first()..3).enumerate() {
                let off = self.deviation[axis] * noise.normal();
                values.push(match script.fault(taxel, channel, time) {
                    Some(FaultReading::Dead) => self.last.dead(),
                    // A board that hangs repeats what it read of nothing.
                    Some(FaultReading::Stuck(_)) => 0.0,
                    None => self.last.deliver(force[axis] + off).number,
                });
            }
        }
        values
    }

    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        let taxels = self.delays.iter().enumerate();
        taxels
            .map(|(taxel, delay)| script.force(taxel, start + delay))
            .collect()
    }
}
