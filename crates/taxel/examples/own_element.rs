//! An element of your own, a foam capacitor: check, predict, twin and live follow from its law.
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::device::Registry;
use taxel::predict::Loads;
use taxel::quantity::{CAPACITANCE, Checked, PositiveCapacitance, PositiveStress};
use taxel::stage::{CellLaw, CellQuantity, ChainPart, OwnElement, Parts};

/// C = rest (1 + p/(p + stiffness)): a gap that closes to half.
#[derive(Debug, Clone, Copy, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Foam {
    rest: Checked<PositiveCapacitance>,
    stiffness: Checked<PositiveStress>,
}

impl ChainPart for Foam {}

impl CellLaw for Foam {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(*self)
    }

    fn quantity(&self) -> CellQuantity {
        CellQuantity {
            name: "capacitance",
            dimension: Some(&CAPACITANCE),
            unit: ("fF", 1e-15, "f"),
        }
    }

    fn area(&self) -> Option<[f64; 2]> {
        Some([4e-3; 2]) // m
    }

    fn value(&self, pressure: f64) -> f64 {
        self.rest.0 * (1.0 + pressure / (pressure.abs() + self.stiffness.0))
    }
}

impl OwnElement for Foam {
    fn parts(&self) -> Parts {
        Parts::of_cell(self.boxed(), 50e3) // Pa: end of the law
    }
}

const SENSOR: &str = r#"
schema = 2
name = "foam, 4x4"
array = { rows = 4, columns = 4, pitch = "5 mm", mount = "flat" }
element.foam = { rest = "400 fF", stiffness = "30 kPa" }
electronics = { frame_rate = "100 Hz", scan = "simultaneous", readout = { measured = { unit = "fF", noise = "1 fF", range = ["0 fF", "1 pF"] } } }
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let registry = Registry::default().with::<Foam>("foam");
    let sensor = registry.parse("foam.toml", SENSOR)?;
    let device = sensor.device()?;
    println!("check: {} facts", device.facts().len());
    let predictor = device.predictor().ok_or("a chain predicts")?;
    let loads = Loads::one("fz=0.5 N", predictor.load_columns())?;
    let mut row = Vec::new();
    let answer = predictor.answer(&loads.load(0), &mut row);
    answer.map_err(|refused| refused.message)?;
    println!("predict: {:?} Pa, {:?} F", row[3], row[4]);
    let script = Stimulus::shipped_text("two-fingers").unwrap_or_default();
    let mut twin = Twin::new(&sensor, &Stimulus::parse("two-fingers", script)?, 1)?;
    let mut session = device.session(&twin.stream())?;
    for _ in 0..500 {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            session.push(&frame)?;
        }
    }
    let touch = session.estimator().touch();
    println!("live: {:?} N, deviation", touch.pressing_force());
    Ok(())
}
