//! A piezoelectric plate under a soft cover (P3): motion or force to charge
//! and voltage.

use taxel_numerics::linear_chain::Transfer;

/// One piezoelectric plate on a rigid base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiezoelectricElement {
    /// Stiffness k_p = E_p A/t_p, N/m.
    pub stiffness: f64,
    /// Mass m_p = ρ_p A t_p, kg.
    pub mass: f64,
    /// Damping b_p = 2ζ_p√(k_p m_p), N s/m.
    pub damping: f64,
    /// Charge per force d₃₃, C/N.
    pub charge_per_force: f64,
    /// Capacitance of element, cable and input C, F.
    pub capacitance: f64,
    /// Leak resistance parallel to it R, Ω.
    pub leak_resistance: f64,
}

/// The plate as a drawing gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ceramic {
    /// Area A, m².
    pub area: f64,
    /// Thickness t_p, m.
    pub thickness: f64,
    /// Modulus of elasticity E_p, Pa.
    pub modulus: f64,
    /// Density ρ_p, kg/m³.
    pub density: f64,
    /// Damping ratio of the plate alone ζ_p.
    pub damping_ratio: f64,
}

/// The column of silicone through which an element is driven: a spring and a
/// dashpot side by side (Kelvin-Voigt).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiliconePath {
    /// Stiffness k_s, N/m; above zero.
    pub stiffness: f64,
    /// Damping b_s, N s/m; zero or more.
    pub damping: f64,
}

impl SiliconePath {
    /// k_s = E_e A_e/t_e and b_s = μ A_e/t_e (P3 Eq. 17): `modulus` in Pa,
    /// `viscosity` in Pa s, `area` in m², `thickness` in m.
    pub fn of_layer(modulus: f64, viscosity: f64, area: f64, thickness: f64) -> Self {
        Self {
            stiffness: modulus * area / thickness,
            damping: viscosity * area / thickness,
        }
    }
}

impl PiezoelectricElement {
    /// The element made of `ceramic`, with its electrical values in C/N, F, Ω.
    pub fn new(
        ceramic: &Ceramic,
        charge_per_force: f64,
        capacitance: f64,
        leak_resistance: f64,
    ) -> Self {
        let stiffness = ceramic.modulus * ceramic.area / ceramic.thickness;
        let mass = ceramic.density * ceramic.area * ceramic.thickness;
        Self {
            stiffness,
            mass,
            damping: 2.0 * ceramic.damping_ratio * (stiffness * mass).sqrt(),
            charge_per_force,
            capacitance,
            leak_resistance,
        }
    }

    /// K = d₃₃ k_p, charge per compression of the plate, C/m (P3 Eqs. 2, 3).
    pub fn charge_per_compression(&self) -> f64 {
        self.charge_per_force * self.stiffness
    }

    /// τ = R C, s (P3 Eq. 8).
    pub fn time_constant(&self) -> f64 {
        self.leak_resistance * self.capacitance
    }

    /// ω_n = √((k_p + k_s)/m_p), 1/s.
    pub fn natural_frequency(&self, path: SiliconePath) -> f64 {
        ((self.stiffness + path.stiffness) / self.mass).sqrt()
    }

    /// ζ = (b_p + b_s)/(2√((k_p + k_s) m_p)).
    pub fn damping_ratio(&self, path: SiliconePath) -> f64 {
        let stiffness = self.stiffness + path.stiffness;
        (self.damping + path.damping) / (2.0 * (stiffness * self.mass).sqrt())
    }

    /// Compression of the plate per displacement of the surface, without unit:
    /// G₂ = X₂/X₁ = (b_s s + k_s)/(m_p s² + (b_p + b_s)s + k_p + k_s).
    ///
    /// Corrects P3 Eqs. 12-15, which count the force of the silicone twice.
    /// Holds while the surface moves as one piece over the element.
    pub fn compression_per_displacement(&self, path: SiliconePath) -> Transfer {
        Transfer::second_order(
            [path.stiffness, path.damping],
            [
                self.stiffness + path.stiffness,
                self.damping + path.damping,
                self.mass,
            ],
        )
    }

    /// Voltage per compression, V/m: G₁ = V₁/X₂ = (K/C) τs/(1 + τs) (P3 Eq. 8).
    pub fn voltage_per_compression(&self) -> Transfer {
        let gain = self.charge_per_compression() / self.capacitance;
        Transfer::high_pass(gain, self.time_constant())
    }

    /// Open voltage per displacement of the surface, V/m: V₁/X₁ = G₁ G₂
    /// (P3 Eq. 16).
    pub fn voltage_per_displacement(&self, path: SiliconePath) -> Transfer {
        self.compression_per_displacement(path)
            .then(&self.voltage_per_compression())
    }

    /// Charge per displacement of the surface, C/m: K G₂.
    pub fn charge_per_displacement(&self, path: SiliconePath) -> Transfer {
        self.compression_per_displacement(path)
            .then(&Transfer::constant(self.charge_per_compression()))
    }

    /// Open voltage per force on the element, V/N: (d₃₃/C) τs/(1 + τs). The
    /// thickness of the silicone is not in it. Holds below the resonance, some
    /// MHz, where the mass does not matter.
    pub fn voltage_per_force(&self) -> Transfer {
        let gain = self.charge_per_force / self.capacitance;
        Transfer::high_pass(gain, self.time_constant())
    }
}

/// Constants of the two-dimensional law of a plate poled along z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiezoelectricLaw {
    /// Stiffnesses c₁₁, c₁₃, c₃₃ at constant field, Pa.
    pub stiffness: [f64; 3],
    /// Piezoelectric constants e₃₁, e₃₃, C/m².
    pub piezoelectric: [f64; 2],
    /// Permittivity ε₃₃ at constant strain, F/m.
    pub permittivity: f64,
}

/// Stresses and electric displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiezoelectricState {
    /// Stress along y, Pa.
    pub stress_y: f64,
    /// Stress along z, Pa.
    pub stress_z: f64,
    /// Electric displacement along z, C/m².
    pub electric_displacement: f64,
}

impl PiezoelectricLaw {
    /// Stresses and displacement for the strains ε_y, ε_z and the field E_z in V/m.
    ///
    /// σ_y = c₁₁ε_y + c₁₃ε_z − e₃₁E_z; σ_z = c₁₃ε_y + c₃₃ε_z − e₃₃E_z;
    /// D_z = e₃₁ε_y + e₃₃ε_z + ε₃₃E_z (P3 Eqs. 9-11, with the sign of the last
    /// term and the name e₃₁ corrected).
    pub fn respond(&self, strain_y: f64, strain_z: f64, field: f64) -> PiezoelectricState {
        let [c11, c13, c33] = self.stiffness;
        let [e31, e33] = self.piezoelectric;
        PiezoelectricState {
            stress_y: c11 * strain_y + c13 * strain_z - e31 * field,
            stress_z: c13 * strain_y + c33 * strain_z - e33 * field,
            electric_displacement: e31 * strain_y + e33 * strain_z + self.permittivity * field,
        }
    }
}
