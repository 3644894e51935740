//! The in-plane capacitive sensor (P1): compression of its layer to force and
//! capacitance, and back where the curve allows.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::coplanar_capacitor::{Dielectric, PublishedFringe, facing_sides};
use super::in_plane_table::DrawnTable;
use super::solved_section::SolvedSection;
use crate::mechanics::{
    CompressedLayer, DeformedElectrodes, Electrodes, EndCondition, LARGEST_COMPRESSION, LayerError,
    LayerRange, LayerState, OutsideTable, PublishedThinning, force_error,
};
use taxel_numerics::roots;

/// Why the in-plane sensor has no answer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InPlaneError {
    /// The layer has none.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// A table that would be needed does not reach there.
    #[error(transparent)]
    Table(#[from] OutsideTable),
    /// The device has no published fit, which the published law needs.
    #[error("the published law needs the published fit (t_min, n, q, gamma) of this device")]
    NoPublishedFit,
    /// The published law has no sensitivity at rest: for γ < 0 its slope is
    /// infinite there, for γ > 0 zero.
    #[error(
        "the published law, change ~ U^(1 + gamma) with gamma = {exponent}, has no sensitivity at rest"
    )]
    NoSensitivityAtRest {
        /// γ.
        exponent: f64,
    },
    /// A capacitance above that at rest: pressing only lowers it.
    #[error("a capacitance of {capacitance:.6e} F is above that at rest, {rest:.6e} F")]
    AboveRest {
        /// Reading, F.
        capacitance: f64,
        /// At rest, F.
        rest: f64,
    },
    /// A curve that does not fall from rest on over a range worth the name: no force follows from a
    /// reading, though loads are answered.
    #[error(
        "the capacitance belongs to one compression only up to a compression of {compression:.4}, so that no force \
         follows from a reading"
    )]
    NotInvertible {
        /// Compression up to which it does.
        compression: f64,
    },
    /// A fall of the capacitance beyond what belongs to one compression only.
    #[error(
        "a capacitance {change:.6e} F below that at rest is beyond {limit:.6e} F, up to which it belongs to one compression (to {compression:.4})"
    )]
    BeyondInvertible {
        /// Decrease of the capacitance, F.
        change: f64,
        /// Largest possible decrease, F.
        limit: f64,
        /// Compression there.
        compression: f64,
    },
}

/// Which law gives the capacitance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CapacitanceLaw {
    /// Facing sides, coplanar strips and surroundings, on electrodes deformed
    /// by mechanics.
    Mechanics,
    /// The published fit, P1 Eqs. 7 and 8: for a device calibrated that way.
    Published,
}

/// The published fit of one device (P1 Table 1).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedFit {
    /// Thickness of the electrodes.
    pub thinning: PublishedThinning,
    /// Factor on the change of capacitance.
    pub fringe: PublishedFringe,
}

/// One in-plane capacitive sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct InPlaneModel {
    /// The layer.
    pub layer: CompressedLayer,
    /// The electrodes in it.
    pub electrodes: Electrodes,
    /// Dielectric between and around the electrodes.
    pub dielectric: Dielectric,
    /// The published fit, where there is one.
    pub published_fit: Option<PublishedFit>,
    /// The law of its capacitance.
    pub law: CapacitanceLaw,
    /// Capacitance beside that of the electrodes, F, such as that of leads;
    /// no load changes it.
    pub stray_capacitance: f64,
    /// Its cross-section solved, where no table has it.
    pub solved: Option<Arc<SolvedSection>>,
    /// Its load path by finite elements as a table, in the place of the closed forms.
    pub table: Option<Arc<DrawnTable>>,
}

/// State of the sensor under a compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InPlaneState {
    /// The layer.
    pub layer: LayerState,
    /// The electrodes under the law of the device.
    pub electrodes: DeformedElectrodes,
    /// Capacitance under that law, F.
    pub capacitance: f64,
    /// C₀ − C under that law, F: positive when the capacitance falls.
    pub change: f64,
}

impl InPlaneModel {
    /// Capacitance at rest, F, under both laws.
    pub fn rest_capacitance(&self) -> f64 {
        self.mechanical_capacitance(&self.electrodes.at_rest(), 0.0)
    }

