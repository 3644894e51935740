//! One cell: residual and tangent of the displacement with the pressure eliminated.
//!
//! The unknowns of a cell are the displacement of its nodes and a pressure
//! `p = sum p_m psi_m`, linear in the reference place and not continuous to its
//! neighbours. Stationarity of `W(F) + p (J - 1) - U*(p)` gives
//!
//! ```text
//! Ru = int (tau + p J 1) . grad N            Kuu du + Kup dp = -Ru
//! Rp = int psi (J - J(p)),  J(p) = dU*/dp + 1      Kup' du - D dp = -Rp
//! ```
//!
//! and `dp = D^-1 (Rp + Kup' du)` leaves a symmetric system in `du` alone. Where the
//! solid keeps its volume `D` is zero; the elimination then takes the `D` of a very
//! stiff solid, while the residual stays that of the exact constraint: the iteration
//! ends at `J = 1`, one or two steps later.

mod factored;
mod passes;

use std::cmp::Ordering;

use factored::Factored;
use passes::ROWS;
use pulp::{Simd, WithSimd};

use crate::material::Material;
use crate::mesh::{CellShape, QuadraturePoint};
use crate::problem::Kinematics;
use crate::scalar::{Lanes, PLACE, Scalar, Symmetric, Tensor, determinant, inverse};

/// Greatest bulk over shear modulus of a solid that is taken as it is.
const COMPRESSIBLE: f64 = 1e8;

/// Slope of the volume ratio by the pressure (1/Pa) that the elimination takes: that of the solid,
/// or that of a very stiff one where the solid keeps its volume.
#[inline(always)]
pub(super) fn eliminated(slope: f64, shear: f64, elimination: f64) -> f64 {
    if slope * shear * COMPRESSIBLE >= 1.0 {
        slope
    } else {
        slope.max(1.0 / (elimination * shear))
    }
}

/// Usual bulk over shear modulus of the elimination where the solid keeps its volume.
pub const ELIMINATION_RATIO: f64 = 1e5;
/// Most pressure functions of a cell.
pub const MAX_PRESSURES: usize = 4;
/// Most nodes of a cell.
pub const MAX_NODES: usize = 27;

/// Stress carried over from the past of a solid with memory.
#[derive(Clone, Copy, Debug)]
pub struct Memory<'a> {
    /// Factor of the present isochoric stress and tangent.
    pub factor: f64,
    /// Second Piola-Kirchhoff stress carried, per quadrature point, Pa.
    pub carried: &'a [Symmetric<f64>],
}

/// Input of the kernel for a cell.
#[derive(Clone, Copy, Debug)]
pub struct CellInput<'a> {
    /// Reference places of the nodes.
    pub reference: &'a [[f64; 3]],
    /// Displacements of the nodes.
    pub displacement: &'a [[f64; 3]],
    /// Pressure unknowns (mean stress, tension positive), Pa.
    pub pressure: [f64; MAX_PRESSURES],
    /// The solid.
    pub material: &'a Material,
    /// Its past.
    pub memory: Option<Memory<'a>>,
    /// Bulk over shear modulus of the elimination where the solid keeps its volume.
    pub elimination: f64,
}

/// Points of integration of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Points {
    /// As many as its stiffness needs.
    Usual,
    /// More, with its corners.
    Closed,
    /// Many, with its corners.
    Finest,
}

impl Points {
    /// The next finer ones.
    #[must_use]
    pub fn finer(self) -> Self {
        match self {
            Self::Usual => Self::Closed,
            Self::Closed | Self::Finest => Self::Finest,
        }
    }
}

/// The cell turned inside out at a quadrature point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inverted {
    /// Volume ratio, or determinant of the undeformed map where that is not positive.
    pub volume_ratio: f64,
    /// Number of the quadrature point.
    pub point: usize,
    /// True when the undeformed cell is already inside out.
    pub undeformed: bool,
}

