//! A pressure chip under rubber: what its port reads of the pressure above it.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{CellLaw, CellQuantity, ChainPart, PartParameter};
use crate::quantity::{self, Checked, PositiveLength, STRESS, TrappedAir};

/// The port of a pressure chip.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressurePort {
    /// Radius of the port, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub port_radius: f64,
    /// Share of the pressure that air in the port takes away, below 1: zero where it was degassed.
    #[serde(deserialize_with = "quantity::one::<TrappedAir, _>")]
    #[schemars(with = "Checked<TrappedAir>")]
    pub trapped_air: f64,
}

impl ChainPart for PressurePort {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let parameter = PartParameter {
            name: "trapped_air",
            unit: "",
            bounds: [0.0, 0.95],
            fitted: true,
            per_cell: true,
            absolute: false,
        };
        each(parameter, &mut self.trapped_air);
    }
}

impl CellLaw for PressurePort {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(*self)
    }

    fn quantity(&self) -> CellQuantity {
        CellQuantity {
            name: "port_pressure",
            dimension: Some(&STRESS),
            unit: ("kPa", 1e3, "pa"),
        }
    }

    /// A square of the same second moment as the port: over both a smooth pressure has the same
    /// mean up to the fourth order of their size.
    fn area(&self) -> Option<[f64; 2]> {
        Some([3.0_f64.sqrt() * self.port_radius; 2])
    }

    fn value(&self, pressure: f64) -> f64 {
        (1.0 - self.trapped_air) * pressure
    }
}
