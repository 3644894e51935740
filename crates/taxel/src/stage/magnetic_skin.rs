//! Magnets in rubber over magnetometers, as a sensor file describes them.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    CellLaw as _, Creep, ForceCell, MagnetArray, MagnetMake, Memory, OneToOne, PartError,
    PartParameter, Parts, SuspendedMagnet,
};
use crate::electronics::Electronics;
use crate::layout::{Layout, Mount};
use crate::mechanics::{ForceAxes, RelaxationTerm};
use crate::quantity::{
    self, AnyCompliance, AnyFluxDensity, AnyLength, AnyTemperatureCoefficient, AnyTiltPerForce,
    Checked, Fraction, NonNegativeLength, PositiveForce, PositiveLength, PositiveStiffness,
    SmallAngle,
};
use crate::transduction::MagnetShape;

/// One magnet in each taxel, held by rubber over magnetometers.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagneticSkin {
    /// Force along each axis up to which the suspension is linear, and end of the colour scale, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
    /// The magnet of a taxel.
    pub magnet: MagnetDescription,
    /// What a force does to it.
    pub suspension: MagnetSuspension,
    /// Magnetometers of a taxel, `[x, y]` from its middle, m; they lie in the plane z = 0, and their axes are
    /// those of the taxel.
    pub sensors: Vec<SensorPosition>,
    /// Least height of the middle of the magnet above the magnetometers, m; by default half the height
    /// of the magnet.
    #[serde(default, deserialize_with = "quantity::some::<PositiveLength, _>")]
    #[schemars(with = "Option<Checked<PositiveLength>>")]
    pub least_height: Option<f64>,
    /// Relaxing springs of the rubber beside its long-time law: it yields under a held force.
    #[serde(default)]
    pub relaxation: Vec<RelaxationTerm>,
    /// Standard deviations of what is made; none by default.
    #[serde(default)]
    pub fabrication: MagneticSkinFabrication,
}

/// Position of a magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct SensorPosition(
    /// `[x, y]` from the middle of the taxel, m.
    #[serde(deserialize_with = "quantity::list::<2, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 2]")]
    pub [f64; 2],
);

/// A magnet at rest.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagnetDescription {
    /// Its shape.
    pub shape: MagnetShape,
    /// Remanence along z, T; negative where its north pole is below.
    #[serde(deserialize_with = "quantity::one::<AnyFluxDensity, _>")]
    #[schemars(with = "Checked<AnyFluxDensity>")]
    pub remanence: f64,
    /// Position of its middle without a load, from the middle of the taxel in the plane of the
    /// magnetometers, z upwards, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub rest: [f64; 3],
    /// Relative change of the remanence per temperature, 1/K: of neodymium about -0.12 %/K; 0 by
    /// default.
    #[serde(
        default,
        deserialize_with = "quantity::one::<AnyTemperatureCoefficient, _>"
    )]
    #[schemars(with = "Checked<AnyTemperatureCoefficient>")]
    pub temperature_coefficient: f64,
}

/// What a force on the skin does to its magnet: stiffnesses with tilts, or a whole compliance.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagnetSuspension {
    /// Stiffness along x, y and z, N/m.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, PositiveStiffness, _>"
    )]
    #[schemars(with = "Option<[Checked<PositiveStiffness>; 3]>")]
    pub stiffness: Option<[f64; 3]>,
    /// Tilt under a side force along x and along y, towards which the upper side leans, rad/N; with
    /// `stiffness`, and none by default.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<2, AnyTiltPerForce, _>"
    )]
    #[schemars(with = "Option<[Checked<AnyTiltPerForce>; 2]>")]
    pub tilt_per_force: Option<[f64; 2]>,
    /// The whole compliance in the place of `stiffness`.
    #[serde(default)]
    pub compliance: Option<MagnetCompliance>,
}

/// Displacement and tilt by the forces along x and y and the pressing one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagnetCompliance {
    /// A row for x, y and z upwards, each per force along x, along y and pressing, m/N: what presses
    /// lowers the magnet, so that the last number of the last row is negative.
    pub displacement: [[Checked<AnyCompliance>; 3]; 3],
    /// A row for the rotation vector of the tilt along x and along y, rad/N.
    pub tilt: [[Checked<AnyTiltPerForce>; 3]; 2],
}

/// Standard deviations of the magnets of made skins.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MagneticSkinFabrication {
    /// Of the position of a magnet along each axis, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub position: f64,
    /// Of its tilt about x and about y, rad.
    #[serde(deserialize_with = "quantity::one::<SmallAngle, _>")]
    #[schemars(with = "Checked<SmallAngle>")]
    pub tilt: f64,
    /// Of its remanence, over it.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub remanence: f64,
    /// Of the compliance under the force along each axis, over it.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub softness: f64,
}

impl MagneticSkinFabrication {
    /// The deviations by the names of the numbers that they are of, without those of zero.
    pub fn by_name(&self) -> Vec<(String, f64)> {
        let of = MagnetMake::NAMES.into_iter().zip(self.deviations());
        of.filter(|(_, deviation)| *deviation > 0.0)
            .map(|(name, deviation)| (name.to_owned(), deviation))
            .collect()
    }

    /// The deviation of each of [`MagnetMake::NAMES`].
    pub(super) fn deviations(&self) -> [f64; MagnetMake::COUNT] {
        let [p, t, r, s] = [self.position, self.tilt, self.remanence, self.softness];
        [p, p, p, t, t, r, s, s, s]
    }
}

