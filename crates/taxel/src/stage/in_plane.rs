//! The in-plane capacitor (P1) as a cell: the force on its layer to its capacitance.

use std::sync::Arc;

use super::{
    CellEstimate, CellLaw, CellLoad, CellQuantity, CellState, ChainPart, PartParameter, image,
    searched,
};
use crate::quantity::CAPACITANCE;
use crate::transduction::{ForceCurve, InPlaneError, InPlaneModel};
use taxel_numerics::least_squares::NORMAL_95;

/// A value below this share of the least capacitance of the model, or above its reciprocal times
/// the rest value, is no capacitor.
const LEAST_SHARE: f64 = 0.5;
/// Noise alone moves a capacitance by more of its standard deviations than this once in 10⁹ frames.
const BY_NOISE: f64 = 6.0;

/// One in-plane capacitor.
#[derive(Debug, Clone)]
pub struct InPlaneCell {
    model: InPlaneModel,
    /// The way back, looked up.
    curve: Option<Arc<ForceCurve>>,
}

impl InPlaneCell {
    /// A capacitor that is read back as any curve is, by searching its root.
    pub fn new(model: InPlaneModel) -> Self {
        Self { model, curve: None }
    }

    /// A capacitor whose way back is looked up.
    ///
    /// # Errors
    /// Those of [`InPlaneModel::inverse`] and of its check.
    pub fn invertible(model: InPlaneModel) -> Result<Self, InPlaneError> {
        let inverse = model.inverse()?;
        inverse.check()?;
        Ok(Self {
            model,
            curve: Some(Arc::new(ForceCurve::new(inverse))),
        })
    }

    /// Its model.
    pub fn model(&self) -> &InPlaneModel {
        &self.model
    }
}

impl ChainPart for InPlaneCell {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let drawn = self.model.electrodes.gap;
        let parameter = PartParameter {
            name: "gap",
            unit: "m",
            bounds: [0.5 * drawn, 2.0 * drawn],
            fitted: false,
            per_cell: true,
            absolute: false,
        };
        each(parameter, &mut self.model.electrodes.gap);
        if self.model.electrodes.gap != drawn {
            self.curve = None;
        }
    }
}

impl CellLaw for InPlaneCell {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(self.clone())
    }

    fn quantity(&self) -> CellQuantity {
        CellQuantity {
            name: "capacitance",
            dimension: Some(&CAPACITANCE),
            unit: ("fF", 1e-15, "f"),
        }
    }

    fn load(&self) -> CellLoad {
        CellLoad::Force
    }

    fn area(&self) -> Option<[f64; 2]> {
        let layer = &self.model.layer;
        Some([2.0 * layer.contact_half_length, layer.contact_depth])
    }

    /// Beyond the range of the model the capacitance stays at its end.
    fn value(&self, load: f64) -> f64 {
        let model = &self.model;
        let last = model.largest_compression();
        let compression = match load.abs() {
            0.0 => 0.0,
            force => model.compression_from_force(force).unwrap_or(last),
        };
        let pressed = model
            .respond(compression.min(last))
            .map_or_else(|_| model.rest_capacitance(), |state| state.capacitance);
        if load < 0.0 {
            2.0 * model.rest_capacitance() - pressed
        } else {
            pressed
        }
    }

    fn inverse(&self, value: f64, largest: f64) -> f64 {
        let Some(curve) = &self.curve else {
            return searched(|load| self.value(load), value, largest);
        };
        let change = self.model.rest_capacitance() - value;
        if change.abs() <= curve.inverse().last().change {
            curve.force(change)
        } else {
            f64::NAN
        }
    }

    /// Over two standard deviations rather than by the slope: the published law has none at rest.
    fn estimate(&self, value: f64, deviation: f64, largest: f64) -> CellEstimate {
        let Some(curve) = &self.curve else {
            return image(self, value, deviation, largest);
        };
        let inverse = curve.inverse();
        let (last, rest) = (inverse.last(), self.model.rest_capacitance());
        let possible = LEAST_SHARE * last.capacitance..=rest / LEAST_SHARE;
        if !possible.contains(&value) {
            return CellEstimate::nothing(CellState::Impossible);
        }
        let change = rest - value;
        if change < -BY_NOISE * deviation {
            return CellEstimate::nothing(CellState::BelowRest);
        }
        // So near to the end that noise alone may hide how far beyond it the load is.
        if change > last.change - BY_NOISE * deviation {
            let state = match inverse.turning() {
                Some(_) => CellState::Ambiguous,
                None => CellState::Beyond,
            };
            let least = (change - NORMAL_95 * deviation).clamp(0.0, last.change);
            return CellEstimate::bound(curve.force(least), state);
        }
        let [low, high] = [change - deviation, (change + deviation).min(last.change)];
        let spread = curve.force(high) - curve.force(low);
        CellEstimate {
            load: curve.force(change),
            deviation: deviation * spread / (high - low),
            state: CellState::Ok,
        }
    }

    fn saturates(&self) -> bool {
        false
    }

    /// The capacitor with the gap that has this value; as it is where that cannot be read back.
    fn at_rest(&self, value: f64) -> Option<Box<dyn CellLaw>> {
        let found = self.model.at_rest(value).and_then(|model| {
            let looked_up = self.curve.is_some();
            if looked_up {
                Self::invertible(model).ok()
            } else {
                Some(Self::new(model))
            }
        });
        Some(Box::new(found.unwrap_or_else(|| self.clone())))
    }

    fn rest_problem(&self, value: f64) -> Option<String> {
        self.model.at_rest(value).is_none().then(|| {
            format!(
                "reads {:.1} fF, which belongs to no gap near the drawn one of {:.1} um; check it or mask it",
                1e15 * value,
                1e6 * self.model.electrodes.gap
            )
        })
    }
}
