//! Laws of incompressible rubber and their homogeneous states.

use std::fmt;

use taxel_ground::quantity::STRESS;

/// Loading of a specimen; compression is [`Mode::Uniaxial`] with stretches below one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Along one axis, the sides free.
    Uniaxial,
    /// Along two axes by the same stretch.
    Equibiaxial,
    /// Along one axis, the second one held: a wide strip.
    Planar,
}

impl Mode {
    /// All modes.
    pub const ALL: [Self; 3] = [Self::Uniaxial, Self::Equibiaxial, Self::Planar];

    /// Name, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniaxial => "uniaxial",
            Self::Equibiaxial => "equibiaxial",
            Self::Planar => "planar",
        }
    }

    /// The three principal stretches, of product one, for the stretch of the first axis.
    pub fn stretches(self, l: f64) -> [f64; 3] {
        match self {
            Self::Uniaxial => [l, 1.0 / l.sqrt(), 1.0 / l.sqrt()],
            Self::Equibiaxial => [l, l, 1.0 / (l * l)],
            Self::Planar => [l, 1.0, 1.0 / l],
        }
    }

    /// `(f, g)` of `P = 2 f (W1 + g W2)`, and `I1 - 3`.
    pub(crate) fn of_invariants(self, l: f64) -> (f64, f64, f64) {
        let squares: f64 = self.stretches(l).iter().map(|l| l * l).sum();
        let (f, g) = match self {
            Self::Uniaxial => (l - l.powi(-2), 1.0 / l),
            Self::Equibiaxial => (l - l.powi(-5), l * l),
            Self::Planar => (l - l.powi(-3), 1.0),
        };
        (f, g, squares - 3.0)
    }
}

/// A law of incompressible rubber; moduli in Pa.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// `W = mu/2 (I1 - 3)`.
    NeoHookean {
        /// Shear modulus, Pa.
        shear: f64,
    },
    /// `W = c10 (I1 - 3) + c01 (I2 - 3)`.
    MooneyRivlin {
        /// Factor of `I1 - 3`, Pa.
        c10: f64,
        /// Factor of `I2 - 3`, Pa.
        c01: f64,
    },
    /// `W = c10 x + c20 x^2 + c30 x^3` with `x = I1 - 3`.
    Yeoh {
        /// Factors, Pa.
        factors: [f64; 3],
    },
    /// `W = -mu Jm / 2 ln(1 - (I1 - 3) / Jm)`.
    Gent {
        /// Shear modulus, Pa.
        shear: f64,
        /// Limit of `I1 - 3`.
        limit: f64,
    },
    /// `W = sum mu/a (l1^a + l2^a + l3^a - 3)`.
    Ogden {
        /// Modulus (Pa) and exponent of each term.
        terms: Vec<[f64; 2]>,
    },
}

/// A law that is not written as one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{text}\" is no law: {message}")]
pub struct LawError {
    /// The text.
    pub text: String,
    /// What is wrong, and what to write.
    pub message: String,
}

/// Slopes of an energy `w(I1) + c01 I2 + sum s(l_i)` at principal stretches.
pub(crate) struct Slopes {
    /// `W_i = dW / dl_i`, Pa.
    pub(crate) first: [f64; 3],
    /// Second derivative of the part of each stretch alone, Pa.
    pub(crate) own: [f64; 3],
    /// `W11`: `W_ij` has `4 W11 l_i l_j` more.
    pub(crate) curvature: f64,
}

