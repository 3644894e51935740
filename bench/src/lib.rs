//! The scene that all benchmarks measure: the shipped 8 x 8 array under the
//! shipped finger script, after a rest capture.

use taxel::acquisition::{Delivery, Frame, Quantity, Stimulus, Twin};
use taxel::calibration::ThreeAxisCalibration;
use taxel::estimation::{ArrayEstimator, FrameError, ThreeAxisOptions, ThreeAxisReader};
use taxel::sensor::{Element, Sensor};

/// Frames of the rest capture, as in the paper.
const REST_FRAMES: usize = 50;
/// Script time of the press held with 60 mN along x and 60 mN normal, s.
const PRESSED: std::ops::Range<f64> = 6.0..7.0;

/// Frames of the twin and an estimator that has taken its rest capture.
pub struct Scene {
    /// The estimator.
    pub estimator: ArrayEstimator,
    /// Frames without touch.
    pub rest: Vec<Frame>,
    /// Frames of a press with shear.
    pub pressed: Vec<Frame>,
}

impl Scene {
    /// The scene on the shipped 8 x 8 array with plates alone: the peers have no edges.
    ///
    /// # Panics
    /// When a shipped file or the rest capture is broken.
    #[must_use]
    pub fn new() -> Self {
        let mut sensor = Sensor::shipped("three-axis-8x8").expect("is shipped");
        if let Element::ThreeAxisCapacitor(element) = &mut sensor.element {
            element.plates.parallel_capacitance = Some([0.0; 4]);
        }
        Self::of(&sensor)
    }

    /// The scene on the shipped array as it is, with the edges of its tiles.
    ///
    /// # Panics
    /// When a shipped file or the rest capture is broken.
    #[must_use]
    pub fn with_edges() -> Self {
        Self::of(&Sensor::shipped("three-axis-8x8").expect("is shipped"))
    }

    fn of(sensor: &Sensor) -> Self {
        let script = Stimulus::shipped_text("finger").expect("is shipped");
        let stimulus = Stimulus::parse("finger", script).expect("is shipped and tested");
        let mut twin = Twin::new(sensor, &stimulus, 1).expect("the script fits the array");
        let calibration = sensor
            .three_axis()
            .expect("is a three-axis array")
            .calibration();
        let options = ThreeAxisOptions::default();
        let reader = ThreeAxisReader::new(calibration, Quantity::Counts, options);
        let reader = reader.expect("the array gives counts");
        Self::after_rest(ArrayEstimator::new(Box::new(reader)), &mut twin)
    }

    fn after_rest(mut estimator: ArrayEstimator, twin: &mut Twin) -> Self {
        estimator.begin_rest_capture(REST_FRAMES);
        let mut scene = Self {
            estimator,
            rest: Vec::new(),
            pressed: Vec::new(),
        };
        scene.run(twin);
        scene
    }

    /// The scene on an array all of whose taxels are pressed with one force, N, from 6 s on.
    ///
    /// # Panics
    /// When the array has no estimator of frames.
    #[must_use]
    pub fn pressed_everywhere(sensor: &Sensor, force: f64) -> Self {
        let taxels = (0..sensor.array.rows)
            .flat_map(|row| (0..sensor.array.columns).map(move |column| [row, column]));
        let probe = |[row, column]: [usize; 2]| {
            format!(
                "[[probe]]\ntaxel = [{row}, {column}]\npath = [\n\
                 {{ time = \"5.5 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }},\n\
                 {{ time = \"5.9 s\", force = [\"0 N\", \"0 N\", \"{force} N\"] }},\n]\n"
            )
        };
        let probes: String = taxels.map(probe).collect();
        let script = format!("schema = 1\nname = \"all\"\nduration = \"8 s\"\n{probes}");
        let stimulus = Stimulus::parse("all", &script).expect("one probe a taxel");
        let mut twin = Twin::new(sensor, &stimulus, 1).expect("the script fits the array");
        let device = sensor.device().expect("a device");
        let reader = device.reader(&twin.stream()).expect("its own frames");
        Self::after_rest(ArrayEstimator::new(reader), &mut twin)
    }

    /// The calibration after the rest capture.
    ///
    /// # Panics
    /// Never: the scene is made with such a reader.
    #[must_use]
    pub fn calibration(&self) -> &ThreeAxisCalibration {
        let reader: Option<&ThreeAxisReader> = self.estimator.reader();
        reader.expect("a reader of three axes").calibration()
    }

    /// Pressing force of each taxel with its standard deviation, N, by the estimator
    /// of the array on the pressed frame number `index`.
    ///
    /// # Errors
    /// For a frame of another device.
    pub fn estimate(&mut self, index: usize) -> Result<Vec<[f64; 2]>, FrameError> {
        let (touch, _) = self.estimator.push(&self.pressed[index])?;
        let taxels = touch.taxels.iter();
        Ok(taxels
            .map(|taxel| [taxel.pressed(), taxel.pressed_deviation()])
            .collect())
    }

    fn run(&mut self, twin: &mut Twin) {
        loop {
            let Delivery::Frame(frame) = twin.next_delivery() else {
                continue;
            };
            let time = frame.time_ns as f64 * 1e-9;
            if time >= PRESSED.end {
                return;
            }
            if self.estimator.capturing() {
                let (_, captured) = self.estimator.push(&frame).expect("frames of this sensor");
                assert!(!matches!(captured, Some(Err(_))), "the twin is at rest");
            } else if PRESSED.contains(&time) {
                self.pressed.push(frame);
            } else if time < 2.0 {
                self.rest.push(frame);
            }
        }
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self::new()
    }
}

/// Time that the calling thread has computed, s: unlike the clock it leaves
/// out what others do on its core. Linux counts it, in steps of some ms.
///
/// # Panics
/// On other systems.
#[must_use]
pub fn computed() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("runs on Linux");
    let nanoseconds = text
        .split(' ')
        .next()
        .and_then(|word| word.parse::<f64>().ok());
    nanoseconds.expect("begins with a number") * 1e-9
}

/// Prints a figure in the form that `figures` reads: `group.rest` and its value.
pub fn figure(name: &str, value: f64) {
    println!("figure {name} {value:.6e}");
}