/// Tables and work space for one shape of cell. Nodes stand in columns of as many as
/// a wide register holds; what belongs to a column is kept together.
pub struct Kernel {
    shape: CellShape,
    rule: Points,
    kinematics: Kinematics,
    points: usize,
    nodes: usize,
    /// Columns of nodes.
    columns: usize,
    // At several points at once: group of points, node, direction.
    values: Vec<Lanes>,
    slopes: Vec<Lanes>,
    weights: Vec<Lanes>,
    // For several nodes at once: column, point, direction.
    column_values: Vec<Lanes>,
    column_slopes: Vec<Lanes>,
    // The last evaluation, by groups of points.
    states: Vec<PointStates>,
    moduli: Vec<Moduli>,
    // By column, point, direction.
    gradients: Vec<Lanes>,
    product: Vec<Lanes>,
    // By component, column, pressure function.
    force: Vec<Lanes>,
    coupling: Vec<Lanes>,
    recovery: Vec<Lanes>,
    /// By block, row and column.
    blocks: Vec<f64>,
    /// In place of these where functions and points are products over directions.
    factored: Option<Factored>,
    /// The tangent is that of the displacement with the pressure eliminated; without, that of
    /// fixed pressures.
    pub(crate) condensed: bool,
    /// `D`, and its inverse.
    pub(crate) compliance: [[f64; MAX_PRESSURES]; MAX_PRESSURES],
    pub(crate) stiffness: [[f64; MAX_PRESSURES]; MAX_PRESSURES],
    /// Slope of the volume ratio by the pressure times the shear modulus, at one of the points.
    pub(crate) softness: f64,
    /// Elimination: `D^-1 Rp`.
    pub pressure_shift: [f64; MAX_PRESSURES],
    /// Energy of shape change, J (or J/m).
    pub energy: f64,
    /// Energy that the rounding of the last evaluation is worth, J (or J/m).
    pub rounding: f64,
}

/// States of points for the passes over nodes.
#[derive(Clone, Copy)]
struct PointStates {
    /// `H^-1`, H the gradient of the present place in the reference cell.
    back: Tensor<Lanes>,
    /// Kirchhoff stress times volume.
    stress: Symmetric<Lanes>,
    /// Volume ratio times volume times pressure function.
    volume: [Lanes; MAX_PRESSURES],
}

/// Moduli of some points: block of components, nine pairs of directions.
type Moduli = [[Lanes; 9]; 6];

const ZERO: Lanes = Lanes([0.0; Lanes::COUNT]);

impl Kernel {
    /// Tables for a shape of cell with these points of integration.
    pub fn new(shape: CellShape, kinematics: Kinematics, rule: Points) -> Self {
        let quadrature = match rule {
            Points::Usual => shape.quadrature(),
            Points::Closed => shape.closed_quadrature(false),
            Points::Finest => shape.closed_quadrature(true),
        };
        let (nodes, points) = (shape.node_count(), quadrature.len());
        let columns = nodes.div_ceil(Lanes::COUNT);
        let groups = points.div_ceil(Lanes::COUNT);
        let depth = points * kinematics.directions();
        let components = kinematics.components();
        let states = PointStates {
            back: [[ZERO; 3]; 3],
            stress: [ZERO; 6],
            volume: [ZERO; MAX_PRESSURES],
        };
        let mut kernel = Self {
            shape,
            rule,
            kinematics,
            points,
            nodes,
            columns,
            values: vec![ZERO; groups * nodes],
            slopes: vec![ZERO; groups * nodes * shape.dimension()],
            weights: vec![ZERO; groups],
            column_values: vec![ZERO; columns * points],
            column_slopes: vec![ZERO; columns * points * shape.dimension()],
            states: vec![states; groups],
            moduli: vec![[[ZERO; 9]; 6]; groups],
            gradients: vec![ZERO; columns * depth],
            product: vec![ZERO; columns * depth],
            force: vec![ZERO; components * columns],
            coupling: vec![ZERO; components * columns * MAX_PRESSURES],
            recovery: vec![ZERO; components * columns * MAX_PRESSURES],
            factored: (shape == CellShape::Hex27 && rule == Points::Usual).then(Factored::new),
            blocks: vec![0.0; 6 * nodes.next_multiple_of(ROWS) * columns * Lanes::COUNT],
            condensed: true,
            compliance: [[0.0; MAX_PRESSURES]; MAX_PRESSURES],
            stiffness: [[0.0; MAX_PRESSURES]; MAX_PRESSURES],
            softness: 0.0,
            pressure_shift: [0.0; MAX_PRESSURES],
            energy: 0.0,
            rounding: 0.0,
        };
        kernel.tabulate(&quadrature);
        kernel
    }