    /// Capacitance at rest between the facing sides alone, F: ε₀ ε_r w_e T/D.
    pub fn rest_capacitance_without_fringe(&self) -> f64 {
        self.dielectric.scale(self.electrodes.depth) * facing_sides(&self.electrodes.at_rest())
    }

    /// The device whose gap gives the capacitance `rest` at rest, all else as
    /// here; `None` if that needs a gap of less than half or more than twice
    /// this one, or one outside a table.
    ///
    /// The same as for any capacitor whose rest value differs from the drawing:
    /// subtracting an offset instead would leave the curve of the drawn gap.
    pub fn at_rest(&self, rest: f64) -> Option<Self> {
        let with_gap = |gap: f64| {
            let mut model = self.clone();
            model.electrodes.gap = gap;
            model
        };
        let drawn = self.electrodes.gap;
        // The capacitance falls as the gap grows.
        let range = [0.5 * drawn, 2.0 * drawn];
        let [most, least] = range.map(|gap| with_gap(gap).rest_capacitance());
        if !(least..=most).contains(&rest) {
            return None;
        }
        let misfit = |gap: f64| rest - with_gap(gap).rest_capacitance();
        let found = with_gap(roots::ridders(range, misfit));
        found.check().is_ok().then_some(found)
    }

    /// Checks that the device lies in all tables that it needs.
    ///
    /// # Errors
    /// The error of the first thing that is missing.
    pub fn check(&self) -> Result<(), InPlaneError> {
        if self.table.is_some() {
            return self.respond(0.0).map(drop);
        }
        if let Some(solved) = &self.solved {
            solved.check(self.electrodes.gap)?;
            return self.respond(0.0).map(drop);
        }
        self.dielectric.surroundings.check(
            &self.layer,
            &self.electrodes,
            self.dielectric.permittivity,
        )?;
        self.respond(0.0).map(drop)
    }

    /// True where the closed form of the capacitance was compared with the field: electrodes at least
    /// eight thicknesses wide, with a gap of at most 1.2; the published law has no closed form to compare.
    pub fn is_compared(&self) -> bool {
        let electrodes = &self.electrodes;
        let slack = 1e-9 * electrodes.thickness;
        self.law == CapacitanceLaw::Published
            || electrodes.width >= 8.0 * electrodes.thickness - slack
                && electrodes.gap <= 1.2 * electrodes.thickness + slack
    }

    /// Largest compression at which the law of the device has an answer.
    pub fn largest_compression(&self) -> f64 {
        match self.law {
            CapacitanceLaw::Mechanics => self.largest_mechanical(),
            CapacitanceLaw::Published => LARGEST_COMPRESSION,
        }
    }

    fn largest_mechanical(&self) -> f64 {
        if let Some(table) = &self.table {
            return table.largest_compression();
        }
        if let Some(solved) = &self.solved {
            return solved.largest_compression();
        }
        let table = self.dielectric.surroundings.largest_compression();
        self.electrodes
            .largest_compression()
            .min(table.unwrap_or(LARGEST_COMPRESSION))
    }

    /// The layer of the closed form: with free ends where the table of its end condition does
    /// not reach, which a solved cross-section then corrects.
    pub fn closed_layer(&self) -> CompressedLayer {
        let mut layer = self.layer;
        if let Err(LayerError::AspectOutsideTable { .. }) =
            layer.end_condition.factor(layer.aspect(), 0.0)
        {
            layer.end_condition = EndCondition::Free;
        }
        layer
    }

    /// Force over that of [`InPlaneModel::closed_layer`]; 1 without a solved cross-section.
    pub fn force_ratio(&self, compression: f64) -> f64 {
        let gap = self.electrodes.gap;
        self.solved
            .as_ref()
            .map_or(1.0, |solved| solved.force_ratio(gap, compression))
    }

