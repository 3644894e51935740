//! Answers as JSON, in SI with the unit in each key: the same for the command and for Python.

use serde_json::{Map, Value, json};

use crate::choose::Choice;
use crate::hardness::{Hardness, Scale};
use crate::material::{Material, Relaxation};
use crate::relaxation::{RelaxationFit, creep};

impl Choice {
    /// The laws with what is wrong with them, which is chosen, its interval, the shares of the second
    /// invariant that fit as well.
    pub fn json(&self) -> Map<String, Value> {
        let candidates: Vec<Value> = self
            .candidates
            .iter()
            .map(|candidate| {
                let fit = &candidate.fit;
                json!({
                    "law": candidate.law.to_string(),
                    "moduli_pa": fit.moduli,
                    "limit": fit.limit,
                    "exponents": fit.exponents,
                    "shear_modulus_pa": fit.shear_modulus,
                    "interval_pa": fit.interval,
                    "standard_errors": fit.standard_errors,
                    "slack": fit.slack,
                    "modulus_with_slack_pa": fit.modulus_with_slack,
                    "preload_stretch": fit.preload_stretch,
                    "rms": fit.rms(),
                    "aicc": fit.aicc(),
                    "effective_points": fit.effective,
                    "refused": candidate.refused,
                })
            })
            .collect();
        let shares: Vec<Value> = self
            .shares
            .iter()
            .map(|share| {
                json!({
                    "share": share[0],
                    "shear_modulus_pa": share[1],
                    "limit": share[2],
                    "rms": share[3],
                    "uniaxial_0_6_pa": share[4],
                    "planar_0_6_pa": share[5],
                })
            })
            .collect();
        let failed: Vec<String> = self.failed.iter().map(|(_, why)| why.to_string()).collect();
        [
            ("candidates", Value::from(candidates)),
            ("failed", failed.into()),
            ("chosen", self.index.into()),
            ("interval_pa", json!(self.interval)),
            ("second_invariant", shares.into()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into_iter()
        .collect()
    }
}

impl Material {
    /// Law, moduli, interval, what was tested, source.
    pub fn json(&self) -> Value {
        let modes: Vec<&str> = self.modes.iter().map(|mode| mode.name()).collect();
        json!({
            "name": self.name,
            "law": self.law.to_string(),
            "shear_modulus_pa": self.law.shear_modulus(),
            "youngs_modulus_pa": self.law.youngs_modulus(),
            "shear_modulus_interval_pa": self.interval,
            "basis": self.basis,
            "stretch": self.stretch,
            "modes": modes,
            "source": self.source,
            "note": self.note,
            "relaxation": terms(&self.relaxation),
        })
    }
}

impl Hardness {
    /// Modulus with its interval where the relation holds, and the printed formulas.
    pub fn json(&self) -> Value {
        let modulus = self.modulus();
        json!({
            "youngs_modulus_pa": modulus.within.then_some(modulus.value),
            "interval_pa": modulus.within.then_some(modulus.interval),
            "formula_pa": self.formula(),
            "logarithmic_formula_pa": (self.scale == Scale::A).then(|| self.logarithmic()),
            "range_shore": modulus.range,
            "within_range": modulus.within,
        })
    }
}

impl RelaxationFit {
    /// The terms, what a sudden load gives and what is left, and the creep that belongs to them.
    pub fn json(&self) -> Value {
        let (long, creep) = creep(&self.terms);
        json!({
            "terms": terms(&self.terms),
            "sudden": self.sudden,
            "long_time": self.long,
            "rms": self.rms,
            "aicc": self.criteria,
            "creep": { "long_over_sudden": long, "terms": terms(&creep) },
        })
    }
}

fn terms(terms: &[Relaxation]) -> Vec<Value> {
    let term = |term: &Relaxation| json!({ "fraction": term.fraction, "time_s": term.time });
    terms.iter().map(term).collect()
}