    /// Shape functions and their slopes at the quadrature points.
    fn tabulate(&mut self, quadrature: &[QuadraturePoint]) {
        let (nodes, dimension) = (self.nodes, self.shape.dimension());
        for lane in 0..self.weights.len() * Lanes::COUNT {
            // Idle lanes repeat the first point with no weight.
            let idle = lane >= self.points;
            let point = quadrature[if idle { 0 } else { lane }];
            let shapes = self.shape.shapes(point.at);
            let (group, at) = (lane / Lanes::COUNT, lane % Lanes::COUNT);
            self.weights[group].0[at] = if idle { 0.0 } else { point.weight };
            for node in 0..nodes {
                self.values[group * nodes + node].0[at] = shapes.values[node];
                for d in 0..dimension {
                    self.slopes[(group * nodes + node) * dimension + d].0[at] =
                        shapes.gradients[node][d];
                }
                if idle {
                    continue;
                }
                let (column, place) = (node / Lanes::COUNT, node % Lanes::COUNT);
                let row = column * self.points + lane;
                self.column_values[row].0[place] = shapes.values[node];
                for d in 0..dimension {
                    self.column_slopes[row * dimension + d].0[place] = shapes.gradients[node][d];
                }
            }
        }
    }

    /// True for cells of this shape with these points.
    pub fn is_of(&self, shape: CellShape, rule: Points) -> bool {
        (self.shape, self.rule) == (shape, rule)
    }

    /// Points of integration.
    pub fn rule(&self) -> Points {
        self.rule
    }

    /// Nodal force of the last cell with the pressure eliminated: component, node.
    #[inline(always)]
    pub fn force(&self, component: usize, node: usize) -> f64 {
        self.force[component * self.columns + node / Lanes::COUNT].0[node % Lanes::COUNT]
    }

    /// Entry of the tangent of the last cell between two displacements.
    #[inline(always)]
    pub fn tangent(&self, i: usize, a: usize, j: usize, b: usize) -> f64 {
        if let Some(factored) = &self.factored {
            return entries(factored.pairs(), self.nodes, a, b)[i][j];
        }
        let (block, row, column) = match i.cmp(&j) {
            Ordering::Less => (BLOCK[i][j], a, b),
            // Of the symmetric blocks the upper part is there.
            Ordering::Equal => (BLOCK[i][i], a.min(b), a.max(b)),
            Ordering::Greater => (BLOCK[j][i], b, a),
        };
        self.blocks[self.row(block, row) + column]
    }

    /// The same with the pressure eliminated, whatever was asked for.
    #[inline(always)]
    pub(crate) fn condensed_tangent(&self, i: usize, a: usize, j: usize, b: usize) -> f64 {
        let own = self.tangent(i, a, j, b);
        if self.condensed {
            return own;
        }
        let part = |of: &[Lanes], i: usize, a: usize, m: usize| {
            let at = (i * self.columns + a / Lanes::COUNT) * MAX_PRESSURES + m;
            of[at].0[a % Lanes::COUNT]
        };
        (0..MAX_PRESSURES).fold(own, |sum, m| {
            sum + part(&self.coupling, i, a, m) * part(&self.recovery, j, b, m)
        })
    }

    /// The tangent of the last cell node by node.
    pub fn node_blocks(&self) -> NodeBlocks<'_> {
        let size = self.row(1, 0);
        let (width, blocks) = (self.columns * Lanes::COUNT, &self.blocks);
        if let Some(factored) = &self.factored {
            return NodeBlocks::Pairs(factored.pairs(), self.nodes);
        }
        NodeBlocks::Parts(
            std::array::from_fn(|block| &blocks[block * size..][..size]),
            width,
        )
    }

    /// Begin of a row of a block.
    #[inline(always)]
    fn row(&self, block: usize, row: usize) -> usize {
        let width = self.columns * Lanes::COUNT;
        (block * self.nodes.next_multiple_of(ROWS) + row) * width
    }

    /// Pressures by displacements, `D^-1 Kup'`: by component, then group of nodes, then
    /// pressure function.
    pub fn recovery(&self) -> &[Lanes] {
        &self.recovery
    }

    /// Change of the force on a node with the pressures, `Kup`: in the same order.
    pub(crate) fn coupling(&self) -> &[Lanes] {
        &self.coupling
    }

    /// Evaluates residual and, on request, tangent of a cell.
    ///
    /// # Errors
    /// When the cell is inside out at a quadrature point.
    pub fn evaluate(&mut self, input: &CellInput<'_>, tangent: bool) -> Result<(), Inverted> {
        pulp::Arch::new().dispatch(Evaluation {
            kernel: self,
            input,
            tangent,
        })
    }
}