    /// Motion and force of the layer at a relative compression e = U/H.
    ///
    /// # Errors
    /// Those of [`CompressedLayer::compress`]; of a solved cross-section also beyond its
    /// end.
    pub fn compress(&self, compression: f64) -> Result<LayerState, InPlaneError> {
        if let Some(table) = &self.table {
            let mut state = self.closed_layer().compress(compression)?;
            let limit = table.largest_compression();
            state.mean_stress = table.stress(compression, state.mean_stress);
            state.force = self.layer.contact_area() * state.mean_stress;
            state.range = if compression <= limit * (1.0 + 1e-12) {
                LayerRange::Within
            } else {
                LayerRange::CompressionAbove { limit }
            };
            return Ok(state);
        }
        let Some(solved) = &self.solved else {
            return Ok(self.layer.compress(compression)?);
        };
        let mut state = self.closed_layer().compress(compression)?;
        let limit = solved.largest_compression();
        let ratio = self.force_ratio(compression);
        state.mean_stress *= ratio;
        state.force *= ratio;
        if solved.errors().force.is_some() {
            state.range = if compression <= limit * (1.0 + 1e-12) {
                LayerRange::Within
            } else {
                LayerRange::CompressionAbove { limit }
            };
        }
        Ok(state)
    }

    /// The compression at which the layer carries `force`, N: the inverse of
    /// [`InPlaneModel::compress`].
    ///
    /// # Errors
    /// [`LayerError::Force`] for a pull or a force above the range of the models.
    pub fn compression_from_force(&self, force: f64) -> Result<f64, InPlaneError> {
        let most = match (&self.table, &self.solved) {
            (Some(table), _) => table.largest_compression(),
            (None, Some(solved)) => solved.largest_compression(),
            (None, None) => return Ok(self.layer.compression_from_force(force)?),
        };
        let limit = self.compress(most)?.force;
        if !(0.0..=limit).contains(&force) {
            return Err(LayerError::Force { force, limit }.into());
        }
        let misfit = |e: f64| self.compress(e).map_or(f64::NAN, |state| state.force) - force;
        Ok(roots::ridders([0.0, most], misfit))
    }

    /// Largest known error of the force at a compression, as a share of it.
    pub fn force_error(&self, compression: f64) -> Option<f64> {
        if let Some(table) = &self.table {
            return table.force_error(compression);
        }
        let solved = self.solved.as_ref().map(|solved| solved.errors().force);
        match solved {
            // A calibrated end factor belongs to a device, not to a drawing; beyond the end of the
            // solution nothing is known.
            Some(Some(error)) => (self.layer.end_scale == 1.0
                && compression <= self.largest_compression() * (1.0 + 1e-9))
                .then_some(error),
            _ => force_error(&self.layer, &self.electrodes, compression),
        }
    }

    /// Force and capacitance at a relative compression e = U/H.
    ///
    /// # Errors
    /// Those of [`CompressedLayer::compress`] and [`Electrodes::deform`], and
    /// [`InPlaneError::Table`] above [`InPlaneModel::largest_compression`].
    pub fn respond(&self, compression: f64) -> Result<InPlaneState, InPlaneError> {
        let layer = self.compress(compression)?;
        let (electrodes, change) = match self.law {
            CapacitanceLaw::Mechanics => self.by_mechanics(&layer)?,
            CapacitanceLaw::Published => {
                let fit = self.published_fit.ok_or(InPlaneError::NoPublishedFit)?;
                let electrodes = self.as_published(&layer, &fit);
                let change = self.published_change(&electrodes, &fit, compression);
                (electrodes, change)
            }
        };
        Ok(InPlaneState {
            layer,
            electrodes,
            capacitance: self.rest_capacitance() - change,
            change,
        })
    }

    /// C₀ − C by mechanics, F: facing sides, coplanar strips, surroundings.
    ///
    /// # Errors
    /// As [`InPlaneModel::respond`] under [`CapacitanceLaw::Mechanics`].
    pub fn change_by_mechanics(&self, layer: &LayerState) -> Result<f64, InPlaneError> {
        self.by_mechanics(layer).map(|(_, change)| change)
    }

    /// C₀ − C by the published law (P1's Model 1), F:
    /// ε₀ ε_r w_e (T/D − t/d) q (U/D)^γ (P1 Eq. 7) with d = D f and t from
    /// P1 Eq. 8; 0 at rest. `None` without a published fit.
    pub fn change_as_published(&self, layer: &LayerState) -> Option<f64> {
        let fit = self.published_fit?;
        let electrodes = self.as_published(layer, &fit);
        Some(self.published_change(&electrodes, &fit, layer.kinematics.compression()))
    }

