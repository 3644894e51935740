//! Equations that determine the parameters: they border those of the body.

use taxel_numerics::dense::dot;

use super::newton::Solver;
use crate::assembly::state::State;
use crate::assembly::system::Assembled;
use crate::assembly::unsymmetric::Slot;
use crate::problem::{Quantity, Rule};

/// Derivative of an equation by the unknowns.
pub(super) enum Slope {
    Dense(Vec<f64>),
    /// By the numbers of the unknowns.
    Sparse(Vec<(usize, f64)>),
    None,
}

impl Slope {
    /// Change of the equation along a change of the unknowns.
    pub(super) fn along(&self, change: &[f64]) -> f64 {
        match self {
            Self::Dense(slope) => dot(slope, change),
            Self::Sparse(slope) => slope.iter().map(|&(k, factor)| factor * change[k]).sum(),
            Self::None => 0.0,
        }
    }
}

/// The equation of a parameter: its value and its derivatives.
pub(super) struct Equation {
    pub(super) value: f64,
    pub(super) slope: Slope,
    pub(super) by_parameters: Vec<f64>,
}

fn unit(size: usize, k: usize) -> Vec<f64> {
    let mut v = vec![0.0; size];
    v[k] = 1.0;
    v
}

impl Solver {
    /// The equation of a free parameter with its derivatives.
    pub(super) fn equation(
        &self,
        k: usize,
        rule: &Rule,
        trial: &State,
        assembled: &Assembled,
        target: f64,
    ) -> Equation {
        let parameters = trial.parameters.len();
        match rule {
            Rule::Given => Equation {
                value: trial.parameters[k] - target,
                slope: Slope::None,
                by_parameters: unit(parameters, k),
            },
            Rule::Follows(cavity, law) => {
                let (pressure, slope) = law.pressure(assembled.volumes[*cavity]);
                let mut by_parameters = unit(parameters, k);
                for (by, volume) in by_parameters
                    .iter_mut()
                    .zip(&assembled.volume_by_parameters[*cavity])
                {
                    *by -= slope * volume;
                }
                Equation {
                    value: trial.parameters[k] - pressure,
                    slope: Slope::Dense(
                        assembled.volume_slopes[*cavity]
                            .iter()
                            .map(|v| -slope * v)
                            .collect(),
                    ),
                    by_parameters,
                }
            }
            Rule::Prescribes(quantity) => {
                let (value, slope, by_parameters) = self.quantity(quantity, k, trial, assembled);
                Equation {
                    value: value - target,
                    slope,
                    by_parameters,
                }
            }
        }
    }

    pub(super) fn quantity(
        &self,
        quantity: &Quantity,
        k: usize,
        trial: &State,
        assembled: &Assembled,
    ) -> (f64, Slope, Vec<f64>) {
        let none = vec![0.0; trial.parameters.len()];
        match quantity {
            Quantity::Volume(cavity) => (
                assembled.volumes[*cavity],
                Slope::Dense(assembled.volume_slopes[*cavity].clone()),
                assembled.volume_by_parameters[*cavity].clone(),
            ),
            Quantity::Displacement(node, component) => {
                let mut by_parameters = none;
                let mut slope = Vec::new();
                for (slot, factor) in self.system.slots(*node, *component) {
                    match slot {
                        Slot::Unknown(number) => slope.push((number, factor)),
                        Slot::Parameter(number) => by_parameters[number] += factor,
                    }
                }
                let value = trial.displacement[*node as usize][*component];
                (value, Slope::Sparse(slope), by_parameters)
            }
            Quantity::Force(parameter) => {
                let mut slope = assembled.couplings[parameter.0].clone();
                for &(number, change) in &assembled.force_slopes[parameter.0] {
                    slope[number] += change;
                }
                (
                    assembled.along[parameter.0],
                    Slope::Dense(slope),
                    assembled.cross[parameter.0].clone(),
                )
            }
            Quantity::Arc(scale) => self.arc(k, *scale, trial),
        }
    }

    /// Length along the path, signed by the direction of the last step.
    fn arc(&self, k: usize, scale: f64, trial: &State) -> (f64, Slope, Vec<f64>) {
        let now = self.system.unknown_part(&self.state.displacement);
        let new = self.system.unknown_part(&trial.displacement);
        let difference: Vec<f64> = new.iter().zip(&now).map(|(a, b)| a - b).collect();
        let travelled = scale * (trial.parameters[k] - self.state.parameters[k]);
        let length = (dot(&difference, &difference) + travelled * travelled).sqrt();
        let base = self.targets[k];
        let mut by_parameters = vec![0.0; trial.parameters.len()];
        if length == 0.0 {
            // Off from rest: along the parameter.
            by_parameters[k] = scale;
            return (base, Slope::None, by_parameters);
        }
        by_parameters[k] = scale * travelled / length;
        let slope = difference.iter().map(|d| d / length).collect();
        (base + length, Slope::Dense(slope), by_parameters)
    }
}