/// The tangent of a cell node by node.
pub enum NodeBlocks<'k> {
    /// By block of components, with the width of their rows.
    Parts([&'k [f64]; 6], usize),
    /// By pair of nodes, with their number.
    Pairs(&'k [Lanes], usize),
}

impl NodeBlocks<'_> {
    /// Entries between the components of node `a` and those of node `b`.
    #[inline(always)]
    pub fn between(&self, a: usize, b: usize) -> Tensor<f64> {
        let ([xx, xy, xz, yy, yz, zz], width) = match self {
            Self::Parts(parts, width) => (parts, width),
            Self::Pairs(pairs, nodes) => return entries(pairs, *nodes, a, b),
        };
        let (one, other) = (a * width + b, b * width + a);
        let upper = if a <= b { one } else { other };
        [
            [xx[upper], xy[one], xz[one]],
            [xy[other], yy[upper], yz[one]],
            [xz[other], yz[other], zz[upper]],
        ]
    }
}

/// Entries between two nodes, of pairs of nodes with their blocks of components.
#[inline(always)]
fn entries(pairs: &[Lanes], nodes: usize, a: usize, b: usize) -> Tensor<f64> {
    let (one, other) = (&pairs[a * nodes + b].0, &pairs[b * nodes + a].0);
    // Of the symmetric blocks the upper part counts.
    let upper = if a <= b { one } else { other };
    [
        [upper[0], one[1], one[2]],
        [other[1], upper[3], one[4]],
        [other[2], other[4], upper[5]],
    ]
}

/// Number of the block of components `i <= j`.
const BLOCK: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

struct Evaluation<'k, 'i> {
    kernel: &'k mut Kernel,
    input: &'k CellInput<'i>,
    tangent: bool,
}

impl WithSimd for Evaluation<'_, '_> {
    type Output = Result<(), Inverted>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        // Without the tangent what only it needs is not even computed.
        let compliance = if self.tangent {
            self.kernel.points_pass::<true>(self.input)?
        } else {
            self.kernel.points_pass::<false>(self.input)?
        };
        let wide = S::F64_LANES >= Lanes::COUNT;
        match self.kernel.kinematics {
            Kinematics::PlaneStrain => self.kernel.node_passes::<2, 2>(&compliance),
            Kinematics::Axisymmetric => self.kernel.node_passes::<2, 3>(&compliance),
            Kinematics::Solid => self.kernel.node_passes::<3, 3>(&compliance),
        }
        if self.tangent && !self.kernel.factored_pass() {
            match self.kernel.kinematics.directions() {
                2 => self.kernel.tangent_pass::<2>(wide),
                _ => self.kernel.tangent_pass::<3>(wide),
            }
        }
        Ok(())
    }
}

impl Kernel {
    /// The tangent direction by direction; false where that is not possible.
    #[inline(always)]
    fn factored_pass(&mut self) -> bool {
        let Some(factored) = &mut self.factored else {
            return false;
        };
        factored.take_moduli(&self.states, &self.moduli);
        if self.condensed {
            factored.take_coupling(&self.coupling, &self.recovery);
        } else {
            factored.drop_coupling();
        }
        factored.multiply();
        true
    }
}

/// `D` and `Rp` of a cell, as parts of a sum.
struct Compliance {
    matrix: [[Lanes; MAX_PRESSURES]; MAX_PRESSURES],
    residual: [Lanes; MAX_PRESSURES],
}

