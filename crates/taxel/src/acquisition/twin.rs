//! The simulated twin: stimulus -> force per taxel -> capacitances -> front
//! end -> frames. An ordinary source of frames.

use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};

use super::stimulus::{FaultReading, Stimulus};
use super::{Frame, Quantity, SignalUnit, Stream};
use crate::electronics::FrontEnd;
use crate::layout::Layout;
use crate::mechanics::Relaxation;
use crate::sensor::{Element, Sensor};
use crate::transduction::UnitModel;

/// A simulated device under a stimulus; the same seed gives the same frames.
#[derive(Debug, Clone)]
pub struct Twin {
    name: String,
    layout: Layout,
    units: Vec<UnitModel>,
    creep: Vec<(Relaxation<3>, f64)>,
    board: FrontEnd,
    stimulus: Stimulus,
    noise: ChaCha12Rng,
    sequence: u64,
    doubled: Option<Frame>,
}

/// What the twin does next.
#[derive(Debug, Clone, PartialEq)]
pub enum Delivery {
    /// A frame arrives.
    Frame(Frame),
    /// A frame was taken, at this device time in ns, but does not arrive.
    Nothing(u64),
}

/// The truth behind a frame, for tests and for learning: force on each taxel
/// x, y, pressing, N.
pub type TrueForces = Vec<[f64; 3]>;

impl Twin {
    /// The device that `sensor` describes, as one piece of its fabrication,
    /// under `stimulus`. `seed` is the seed of the noise.
    ///
    /// # Errors
    /// A sentence for people when the script names a taxel that the array
    /// does not have.
    pub fn new(sensor: &Sensor, stimulus: &Stimulus, seed: u64) -> Result<Self, String> {
        let layout = sensor.layout();
        stimulus.fits(&layout)?;
        let Element::ThreeAxisCapacitor(element) = &sensor.element;
        let taxels = layout.taxels();
        Ok(Self {
            name: sensor.name.clone(),
            units: fabricate(sensor, taxels),
            creep: vec![(Relaxation::new(&element.relaxation), 0.0); taxels],
            board: sensor.front_end(),
            stimulus: stimulus.clone(),
            noise: ChaCha12Rng::seed_from_u64(seed),
            sequence: 0,
            doubled: None,
            layout,
        })
    }

    /// What the frames mean.
    pub fn stream(&self) -> Stream {
        Stream {
            name: self.name.clone(),
            rows: self.layout.rows,
            columns: self.layout.columns,
            channels_per_taxel: 4,
            unit: SignalUnit {
                quantity: Quantity::Counts,
                symbol: "counts".into(),
                si_per_unit: 1.0,
            },
            pitch: Some([self.layout.pitch[1], self.layout.pitch[0]]),
            period: Some(self.board.period()),
            threshold: None,
            present: vec![true; 4 * self.layout.taxels()],
        }
    }

    /// The units as made.
    pub fn units(&self) -> &[UnitModel] {
        &self.units
    }

    /// True force on each taxel in the frame that starts at `time_ns`, N: half
    /// way between the sampling of its first and its last capacitor.
    pub fn true_forces(&self, time_ns: u64) -> TrueForces {
        let start = time_ns as f64 * 1e-9;
        (0..self.layout.taxels())
            .map(|taxel| {
                let middle = 0.5 * (self.board.delay(taxel, 0) + self.board.delay(taxel, 3));
                self.stimulus
                    .force(&self.layout, taxel, self.script_time(start + middle))
            })
            .collect()
    }

    fn script_time(&self, time: f64) -> f64 {
        time.rem_euclid(self.stimulus.duration)
    }

    /// Takes the next frame.
    pub fn next_delivery(&mut self) -> Delivery {
        if let Some(frame) = self.doubled.take() {
            return Delivery::Frame(frame);
        }
        let sequence = self.sequence;
        self.sequence += 1;
        let start = sequence as f64 * self.board.period();
        let time_ns = (start * 1e9).round() as u64;
        let values = self.scan(start);
        let nth = |every: u64| every > 0 && (sequence + 1).is_multiple_of(every);
        let link = self.stimulus.link;
        if self.stimulus.silent(self.script_time(start)) || nth(link.lose_every) {
            return Delivery::Nothing(time_ns);
        }
        let frame = Frame {
            sequence,
            time_ns,
            values,
        };
        if nth(link.double_every) {
            self.doubled = Some(frame.clone());
        }
        Delivery::Frame(frame)
    }

    /// Counts of all capacitors of the frame that starts at `start`, s.
    fn scan(&mut self, start: f64) -> Vec<f64> {
        let taxels = self.layout.taxels();
        let mut values = Vec::with_capacity(4 * taxels);
        for taxel in 0..taxels {
            let mut sampled = f64::NAN;
            let mut capacitance = [0.0; 4];
            for capacitor in 0..4 {
                let time = start + self.board.delay(taxel, capacitor);
                if time != sampled {
                    capacitance = self.capacitance(taxel, time);
                    sampled = time;
                }
                values.push(self.read(taxel, capacitor, capacitance[capacitor], time));
            }
        }
        values
    }

    /// True capacitances of a taxel at `time`, s.
    fn capacitance(&mut self, taxel: usize, time: f64) -> [f64; 4] {
        let force = self
            .stimulus
            .force(&self.layout, taxel, self.script_time(time));
        let (creep, last) = &mut self.creep[taxel];
        let elastic = creep.push_total(force, time - *last);
        *last = time;
        self.units[taxel].predict(elastic).1.capacitance()
    }

    fn read(&mut self, taxel: usize, capacitor: usize, capacitance: f64, time: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.noise);
        let script_time = self.script_time(time);
        match self
            .stimulus
            .fault(&self.layout, taxel, capacitor, script_time)
        {
            Some(FaultReading::Dead) => 0.0,
            // A stuck line has no noise of its own.
            Some(FaultReading::Stuck(stuck)) => f64::from(self.board.read(stuck.at, 0.0).counts),
            None => f64::from(self.board.read(capacitance, normal).counts),
        }
    }
}

/// The units of one piece: the air gap of each capacitor scattered about its
/// drawing, cut at three standard deviations.
fn fabricate(sensor: &Sensor, taxels: usize) -> Vec<UnitModel> {
    let mut scatter = ChaCha12Rng::seed_from_u64(sensor.fabrication.seed);
    (0..taxels)
        .map(|_| {
            let mut unit = sensor.unit_model();
            for air in &mut unit.plates.air_gap {
                let normal: f64 = StandardNormal.sample(&mut scatter);
                *air += sensor.fabrication.air_gap_deviation * normal.clamp(-3.0, 3.0);
            }
            unit
        })
        .collect()
}