impl Law {
    /// Name, as files have it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::NeoHookean { .. } => "neo_hookean",
            Self::MooneyRivlin { .. } => "mooney_rivlin",
            Self::Yeoh { .. } => "yeoh",
            Self::Gent { .. } => "gent",
            Self::Ogden { .. } => "ogden",
        }
    }

    /// Shear modulus at small strain, Pa.
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::NeoHookean { shear } | Self::Gent { shear, .. } => *shear,
            Self::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
            Self::Yeoh { factors } => 2.0 * factors[0],
            Self::Ogden { terms } => terms.iter().map(|[m, a]| m * a / 2.0).sum(),
        }
    }

    /// The law in the words of law files and problem files.
    pub fn toml(&self) -> String {
        match self {
            Self::NeoHookean { shear } => {
                format!("{{ neo_hookean = {{ shear_modulus = \"{shear} Pa\" }} }}")
            }
            Self::MooneyRivlin { c10, c01 } => {
                format!("{{ mooney_rivlin = {{ c10 = \"{c10} Pa\", c01 = \"{c01} Pa\" }} }}")
            }
            Self::Yeoh { factors: [a, b, c] } => {
                format!("{{ yeoh = {{ c10 = \"{a} Pa\", c20 = \"{b} Pa\", c30 = \"{c} Pa\" }} }}")
            }
            Self::Gent { shear, limit } => {
                format!("{{ gent = {{ shear_modulus = \"{shear} Pa\", limit = {limit:?} }} }}")
            }
            Self::Ogden { terms } => {
                let term =
                    |[m, a]: &[f64; 2]| format!("{{ modulus = \"{m} Pa\", exponent = {a:?} }}");
                let terms: Vec<_> = terms.iter().map(term).collect();
                format!("{{ ogden = [{}] }}", terms.join(", "))
            }
        }
    }

    /// The same law of another stiffness: its moduli times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::NeoHookean { shear } => Self::NeoHookean {
                shear: shear * factor,
            },
            Self::MooneyRivlin { c10, c01 } => Self::MooneyRivlin {
                c10: c10 * factor,
                c01: c01 * factor,
            },
            Self::Yeoh { factors } => Self::Yeoh {
                factors: factors.map(|one| one * factor),
            },
            Self::Gent { shear, limit } => Self::Gent {
                shear: shear * factor,
                limit: *limit,
            },
            Self::Ogden { terms } => Self::Ogden {
                terms: terms.iter().map(|[m, a]| [m * factor, *a]).collect(),
            },
        }
    }

    /// Modulus of elasticity at small strain, Pa.
    pub fn youngs_modulus(&self) -> f64 {
        3.0 * self.shear_modulus()
    }

    /// `W1`, `W11` at `x = I1 - 3`, and `W2`; not a number beyond Gent's limit.
    fn invariant_slopes(&self, x: f64) -> (f64, f64, f64) {
        match self {
            Self::NeoHookean { shear } => (shear / 2.0, 0.0, 0.0),
            Self::MooneyRivlin { c10, c01 } => (*c10, 0.0, *c01),
            Self::Yeoh { factors: [a, b, c] } => {
                (a + (2.0 * b + 3.0 * c * x) * x, 2.0 * b + 6.0 * c * x, 0.0)
            }
            Self::Gent { shear, limit } => {
                let room = 1.0 - x / limit;
                if room <= 0.0 {
                    return (f64::NAN, f64::NAN, 0.0);
                }
                let first = shear / (2.0 * room);
                (first, first / (limit * room), 0.0)
            }
            Self::Ogden { .. } => (0.0, 0.0, 0.0),
        }
    }

    pub(crate) fn slopes(&self, stretches: [f64; 3]) -> Slopes {
        let x: f64 = stretches.iter().map(|l| l * l).sum::<f64>() - 3.0;
        let (w1, curvature, w2) = self.invariant_slopes(x);
        let of_terms = |l: f64, slope: bool| -> f64 {
            let Self::Ogden { terms } = self else {
                return 0.0;
            };
            let term = |[m, a]: &[f64; 2]| {
                if slope {
                    m * (a - 1.0) * l.powf(a - 2.0)
                } else {
                    m * l.powf(a - 1.0)
                }
            };
            terms.iter().map(term).sum()
        };
        Slopes {
            first: stretches.map(|l| 2.0 * (w1 * l - w2 * l.powi(-3)) + of_terms(l, false)),
            own: stretches.map(|l| 2.0 * w1 + 6.0 * w2 * l.powi(-4) + of_terms(l, true)),
            curvature,
        }
    }

    /// Force along the first axis per undeformed area, Pa, the third axis free; not a number
    /// beyond Gent's limit.
    pub fn nominal_stress(&self, mode: Mode, l: f64) -> f64 {
        if let Self::Ogden { terms } = self {
            let third = mode.stretches(l)[2];
            let term = |[m, a]: &[f64; 2]| m * (l.powf(*a) - third.powf(*a)) / l;
            return terms.iter().map(term).sum();
        }
        let (f, g, x) = mode.of_invariants(l);
        let (w1, _, w2) = self.invariant_slopes(x);
        2.0 * f * (w1 + g * w2)
    }

    /// A law in one line: `"gent 191 kPa 6.95"`, `"yeoh 92 11 -0.9 kPa"`, `"ogden 0.6 1.3
    /// 0.001 5 MPa"` (modulus and exponent in turn).
    ///
    /// # Errors
    /// [`LawError`] says how each law is written.
    pub fn parse(text: &str) -> Result<Self, LawError> {
        let wrong = |message: String| LawError {
            text: text.to_owned(),
            message,
        };
        let forms = "write neo_hookean MU, mooney_rivlin C10 C01, yeoh C10 C20 C30, gent MU LIMIT \
                     or ogden MU ALPHA ..., with the unit of the moduli, such as \"gent 191 kPa 6.95\"";
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or_default().to_owned();
        let (mut numbers, mut scale) = (Vec::new(), None);
        for word in words {
            if let Ok(number) = word.parse::<f64>() {
                numbers.push(number);
            } else if let Some(unit) = STRESS.unit(word) {
                scale = Some(unit);
            } else {
                return Err(wrong(format!(
                    "\"{word}\" is no number and no unit; {forms}"
                )));
            }
        }
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(wrong("a constant is not finite".into()));
        }
        let scale = scale.ok_or_else(|| {
            wrong(format!(
                "the unit is missing; add one of: {}",
                STRESS.symbols()
            ))
        })?;
        let law = match (name.as_str(), numbers.as_slice()) {
            ("neo_hookean", [shear]) => Self::NeoHookean {
                shear: shear * scale,
            },
            ("mooney_rivlin", [c10, c01]) => Self::MooneyRivlin {
                c10: c10 * scale,
                c01: c01 * scale,
            },
            ("yeoh", [a, b, c]) => Self::Yeoh {
                factors: [a * scale, b * scale, c * scale],
            },
            ("gent", [shear, limit]) if *limit > 0.0 => Self::Gent {
                shear: shear * scale,
                limit: *limit,
            },
            ("ogden", terms) if !terms.is_empty() && terms.len().is_multiple_of(2) => Self::Ogden {
                terms: terms.chunks(2).map(|t| [t[0] * scale, t[1]]).collect(),
            },
            _ => return Err(wrong(forms.into())),
        };
        if law.shear_modulus() > 0.0 {
            Ok(law)
        } else {
            Err(wrong(format!(
                "its shear modulus is {:.4} Pa and must be greater than 0; look at the signs",
                law.shear_modulus()
            )))
        }
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kpa = |pascal: f64| pascal / 1e3;
        match self {
            Self::NeoHookean { shear } => write!(f, "neo_hookean {:.5} kPa", kpa(*shear)),
            Self::MooneyRivlin { c10, c01 } => {
                write!(f, "mooney_rivlin {:.5} {:.5} kPa", kpa(*c10), kpa(*c01))
            }
            Self::Yeoh { factors: [a, b, c] } => {
                write!(f, "yeoh {:.5} {:.5} {:.5} kPa", kpa(*a), kpa(*b), kpa(*c))
            }
            Self::Gent { shear, limit } => write!(f, "gent {:.5} kPa {limit:.5}", kpa(*shear)),
            Self::Ogden { terms } => {
                f.write_str("ogden")?;
                for [m, a] in terms {
                    write!(f, " {:.6e} {a:.6}", kpa(*m))?;
                }
                f.write_str(" kPa")
            }
        }
    }
}