impl Kernel {
    /// Deformation, stress and moduli at all quadrature points, several at once.
    #[inline(always)]
    fn points_pass<const TANGENT: bool>(
        &mut self,
        input: &CellInput<'_>,
    ) -> Result<Compliance, Inverted> {
        let pressures = self.kinematics.pressures();
        let mut compliance = Compliance {
            matrix: [[ZERO; MAX_PRESSURES]; MAX_PRESSURES],
            residual: [ZERO; MAX_PRESSURES],
        };
        let (mut energy, mut measure) = (ZERO, ZERO);
        let mut fineness = 0.0;
        let centre = input.reference[input.reference.len() - 1];
        let size = input.reference[..self.shape.corner_count()]
            .iter()
            .flat_map(|x| (0..3).map(move |d| (x[d] - centre[d]).abs()))
            .fold(0.0, f64::max);
        for group in 0..self.weights.len() {
            let (undeformed, place) = self.map(group, input.reference, 1.0);
            let (change, _) = self.map(group, input.displacement, 0.0);
            let volume = determinant(&undeformed);
            let mut weight = self.weights[group] * volume;
            if self.kinematics == Kinematics::Axisymmetric {
                weight = weight * Lanes::constant(std::f64::consts::TAU);
            }
            let inward = inverse(&undeformed, volume);
            // From displacements, not from places: the rounding of a small change of volume
            // is then a share of that change.
            let mut gradient = [[ZERO; 3]; 3];
            let (mut f, mut deformed) = (gradient, undeformed);
            for i in 0..3 {
                for k in 0..3 {
                    gradient[i][k] = change[i][0] * inward[0][k]
                        + change[i][1] * inward[1][k]
                        + change[i][2] * inward[2][k];
                    f[i][k] = gradient[i][k];
                    deformed[i][k] = deformed[i][k] + change[i][k];
                }
                f[i][i] = f[i][i] + Lanes::constant(1.0);
            }
            let growth = volume_growth(&gradient);
            let size_ratio = growth + Lanes::constant(1.0);
            self.check(group, volume, size_ratio)?;
            if group == 0 {
                fineness = greatest_of(&inward);
            }
            let back = inverse(&deformed, size_ratio * volume);
            let mut response = input.material.law.response(&f);
            if let Some(memory) = &input.memory {
                let carried = self.carried(group, memory);
                response = response.relaxed(&f, memory.factor, &carried);
            }
            let one = Lanes::constant(1.0);
            let functions: [Lanes; MAX_PRESSURES] = std::array::from_fn(|m| {
                if m == 0 {
                    one
                } else {
                    (place[m - 1] - Lanes::constant(centre[m - 1])) * Lanes::constant(1.0 / size)
                }
            });
            let pressure = (0..pressures).fold(Lanes::constant(0.0), |sum, m| {
                sum + functions[m] * Lanes::constant(input.pressure[m])
            });
            measure = measure + weight;
            let mut asked = Lanes::constant(0.0);
            let mut slope = Lanes::constant(0.0);
            let shear = input.material.law.shear_modulus();
            for lane in 0..Lanes::COUNT {
                let (growth, derivative) = input.material.volumetric.growth(pressure.0[lane]);
                asked.0[lane] = growth;
                slope.0[lane] = eliminated(derivative, shear, input.elimination);
            }
            self.softness = slope.0[0] * shear;
            let excess = (growth - asked) * weight;
            slope = slope * weight;
            energy = energy + response.energy * weight;
            for m in 0..pressures {
                compliance.residual[m] = compliance.residual[m] + excess * functions[m];
                for n in 0..=m {
                    compliance.matrix[m][n] =
                        compliance.matrix[m][n] + slope * functions[m] * functions[n];
                }
            }
            let hydrostatic = pressure * size_ratio;
            let mut stress = response.stress;
            for v in 0..3 {
                stress[v] = stress[v] + hydrostatic;
            }
            if TANGENT {
                self.store_moduli(group, &response.tangent, hydrostatic, &stress, weight);
            }
            let scale = size_ratio * weight;
            let state = &mut self.states[group];
            state.back = back;
            for v in 0..6 {
                state.stress[v] = stress[v] * weight;
            }
            for m in 0..MAX_PRESSURES {
                state.volume[m] = functions[m] * scale;
            }
        }
        self.energy = sum(energy);
        self.rounding = rounding(input, sum(measure), fineness);
        Ok(compliance)
    }

    /// Gradient of a place in the reference cell (third row and column by the
    /// kinematics), and the place itself. `depth` is the third diagonal entry in plane
    /// strain: one for places, zero for displacements.
    #[inline(always)]
    fn map(&self, group: usize, nodes: &[[f64; 3]], depth: f64) -> (Tensor<Lanes>, [Lanes; 3]) {
        let count = nodes.len();
        let values = &self.values[group * count..][..count];
        let (mut gradient, place) = match self.kinematics {
            Kinematics::Solid => mapped::<3>(values, &self.slopes[group * count * 3..], nodes),
            _ => mapped::<2>(values, &self.slopes[group * count * 2..], nodes),
        };
        match self.kinematics {
            Kinematics::PlaneStrain => gradient[2][2] = Lanes::constant(depth),
            Kinematics::Axisymmetric => gradient[2][2] = place[0],
            Kinematics::Solid => {}
        }
        (gradient, place)
    }