    /// C₀ − C by parallel plates (P1's Model 2), F: ε₀ ε_r w_e (T/D − t/d) with
    /// d and t as for Model 1. `None` without a published fit.
    pub fn change_of_parallel_plates(&self, layer: &LayerState) -> Option<f64> {
        let fit = self.published_fit?;
        Some(self.facing_change(&self.as_published(layer, &fit)))
    }

    fn by_mechanics(&self, layer: &LayerState) -> Result<(DeformedElectrodes, f64), InPlaneError> {
        let compression = layer.kinematics.compression();
        let range = [0.0, self.largest_mechanical()];
        OutsideTable::check("the capacitance model", "compression", compression, range)?;
        let electrodes = match (&self.table, &self.solved) {
            (Some(table), _) => table.deform(&self.electrodes.at_rest(), compression),
            (None, Some(solved)) => solved.deform(&self.electrodes.at_rest(), compression),
            (None, None) => self.electrodes.deform(&self.layer, &layer.kinematics)?,
        };
        let capacitance = self.mechanical_capacitance(&electrodes, compression);
        Ok((electrodes, self.rest_capacitance() - capacitance))
    }

    fn mechanical_capacitance(&self, electrodes: &DeformedElectrodes, compression: f64) -> f64 {
        let depth = self.electrodes.depth;
        let gap = self.electrodes.gap;
        let surroundings = self.dielectric.surroundings;
        if let Some(table) = &self.table {
            // A made gap differs from the drawn one as their closed forms do.
            let by_closed_form = |shape| self.dielectric.uniform(shape, depth);
            let made = by_closed_form(electrodes) - by_closed_form(&table.drawn(compression));
            return self.stray_capacitance + table.capacitance(compression) + made;
        }
        let beside = match &self.solved {
            Some(solved) => solved.offset(gap, compression, depth),
            None => surroundings.offset(gap / self.electrodes.thickness, compression, depth),
        };
        self.stray_capacitance + self.dielectric.uniform(electrodes, depth) + beside
    }

    fn as_published(&self, layer: &LayerState, fit: &PublishedFit) -> DeformedElectrodes {
        self.electrodes
            .deform_as_published(&self.layer, &layer.kinematics, &fit.thinning)
    }

    fn published_change(
        &self,
        electrodes: &DeformedElectrodes,
        fit: &PublishedFit,
        compression: f64,
    ) -> f64 {
        let displacement = compression * self.layer.thickness;
        fit.fringe.change(
            self.facing_change(electrodes),
            displacement / self.electrodes.gap,
        )
    }

    fn facing_change(&self, electrodes: &DeformedElectrodes) -> f64 {
        self.dielectric.scale(self.electrodes.depth)
            * (facing_sides(&self.electrodes.at_rest()) - facing_sides(electrodes))
    }

    /// Fall of the capacitance per force at a compression, F/N: the slope of
    /// C₀ − C against the force there.
    ///
    /// # Errors
    /// [`InPlaneError::NoSensitivityAtRest`] for the published law at rest, and
    /// those of [`InPlaneModel::respond`].
    pub fn sensitivity(&self, compression: f64) -> Result<f64, InPlaneError> {
        if let (CapacitanceLaw::Published, Some(fit)) = (self.law, self.published_fit)
            && compression == 0.0
            && fit.fringe.exponent != 0.0
        {
            let exponent = fit.fringe.exponent;
            return Err(InPlaneError::NoSensitivityAtRest { exponent });
        }
        // A difference over 2e-5: its error is 1e-9 by curvature and 1e-10 by
        // rounding; at the ends of the range one-sided, 1e-5 by curvature.
        let low = (compression - 1e-5).max(0.0);
        let high = (compression + 1e-5).min(self.largest_compression());
        let (low, high) = (self.respond(low)?, self.respond(high)?);
        Ok((high.change - low.change) / (high.layer.force - low.layer.force))
    }
}
