//! One made array: force on each taxel to the number of each channel.

use super::MicrochannelArray;
use crate::acquisition::{Script, Simulated, Stream};
use crate::electronics::DividerBoard;
use crate::layout::Layout;
use crate::mechanics::Stretch;
use crate::transduction::{Conductor, MicrochannelLayer};
use taxel_numerics::Noise;

/// One piece of fabrication.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    layout: Layout,
    layers: [MicrochannelLayer; 2],
    taxel_share: [f64; 2],
    /// The made channels, rows first.
    conductors: Vec<Conductor>,
    board: DividerBoard,
}

impl Piece {
    pub(super) fn new(array: &MicrochannelArray<'_>) -> Self {
        Self {
            layout: array.layout(),
            layers: array.layers.clone(),
            taxel_share: array.taxel_share(),
            conductors: array.element.fabricate(&array.layers, array.counts()),
            board: array.board,
        }
    }

    /// Layer of a channel, and the taxels that it crosses.
    fn crossed(&self, channel: usize) -> (usize, Vec<usize>) {
        let (rows, columns) = (self.layout.rows, self.layout.columns);
        if channel < rows {
            (0, (0..columns).map(|c| channel * columns + c).collect())
        } else {
            (1, (0..rows).map(|r| r * columns + channel - rows).collect())
        }
    }

    /// True resistance of a channel at `time`, s, in Ω.
    ///
    /// Each taxel carries the mean pressure on its cell; a pull is none, since
    /// nothing holds the surface up.
    fn resistance(&self, script: &Script<'_>, channel: usize, time: f64) -> f64 {
        let (layer, taxels) = self.crossed(channel);
        let cell = self.layout.pitch[0] * self.layout.pitch[1];
        let share = self.taxel_share[layer];
        let mut stretches: Vec<_> = taxels
            .iter()
            .map(|taxel| Stretch {
                share,
                pressure: script.force(*taxel, time)[2].max(0.0) / cell,
            })
            .collect();
        stretches.push(Stretch {
            share: (1.0 - share * taxels.len() as f64).max(0.0),
            pressure: 0.0,
        });
        let conductor = &self.conductors[channel];
        // A channel that cannot be computed reads as open.
        self.layers[layer]
            .closing
            .settle(&self.layers[layer].liquid, &stretches)
            .map_or(f64::INFINITY, |settled| {
                conductor.resistance(&stretches, &settled.sections)
            })
    }

    /// True if a fault of the script is on a taxel of the channel: the channel
    /// is then dead.
    fn dead(&self, script: &Script<'_>, channel: usize, time: f64) -> bool {
        let (_, taxels) = self.crossed(channel);
        let mut taxels = taxels.into_iter();
        taxels.any(|taxel| script.fault(taxel, 0, time).is_some())
    }
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        let channels = self.conductors.len();
        Stream {
            name: String::new(),
            rows: 1,
            columns: channels,
            channels_per_taxel: 1,
            unit: self.board.last.unit(),
            pitch: None,
            period: Some(self.board.period()),
            threshold: None,
            present: vec![true; channels],
        }
    }

    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        (0..self.conductors.len())
            .map(|channel| {
                let time = start + self.board.delay(channel);
                let normal = noise.normal();
                if self.dead(script, channel, time) {
                    return self.board.last.dead();
                }
                let resistance = self.resistance(script, channel, time);
                self.board.read(resistance, normal).number
            })
            .collect()
    }

    /// Half way between the sampling of the first and the last channel.
    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        let last = self.conductors.len().saturating_sub(1);
        let middle = start + 0.5 * self.board.delay(last);
        (0..self.layout.taxels())
            .map(|taxel| script.force(taxel, middle))
            .collect()
    }
}