    #[inline(always)]
    fn check(&self, group: usize, volume: Lanes, ratio: Lanes) -> Result<(), Inverted> {
        for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
            let point = group * Lanes::COUNT + lane;
            let wrong = |ratio: f64| ratio.is_nan() || ratio <= 0.0;
            if wrong(volume.0[lane]) {
                return Err(Inverted {
                    volume_ratio: volume.0[lane],
                    point,
                    undeformed: true,
                });
            }
            if wrong(ratio.0[lane]) {
                return Err(Inverted {
                    volume_ratio: ratio.0[lane],
                    point,
                    undeformed: false,
                });
            }
        }
        Ok(())
    }

    /// Stress that the history carries at a group of points.
    #[inline(always)]
    fn carried(&self, group: usize, memory: &Memory<'_>) -> Symmetric<Lanes> {
        let mut carried = [ZERO; 6];
        for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
            for v in 0..6 {
                carried[v].0[lane] = memory.carried[group * Lanes::COUNT + lane][v];
            }
        }
        carried
    }

    /// Moduli between directions `k` of component `i` and `l` of component `j`:
    /// `c_ikjl + delta_ij tau_kl`, with the hoop as third direction of the radius.
    #[inline(always)]
    fn store_moduli(
        &mut self,
        group: usize,
        tangent: &[[Lanes; 6]; 6],
        hydrostatic: Lanes,
        stress: &Symmetric<Lanes>,
        weight: Lanes,
    ) {
        // p J (1 x 1 - 2 I)
        let mut modulus = *tangent;
        for v in 0..6 {
            for w in 0..6 {
                if v == w {
                    modulus[v][w] = modulus[v][w] - hydrostatic;
                } else if v < 3 && w < 3 {
                    modulus[v][w] = modulus[v][w] + hydrostatic;
                }
                modulus[v][w] = modulus[v][w] * weight;
            }
        }
        let mut turning = *stress;
        for v in 0..6 {
            turning[v] = turning[v] * weight;
        }
        let blocks = &mut self.moduli[group];
        match self.kinematics {
            Kinematics::Solid => sort_moduli::<3, 3>(&modulus, &turning, blocks),
            Kinematics::PlaneStrain => sort_moduli::<2, 2>(&modulus, &turning, blocks),
            Kinematics::Axisymmetric => sort_moduli::<2, 3>(&modulus, &turning, blocks),
        }
    }
}

/// `det(1 + h) - 1`, without the cancellation of the difference.
#[inline(always)]
fn volume_growth(h: &Tensor<Lanes>) -> Lanes {
    let minor = |i: usize, j: usize| h[i][i] * h[j][j] - h[i][j] * h[j][i];
    let trace = h[0][0] + h[1][1] + h[2][2];
    trace + (minor(0, 1) + minor(1, 2) + minor(0, 2)) + determinant(h)
}

/// Greatest entry of a tensor at the first of some points.
#[inline(always)]
fn greatest_of(tensor: &Tensor<Lanes>) -> f64 {
    let entries = tensor.iter().flatten();
    entries.fold(0.0, |most: f64, entry| most.max(entry.0[0].abs()))
}

/// Energy of what rounding does to a cell of this volume: `1/2 G V e^2` for the shape, of
/// which `e` is the rounding of a number near one, and `1/2 K V e_v^2` for the volume, of
/// which `e_v` is that of the gradient of the displacement. `fineness` is the gradient of the
/// reference in the undeformed place, 1/m.
fn rounding(input: &CellInput<'_>, volume: f64, fineness: f64) -> f64 {
    let moved = input.displacement.iter().flatten();
    let most = moved.fold(0.0, |most: f64, u| most.max(u.abs()));
    let shear = input.material.law.shear_modulus();
    let of_volume = most * fineness * f64::EPSILON;
    0.5 * volume * shear * (f64::EPSILON.powi(2) + input.elimination * of_volume * of_volume)
}

/// Gradient and place by the values and slopes of the functions of the nodes.
#[inline(always)]
fn mapped<const N: usize>(
    values: &[Lanes],
    slopes: &[Lanes],
    nodes: &[[f64; 3]],
) -> (Tensor<Lanes>, [Lanes; 3]) {
    let mut gradient = [[ZERO; 3]; 3];
    let mut place = [ZERO; 3];
    let (slopes, _) = slopes.as_chunks::<N>();
    for ((x, value), slope) in nodes.iter().zip(values).zip(slopes) {
        for i in 0..N {
            place[i] = value.times_plus(x[i], place[i]);
            for k in 0..N {
                gradient[i][k] = slope[k].times_plus(x[i], gradient[i][k]);
            }
        }
    }
    (gradient, place)
}

