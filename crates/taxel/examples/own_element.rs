//! An element of your own: a foam whose capacitance grows as it is squeezed, in 80 lines. From
//! them it has check, predict, twin and live.
//!
//! `cargo run --release -p taxel --example own_element`

use schemars::JsonSchema;
use serde::Deserialize;
use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::device::Registry;
use taxel::predict::Loads;
use taxel::quantity::{self, CAPACITANCE, Checked, PositiveCapacitance, PositiveStress};
use taxel::stage::{CellLaw, CellQuantity, OneToOne, OwnElement, Parts, Stage};

/// C = rest (1 + p/(p + stiffness)): a gap that closes to half.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Foam {
    /// Capacitance at rest, F.
    #[serde(deserialize_with = "quantity::one::<PositiveCapacitance, _>")]
    #[schemars(with = "Checked<PositiveCapacitance>")]
    rest: f64,
    /// Pressure that closes a quarter of the gap, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    stiffness: f64,
}

impl Stage for Foam {}

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

    fn area(&self) -> [f64; 2] {
        [4e-3; 2]
    }

    fn value(&self, pressure: f64) -> f64 {
        self.rest * (1.0 + pressure / (pressure.abs() + self.stiffness))
    }
}

impl OwnElement for Foam {
    fn parts(&self) -> Parts {
        let network = Box::new(OneToOne);
        Parts {
            cover: None,
            cell: self.boxed(),
            network,
            memory: None,
            full_scale: 50e3,
        }
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
    let sensor = Registry::default()
        .with::<Foam>("foam")
        .parse("foam.toml", SENSOR)?;
    let device = sensor.device()?;
    println!("check: {} facts", device.facts().len());
    let predictor = device.predictor().ok_or("a chain has a predictor")?;
    let (loads, mut row) = (
        Loads::one("fz=0.5 N", predictor.load_columns())?,
        Vec::new(),
    );
    predictor
        .answer(&loads.load(0), &mut row)
        .map_err(|refused| refused.message)?;
    println!("predict: pressure {:?}, capacitance {:?}", row[3], row[4]);
    let script = Stimulus::parse(
        "two-fingers",
        Stimulus::shipped_text("two-fingers").unwrap_or_default(),
    )?;
    let mut twin = Twin::new(&sensor, &script, 1)?;
    let mut session = device.session(&twin.stream())?;
    for _ in 0..500 {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            session.push(&frame)?;
        }
    }
    let [force, deviation] = session
        .estimator()
        .touch()
        .pressing_force()
        .ok_or("the total is known")?;
    println!("live: {force:.3} +- {deviation:.3} N");
    Ok(())
}
