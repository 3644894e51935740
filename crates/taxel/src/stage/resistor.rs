//! A resistor that a pressure closes: Velostat, force-sensing resistors, piezoresistive ink.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{CellLaw, CellQuantity, ChainPart, PartParameter};
use crate::quantity::{
    self, CONDUCTANCE, Checked, ConductanceExponent, PositiveConductance, PositiveLength,
    PositiveStress,
};
use taxel_ground::summary::{Fact, fact, number};

/// A crossing whose conductance grows with the pressure on it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Resistor {
    /// Sides [x, y] of the crossing, m.
    #[serde(deserialize_with = "quantity::list::<2, PositiveLength, _>")]
    #[schemars(with = "[Checked<PositiveLength>; 2]")]
    pub area: [f64; 2],
    /// Law of the conductance.
    pub conductance: Conductance,
}

/// g = rest + factor·(p/unit_pressure)^exponent: conduction through contacts.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Conductance {
    /// Conductance without pressure, S.
    #[serde(deserialize_with = "quantity::one::<PositiveConductance, _>")]
    #[schemars(with = "Checked<PositiveConductance>")]
    pub rest: f64,
    /// What `unit_pressure` adds to it, S.
    #[serde(deserialize_with = "quantity::one::<PositiveConductance, _>")]
    #[schemars(with = "Checked<PositiveConductance>")]
    pub factor: f64,
    /// Exponent, 0.3 to 1.5: 0.5 to 1 where contacts dominate.
    #[serde(deserialize_with = "quantity::one::<ConductanceExponent, _>")]
    #[schemars(with = "Checked<ConductanceExponent>")]
    pub exponent: f64,
    /// Pressure for which `factor` is stated, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub unit_pressure: f64,
}

/// Conductances in the unit for people.
const MICROSIEMENS: (&str, f64, &str) = ("uS", 1e-6, "siemens");

impl ChainPart for Resistor {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let law = &mut self.conductance;
        for (name, unit, bounds, value) in [
            (
                "rest_conductance",
                "S",
                [1e-2 * law.rest, 1e2 * law.rest],
                &mut law.rest,
            ),
            (
                "conductance_factor",
                "S",
                [1e-3 * law.factor, 1e3 * law.factor],
                &mut law.factor,
            ),
            ("conductance_exponent", "", [0.3, 1.5], &mut law.exponent),
        ] {
            let parameter = PartParameter {
                name,
                unit,
                bounds,
                fitted: true,
                per_cell: true,
                absolute: false,
            };
            each(parameter, value);
        }
    }

    fn facts(&self) -> Vec<Fact> {
        let law = &self.conductance;
        let rest = number(1.0 / law.rest, "ohm", "kohm", 1e3);
        vec![fact(
            "transduction",
            "rest_resistance",
            rest,
            "element.cells.cell.resistor.conductance.rest",
        )]
    }
}

impl CellLaw for Resistor {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(*self)
    }

    fn quantity(&self) -> CellQuantity {
        CellQuantity {
            name: "conductance",
            dimension: Some(&CONDUCTANCE),
            unit: MICROSIEMENS,
        }
    }

    fn area(&self) -> Option<[f64; 2]> {
        Some(self.area)
    }

    fn value(&self, pressure: f64) -> f64 {
        let law = &self.conductance;
        let size = (pressure.abs() / law.unit_pressure).powf(law.exponent);
        law.rest + law.factor * size.copysign(pressure)
    }

    fn inverse(&self, value: f64, largest: f64) -> f64 {
        let law = &self.conductance;
        let added = (value - law.rest) / law.factor;
        let pressure = law.unit_pressure * added.abs().powf(law.exponent.recip());
        if pressure <= largest {
            pressure.copysign(added)
        } else {
            f64::NAN
        }
    }

    fn caveat(&self) -> Option<&'static str> {
        Some("loading: these materials read more on unloading")
    }
}