/// Moduli by block of `C` components and pair of `D` directions.
#[inline(always)]
fn sort_moduli<const C: usize, const D: usize>(
    modulus: &[[Lanes; 6]; 6],
    turning: &Symmetric<Lanes>,
    blocks: &mut Moduli,
) {
    for i in 0..C {
        for j in i..C {
            for k in 0..D {
                for l in 0..D {
                    // The third direction of the radius is the hoop; the axis has none.
                    let (hoop_k, hoop_l) = (C == 2 && k == 2, C == 2 && l == 2);
                    let outside = (hoop_k && i != 0) || (hoop_l && j != 0);
                    let v = if hoop_k { 2 } else { PLACE[i][k] };
                    let w = if hoop_l { 2 } else { PLACE[j][l] };
                    let mut value = modulus[v][w];
                    if i == j && hoop_k == hoop_l {
                        value = value + turning[PLACE[k][l]];
                    }
                    blocks[BLOCK[i][j]][k * 3 + l] = if outside { ZERO } else { value };
                }
            }
        }
    }
}

#[inline(always)]
fn sum(lanes: Lanes) -> f64 {
    let a = lanes.0;
    ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7]))
}

/// A small positive definite matrix given by its lower triangle, each entry as parts of a sum,
/// and its inverse.
#[inline(always)]
fn small_and_inverse(
    lower: &[[Lanes; MAX_PRESSURES]; MAX_PRESSURES],
    size: usize,
) -> [[[f64; MAX_PRESSURES]; MAX_PRESSURES]; 2] {
    // Gauss-Jordan without pivoting: safe for positive definite matrices.
    let mut a = [[0.0; MAX_PRESSURES]; MAX_PRESSURES];
    for m in 0..size {
        for n in 0..=m {
            a[m][n] = sum(lower[m][n]);
            a[n][m] = a[m][n];
        }
    }
    let whole = a;
    let mut b = [[0.0; MAX_PRESSURES]; MAX_PRESSURES];
    for m in 0..size {
        b[m][m] = 1.0;
    }
    for m in 0..size {
        let r = 1.0 / a[m][m];
        for n in 0..size {
            a[m][n] *= r;
            b[m][n] *= r;
        }
        for other in (0..size).filter(|&other| other != m) {
            let factor = a[other][m];
            for n in 0..size {
                a[other][n] -= factor * a[m][n];
                b[other][n] -= factor * b[m][n];
            }
        }
    }
    [whole, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tangent_of_a_hexahedron_is_the_same_in_both_ways() {
        let shape = CellShape::Hex27;
        let mut kernel = Kernel::new(shape, Kinematics::Solid, Points::Usual);
        let places: [[f64; 3]; 27] = std::array::from_fn(|node| {
            let [x, y, z] = shape.node_at(node);
            [x + 0.1 * y * z, 0.8 * y - 0.05 * x * x, 1.3 * z + 0.1 * x]
        });
        let moved = places.map(|[x, y, z]| [0.1 * z * z, -0.1 * y, 0.1 * x * y]);
        let material = Material::mooney_rivlin(3.0, 1.0, 0.01).unwrap();
        let input = CellInput {
            reference: &places,
            displacement: &moved,
            pressure: [1.0, 0.5, -0.5, 0.2],
            material: &material,
            memory: None,
            elimination: ELIMINATION_RATIO,
        };
        let mut all = || {
            kernel.evaluate(&input, true).unwrap();
            let mut entries = Vec::new();
            for (a, b) in (0..27).flat_map(|a| (0..27).map(move |b| (a, b))) {
                let between = kernel.node_blocks().between(a, b);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    assert_eq!(between[i][j], kernel.tangent(i, a, j, b));
                    entries.push(between[i][j]);
                }
            }
            kernel.factored = None;
            entries
        };
        let (one, other) = (all(), all());
        let most = other.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        for (one, other) in one.iter().zip(&other) {
            // Rounding of sums of 81 products.
            assert!((one - other).abs() < 1e-14 * most, "{one} {other}");
        }
    }
}