impl MagnetSuspension {
    /// Displacement along x, y and z upwards and tilt, each per force along x, y and pressing.
    fn matrix(&self) -> [[f64; 3]; 5] {
        if let Some(whole) = &self.compliance {
            let [x, y, z] = whole.displacement.map(|row| row.map(|value| value.0));
            let [tilt_x, tilt_y] = whole.tilt.map(|row| row.map(|value| value.0));
            return [x, y, z, tilt_x, tilt_y];
        }
        let [x, y, z] = self.stiffness.unwrap_or([f64::INFINITY; 3]);
        let [lean_x, lean_y] = self.tilt_per_force.unwrap_or_default();
        [
            [1.0 / x, 0.0, 0.0],
            [0.0, 1.0 / y, 0.0],
            [0.0, 0.0, -1.0 / z],
            [0.0, -lean_y, 0.0],
            [lean_x, 0.0, 0.0],
        ]
    }

    /// Each force moves the magnet by this much more.
    fn soften(&mut self, softness: [f64; 3]) {
        for (axis, factor) in softness.into_iter().enumerate() {
            if let Some(stiffness) = &mut self.stiffness {
                stiffness[axis] /= factor;
            }
            if let Some(tilt) = self
                .tilt_per_force
                .as_mut()
                .and_then(|tilts| tilts.get_mut(axis))
            {
                *tilt *= factor;
            }
            if let Some(whole) = &mut self.compliance {
                whole
                    .displacement
                    .iter_mut()
                    .for_each(|row| row[axis].0 *= factor);
                whole.tilt.iter_mut().for_each(|row| row[axis].0 *= factor);
            }
        }
    }

    fn check(&self) -> Result<(), PartError> {
        let wrong = |message: &str, help: &str| PartError {
            key: "suspension".into(),
            message: message.into(),
            help: help.into(),
        };
        match (&self.stiffness, &self.compliance) {
            (Some(_), Some(_)) => Err(wrong(
                "stiffness and compliance say the same twice",
                "give one of them",
            )),
            (None, None) => Err(wrong(
                "nothing says how far a force moves the magnet",
                "give stiffness along x, y and z, or a compliance",
            )),
            (None, Some(_)) if self.tilt_per_force.is_some() => Err(wrong(
                "a compliance has the tilts already",
                "leave tilt_per_force out",
            )),
            _ => Ok(()),
        }
    }
}

impl MagneticSkin {
    /// The chain of the magnets on `layout` and what reads them.
    pub fn parts(&self, layout: &Layout, electronics: &Electronics) -> Parts {
        let network = electronics.magnetometer().map(|chip| {
            let magnet = self.suspended();
            let problem = self
                .suspension
                .check()
                .and_then(|()| self.check(matches!(layout.mount, Mount::Flat)));
            MagnetArray {
                magnets: vec![magnet; layout.taxels()],
                places: (0..layout.taxels())
                    .map(|at| layout.flat_position(at))
                    .collect(),
                sensors: self.sensors.iter().map(|sensor| sensor.0).collect(),
                least_height: self.least_height(),
                full_scale: self.full_scale,
                noise: chip.instrument().deviations(),
                offset: chip.offset,
                uniform_field: chip.uniform_field,
                warming: self.magnet.temperature_coefficient * chip.temperature,
                fabrication: self.fabrication.deviations(),
                rest: None,
                problem: problem.err(),
            }
        });
        Parts {
            axes: ForceAxes::Xyz,
            memory: Creep::new(&self.relaxation).map(|creep| Box::new(creep) as Box<dyn Memory>),
            // Forces that are read one by one are refused by the board: no chip gives them.
            network: network.map_or_else(|| Box::new(OneToOne) as _, |array| Box::new(array) as _),
            ..Parts::of_cell(ForceCell::Found.boxed(), self.full_scale)
        }
    }

    fn suspended(&self) -> SuspendedMagnet {
        SuspendedMagnet {
            shape: self.magnet.shape,
            remanence: self.magnet.remanence,
            rest: self.magnet.rest,
            tilt: [0.0; 2],
            compliance: self.suspension.matrix(),
            softness: [1.0; 3],
        }
    }

    /// Shows each number of the magnet to `each`, which may change it; a tilt at rest has no key, and
    /// stays.
    pub fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let mut magnet = self.suspended();
        magnet.shown(each);
        (self.magnet.rest, self.magnet.remanence) = (magnet.rest, magnet.remanence);
        self.suspension.soften(magnet.softness);
    }

    fn least_height(&self) -> f64 {
        let [_, height] = self.magnet.shape.outline();
        self.least_height.unwrap_or(0.5 * height)
    }

    fn check(&self, flat: bool) -> Result<(), PartError> {
        let wrong = |key: &str, message: String, help: &str| {
            Err(PartError {
                key: key.into(),
                message,
                help: help.into(),
            })
        };
        if self.sensors.is_empty() {
            return wrong(
                "sensors",
                "there is no magnetometer".into(),
                "give the positions of the chips, such as [[\"2 mm\", \"2 mm\"], …]",
            );
        }
        if self.magnet.remanence == 0.0 {
            return wrong(
                "magnet.remanence",
                "a magnet without remanence has no field".into(),
                "give that of its grade: of N35 1.17 T, of N52 1.45 T",
            );
        }
        let [rest, least] = [self.magnet.rest[2], self.least_height()].map(|h| 1e3 * h);
        if rest <= least {
            return wrong(
                "magnet.rest",
                format!(
                    "the middle of the magnet is at {rest} mm, and its least height is {least} mm"
                ),
                "give a height above it",
            );
        }
        if !flat {
            return wrong(
                "magnet",
                "the fields of magnets on a bent array are not computed".into(),
                "give mount = \"flat\"",
            );
        }
        Ok(())
    }
}
