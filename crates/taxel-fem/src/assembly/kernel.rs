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

use pulp::{Simd, WithSimd};

use crate::material::Material;
use crate::mesh::CellShape;
use crate::scalar::{Lanes, PLACE, Scalar, Symmetric, Tensor, determinant, inverse};

/// How the third direction behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinematics {
    /// Two dimensions, no stretch along the third; per unit depth.
    PlaneStrain,
    /// Radius first, axis second; the whole turn.
    Axisymmetric,
    /// Three dimensions.
    Solid,
}

impl Kinematics {
    /// Components of displacement.
    pub const fn components(self) -> usize {
        match self {
            Self::PlaneStrain | Self::Axisymmetric => 2,
            Self::Solid => 3,
        }
    }

    /// Directions in which a displacement varies (the hoop is the third).
    const fn directions(self) -> usize {
        match self {
            Self::PlaneStrain => 2,
            Self::Axisymmetric | Self::Solid => 3,
        }
    }

    /// Pressure functions of a cell.
    pub const fn pressures(self) -> usize {
        self.components() + 1
    }
}

/// Bulk over shear modulus of the elimination where the solid keeps its volume.
pub(crate) const ELIMINATION_RATIO: f64 = 1e5;
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

/// What a cell is made from.
#[derive(Clone, Copy, Debug)]
pub struct CellInput<'a> {
    /// Reference places of the nodes.
    pub reference: &'a [[f64; 3]],
    /// Present places of the nodes.
    pub current: &'a [[f64; 3]],
    /// Pressure unknowns (mean stress, tension positive), Pa.
    pub pressure: [f64; MAX_PRESSURES],
    /// The solid.
    pub material: &'a Material,
    /// Its past.
    pub memory: Option<Memory<'a>>,
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

/// Tables and work space for one shape of cell.
pub struct Kernel {
    shape: CellShape,
    kinematics: Kinematics,
    points: usize,
    /// Nodes, padded to whole lanes.
    padded: usize,
    values: Vec<Lanes>,
    gradients: Vec<Lanes>,
    weights: Vec<Lanes>,
    point_values: Vec<Lanes>,
    point_gradients: Vec<Lanes>,
    // Results of the last evaluation.
    grad: Vec<Lanes>,
    blocks: Vec<Lanes>,
    product: Vec<Lanes>,
    moduli: Vec<f64>,
    force: Vec<Lanes>,
    coupling: Vec<Lanes>,
    recovery: Vec<Lanes>,
    states: Vec<PointState>,
    /// Elimination: `D^-1 Rp`.
    pub pressure_shift: [f64; MAX_PRESSURES],
    /// Energy of shape change, J (or J/m).
    pub energy: f64,
}

#[derive(Clone, Copy, Default)]
struct PointState {
    /// `H^-1`, H the gradient of the present place in the reference cell.
    back: Tensor<f64>,
    /// Kirchhoff stress times volume.
    stress: Symmetric<f64>,
    /// Volume ratio times volume times pressure function.
    volume: [f64; MAX_PRESSURES],
}

/// Lanes needed for this many numbers.
const fn groups(count: usize) -> usize {
    count.div_ceil(Lanes::COUNT)
}

impl Kernel {
    /// Tables for a shape of cell.
    pub fn new(shape: CellShape, kinematics: Kinematics) -> Self {
        let quadrature = shape.quadrature();
        let (nodes, points) = (shape.node_count(), quadrature.len());
        let dimension = shape.dimension();
        let wide = groups(points);
        let columns = groups(nodes);
        let zero = Lanes::constant(0.0);
        let mut kernel = Self {
            shape,
            kinematics,
            points,
            padded: columns * Lanes::COUNT,
            values: vec![zero; wide * nodes],
            gradients: vec![zero; wide * nodes * dimension],
            weights: vec![zero; wide],
            point_values: vec![zero; points * columns],
            point_gradients: vec![zero; points * dimension * columns],
            grad: vec![zero; points * kinematics.directions() * columns],
            blocks: vec![zero; 6 * columns * Lanes::COUNT * columns],
            product: vec![zero; points * kinematics.directions() * columns],
            moduli: vec![0.0; points * 6 * 9],
            force: vec![zero; 3 * columns],
            coupling: vec![zero; 3 * MAX_PRESSURES * columns],
            recovery: vec![zero; 3 * MAX_PRESSURES * columns],
            states: vec![PointState::default(); points],
            pressure_shift: [0.0; MAX_PRESSURES],
            energy: 0.0,
        };
        for lane in 0..wide * Lanes::COUNT {
            // Idle lanes repeat the first point with no weight.
            let point = quadrature[if lane < points { lane } else { 0 }];
            let shapes = shape.shapes(point.at);
            let (group, at) = (lane / Lanes::COUNT, lane % Lanes::COUNT);
            kernel.weights[group].0[at] = if lane < points { point.weight } else { 0.0 };
            for node in 0..nodes {
                kernel.values[group * nodes + node].0[at] = shapes.values[node];
                let (column, place) = (node / Lanes::COUNT, node % Lanes::COUNT);
                if lane < points {
                    kernel.point_values[lane * columns + column].0[place] = shapes.values[node];
                }
                for d in 0..dimension {
                    let slope = shapes.gradients[node][d];
                    kernel.gradients[(group * nodes + node) * dimension + d].0[at] = slope;
                    if lane < points {
                        let row = (lane * dimension + d) * columns + column;
                        kernel.point_gradients[row].0[place] = slope;
                    }
                }
            }
        }
        kernel
    }

    /// Shape of the cells.
    pub fn shape(&self) -> CellShape {
        self.shape
    }

    /// Number of quadrature points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Nodal force of the last cell with the pressure eliminated: component, node.
    #[inline(always)]
    pub fn force(&self, component: usize, node: usize) -> f64 {
        let columns = self.padded / Lanes::COUNT;
        self.force[component * columns + node / Lanes::COUNT].0[node % Lanes::COUNT]
    }

    /// Entry of the tangent of the last cell between two displacements.
    #[inline(always)]
    pub fn tangent(&self, i: usize, a: usize, j: usize, b: usize) -> f64 {
        if i <= j {
            self.block(BLOCK[i][j], a, b)
        } else {
            self.block(BLOCK[j][i], b, a)
        }
    }

    #[inline(always)]
    fn block(&self, block: usize, a: usize, b: usize) -> f64 {
        let columns = self.padded / Lanes::COUNT;
        let row = (block * self.padded + a) * columns;
        self.blocks[row + b / Lanes::COUNT].0[b % Lanes::COUNT]
    }

    /// Row `m` of `D^-1 Kup'`: how the pressure follows a displacement.
    #[inline(always)]
    pub fn recovery(&self, m: usize, component: usize, node: usize) -> f64 {
        let columns = self.padded / Lanes::COUNT;
        let row = (component * MAX_PRESSURES + m) * columns;
        self.recovery[row + node / Lanes::COUNT].0[node % Lanes::COUNT]
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
        let Self {
            kernel,
            input,
            tangent,
        } = self;
        let compliance = kernel.points_pass(input, tangent)?;
        kernel.gradients_pass();
        kernel.vectors_pass();
        kernel.eliminate(compliance);
        if tangent {
            if S::F64_LANES >= Lanes::COUNT {
                kernel.tangent_pass::<4, 4>();
            } else {
                kernel.tangent_pass::<4, 1>();
            }
        }
        Ok(())
    }
}

/// `D` and `Rp` of a cell.
struct Compliance {
    matrix: [[f64; MAX_PRESSURES]; MAX_PRESSURES],
    residual: [f64; MAX_PRESSURES],
}

impl Kernel {
    /// Deformation, stress and moduli at all quadrature points, several at once.
    #[inline(always)]
    fn points_pass(
        &mut self,
        input: &CellInput<'_>,
        tangent: bool,
    ) -> Result<Compliance, Inverted> {
        let pressures = self.kinematics.pressures();
        let mut compliance = Compliance {
            matrix: [[0.0; MAX_PRESSURES]; MAX_PRESSURES],
            residual: [0.0; MAX_PRESSURES],
        };
        let centre = input.reference[input.reference.len() - 1];
        let size = input.reference[..self.shape.corner_count()]
            .iter()
            .flat_map(|x| (0..3).map(move |d| (x[d] - centre[d]).abs()))
            .fold(0.0, f64::max);
        self.energy = 0.0;
        for group in 0..self.weights.len() {
            let (undeformed, place) = self.map(group, input.reference);
            let (deformed, _) = self.map(group, input.current);
            let volume = determinant(&undeformed);
            let size_ratio = determinant(&deformed) / volume;
            self.check(group, volume, size_ratio)?;
            let mut weight = self.weights[group] * volume;
            if self.kinematics == Kinematics::Axisymmetric {
                weight = weight * Lanes::constant(std::f64::consts::TAU);
            }
            let inward = inverse(&undeformed, volume);
            let back = inverse(&deformed, determinant(&deformed));
            let mut f: Tensor<Lanes> = [[Lanes::constant(0.0); 3]; 3];
            for i in 0..3 {
                for k in 0..3 {
                    f[i][k] = deformed[i][0] * inward[0][k]
                        + deformed[i][1] * inward[1][k]
                        + deformed[i][2] * inward[2][k];
                }
            }
            let mut response = input.material.law.response(&f);
            if let Some(memory) = &input.memory {
                self.remember(group, memory, &f, &mut response);
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
            let mut asked = Lanes::constant(0.0);
            let mut slope = Lanes::constant(0.0);
            let stiffest = 1.0 / (ELIMINATION_RATIO * input.material.law.shear_modulus());
            for lane in 0..Lanes::COUNT {
                let (ratio, derivative) = input.material.volumetric.volume_ratio(pressure.0[lane]);
                asked.0[lane] = ratio;
                slope.0[lane] = derivative.max(stiffest);
            }
            let excess = (size_ratio - asked) * weight;
            slope = slope * weight;
            self.energy += sum(response.energy * weight);
            for m in 0..pressures {
                compliance.residual[m] += sum(excess * functions[m]);
                for n in 0..=m {
                    compliance.matrix[m][n] += sum(slope * functions[m] * functions[n]);
                }
            }
            let hydrostatic = pressure * size_ratio;
            let mut stress = response.stress;
            for v in 0..3 {
                stress[v] = stress[v] + hydrostatic;
            }
            if tangent {
                self.store_moduli(group, &response.tangent, hydrostatic, &stress, weight);
            }
            for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
                let state = &mut self.states[group * Lanes::COUNT + lane];
                for i in 0..3 {
                    for k in 0..3 {
                        state.back[i][k] = back[i][k].0[lane];
                    }
                }
                for v in 0..6 {
                    state.stress[v] = stress[v].0[lane] * weight.0[lane];
                }
                for m in 0..MAX_PRESSURES {
                    state.volume[m] = functions[m].0[lane] * size_ratio.0[lane] * weight.0[lane];
                }
            }
        }
        Ok(compliance)
    }

    /// Gradient of a place in the reference cell (third row and column by the
    /// kinematics), and the place itself.
    #[inline(always)]
    fn map(&self, group: usize, nodes: &[[f64; 3]]) -> (Tensor<Lanes>, [Lanes; 3]) {
        let dimension = self.shape.dimension();
        let mut gradient = [[Lanes::constant(0.0); 3]; 3];
        let mut place = [Lanes::constant(0.0); 3];
        let count = nodes.len();
        for node in 0..count {
            let x = nodes[node];
            let value = self.values[group * count + node];
            let first = (group * count + node) * dimension;
            for i in 0..dimension {
                place[i] = value.times_plus(x[i], place[i]);
                for k in 0..dimension {
                    gradient[i][k] = self.gradients[first + k].times_plus(x[i], gradient[i][k]);
                }
            }
        }
        match self.kinematics {
            Kinematics::PlaneStrain => gradient[2][2] = Lanes::constant(1.0),
            Kinematics::Axisymmetric => gradient[2][2] = place[0],
            Kinematics::Solid => {}
        }
        (gradient, place)
    }

    #[inline(always)]
    fn check(&self, group: usize, volume: Lanes, ratio: Lanes) -> Result<(), Inverted> {
        for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
            let point = group * Lanes::COUNT + lane;
            // Negated so that a value that is not a number is caught as well.
            if !(volume.0[lane] > 0.0) {
                return Err(Inverted {
                    volume_ratio: volume.0[lane],
                    point,
                    undeformed: true,
                });
            }
            if !(ratio.0[lane] > 0.0) {
                return Err(Inverted {
                    volume_ratio: ratio.0[lane],
                    point,
                    undeformed: false,
                });
            }
        }
        Ok(())
    }

    /// Adds what the past carries: `tau = g tau + F S F'`, `c = g c`.
    #[inline(always)]
    fn remember(
        &self,
        group: usize,
        memory: &Memory<'_>,
        f: &Tensor<Lanes>,
        response: &mut crate::material::Response<Lanes>,
    ) {
        let factor = Lanes::constant(memory.factor);
        let mut carried = [Lanes::constant(0.0); 6];
        for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
            for v in 0..6 {
                carried[v].0[lane] = memory.carried[group * Lanes::COUNT + lane][v];
            }
        }
        for v in 0..6 {
            let (i, j) = crate::scalar::PAIRS[v];
            let mut pushed = Lanes::constant(0.0);
            for k in 0..3 {
                for l in 0..3 {
                    pushed = pushed + f[i][k] * carried[PLACE[k][l]] * f[j][l];
                }
            }
            response.stress[v] = response.stress[v] * factor + pushed;
            for w in 0..6 {
                response.tangent[v][w] = response.tangent[v][w] * factor;
            }
        }
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
        let components = self.kinematics.components();
        let directions = self.kinematics.directions();
        let hoop = self.kinematics == Kinematics::Axisymmetric;
        let modulus = |v: usize, w: usize| {
            // p J (1 x 1 - 2 I)
            let volumetric = match (v < 3, w < 3, v == w) {
                (true, true, true) => -hydrostatic,
                (true, true, false) => hydrostatic,
                (_, _, true) => -hydrostatic,
                _ => return tangent[v][w] * weight,
            };
            (tangent[v][w] + volumetric) * weight
        };
        for i in 0..components {
            for j in i..components {
                for k in 0..directions {
                    for l in 0..directions {
                        let around = |component: usize, direction: usize| {
                            hoop && direction == 2 && component == 0
                        };
                        let outside = hoop && ((k == 2 && i != 0) || (l == 2 && j != 0));
                        let value = if outside {
                            Lanes::constant(0.0)
                        } else {
                            let v = if around(i, k) { 2 } else { PLACE[i][k] };
                            let w = if around(j, l) { 2 } else { PLACE[j][l] };
                            let turned = around(i, k) == around(j, l);
                            if i == j && turned {
                                modulus(v, w) + stress[PLACE[k][l]] * weight
                            } else {
                                modulus(v, w)
                            }
                        };
                        let slot = BLOCK[i][j] * 9 + k * 3 + l;
                        for lane in 0..Lanes::COUNT.min(self.points - group * Lanes::COUNT) {
                            let point = group * Lanes::COUNT + lane;
                            self.moduli[point * 54 + slot] = value.0[lane];
                        }
                    }
                }
            }
        }
    }

    /// Spatial gradients of the shape functions at every point.
    #[inline(always)]
    fn gradients_pass(&mut self) {
        let columns = self.padded / Lanes::COUNT;
        let dimension = self.shape.dimension();
        let directions = self.kinematics.directions();
        for point in 0..self.points {
            let back = self.states[point].back;
            for k in 0..directions {
                for column in 0..columns {
                    let mut sum = Lanes::constant(0.0);
                    if k < dimension {
                        for m in 0..dimension {
                            let slope =
                                self.point_gradients[(point * dimension + m) * columns + column];
                            sum = slope.times_plus(back[m][k], sum);
                        }
                    } else {
                        sum = self.point_values[point * columns + column]
                            * Lanes::constant(back[2][2]);
                    }
                    self.grad[(point * directions + k) * columns + column] = sum;
                }
            }
        }
    }

    /// Nodal forces and their dependence on the pressure.
    #[inline(always)]
    fn vectors_pass(&mut self) {
        let columns = self.padded / Lanes::COUNT;
        let directions = self.kinematics.directions();
        let hoop = self.kinematics == Kinematics::Axisymmetric;
        for i in 0..self.kinematics.components() {
            for column in 0..columns {
                let mut force = Lanes::constant(0.0);
                let mut coupling = [Lanes::constant(0.0); MAX_PRESSURES];
                for point in 0..self.points {
                    let state = &self.states[point];
                    for k in 0..directions {
                        let around = hoop && k == 2;
                        if around && i != 0 {
                            continue;
                        }
                        let gradient = self.grad[(point * directions + k) * columns + column];
                        let stress = state.stress[if around { 2 } else { PLACE[i][k] }];
                        force = gradient.times_plus(stress, force);
                        if around || k == i {
                            for m in 0..MAX_PRESSURES {
                                coupling[m] = gradient.times_plus(state.volume[m], coupling[m]);
                            }
                        }
                    }
                }
                self.force[i * columns + column] = force;
                for m in 0..MAX_PRESSURES {
                    self.coupling[(i * MAX_PRESSURES + m) * columns + column] = coupling[m];
                }
            }
        }
    }

    /// Eliminates the pressure from the residual and prepares its recovery.
    #[inline(always)]
    fn eliminate(&mut self, compliance: Compliance) {
        let pressures = self.kinematics.pressures();
        let columns = self.padded / Lanes::COUNT;
        let inverse = inverse_of(&compliance.matrix, pressures);
        for m in 0..pressures {
            self.pressure_shift[m] = (0..pressures)
                .map(|n| inverse[m][n] * compliance.residual[n])
                .sum();
        }
        for i in 0..self.kinematics.components() {
            for column in 0..columns {
                let row = |m: usize| (i * MAX_PRESSURES + m) * columns + column;
                let mut force = self.force[i * columns + column];
                for m in 0..pressures {
                    force = self.coupling[row(m)].times_plus(self.pressure_shift[m], force);
                    let mut follow = Lanes::constant(0.0);
                    for n in 0..pressures {
                        follow = self.coupling[row(n)].times_plus(inverse[m][n], follow);
                    }
                    self.recovery[row(m)] = follow;
                }
                self.force[i * columns + column] = force;
            }
        }
    }

    /// The tangent, block by block of components: sums over points and directions of
    /// products of gradients, as small dense matrix products.
    #[inline(always)]
    fn tangent_pass<const ROWS: usize, const WIDE: usize>(&mut self) {
        let components = self.kinematics.components();
        let pressures = self.kinematics.pressures();
        let directions = self.kinematics.directions();
        let columns = self.padded / Lanes::COUNT;
        for i in 0..components {
            for j in i..components {
                let block = BLOCK[i][j];
                for point in 0..self.points {
                    for k in 0..directions {
                        let moduli = &self.moduli[point * 54 + block * 9 + k * 3..][..3];
                        for column in 0..columns {
                            let mut sum = Lanes::constant(0.0);
                            for l in 0..directions {
                                let row = (point * directions + l) * columns;
                                sum = self.grad[row + column].times_plus(moduli[l], sum);
                            }
                            self.product[(point * directions + k) * columns + column] = sum;
                        }
                    }
                }
                let target =
                    &mut self.blocks[block * self.padded * columns..][..self.padded * columns];
                let depth = self.points * directions;
                let couple = i * MAX_PRESSURES * columns;
                let follow = j * MAX_PRESSURES * columns;
                let of_pressure = (
                    &self.coupling[couple..couple + pressures * columns],
                    &self.recovery[follow..follow + pressures * columns],
                );
                let of_shape = (
                    &self.grad[..depth * columns],
                    &self.product[..depth * columns],
                );
                match columns {
                    4 if WIDE == 4 => multiply::<ROWS, 4>(target, columns, [of_shape, of_pressure]),
                    2 if WIDE == 4 => multiply::<ROWS, 2>(target, columns, [of_shape, of_pressure]),
                    _ => multiply::<ROWS, 1>(target, columns, [of_shape, of_pressure]),
                }
            }
        }
    }
}

/// `target = sum of left' right` over pairs of row-first matrices of equal width,
/// in panels of `ROWS` rows and `WIDE` lanes that stay in registers.
#[inline(always)]
fn multiply<const ROWS: usize, const WIDE: usize>(
    target: &mut [Lanes],
    columns: usize,
    pairs: [(&[Lanes], &[Lanes]); 2],
) {
    let rows = target.len() / columns;
    let mut row = 0;
    while row < rows {
        let (group, offset) = (row / Lanes::COUNT, row % Lanes::COUNT);
        let mut column = 0;
        while column < columns {
            let mut panel = [[Lanes::constant(0.0); WIDE]; ROWS];
            // Plain loops: an iterator that is not inlined here would not be compiled
            // for the registers of this function.
            let mut number = 0;
            while number < pairs.len() {
                let (left, right) = pairs[number];
                let mut at = 0;
                while at < left.len() {
                    let factors = left[at + group].0;
                    let mut wide = [Lanes::constant(0.0); WIDE];
                    let mut c = 0;
                    while c < WIDE {
                        wide[c] = right[at + column + c];
                        c += 1;
                    }
                    let mut r = 0;
                    while r < ROWS {
                        let factor = factors[offset + r];
                        let mut c = 0;
                        while c < WIDE {
                            panel[r][c] = wide[c].times_plus(factor, panel[r][c]);
                            c += 1;
                        }
                        r += 1;
                    }
                    at += columns;
                }
                number += 1;
            }
            let mut r = 0;
            while r < ROWS {
                let mut c = 0;
                while c < WIDE {
                    target[(row + r) * columns + column + c] = panel[r][c];
                    c += 1;
                }
                r += 1;
            }
            column += WIDE;
        }
        row += ROWS;
    }
}

#[inline(always)]
fn sum(lanes: Lanes) -> f64 {
    let a = lanes.0;
    ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7]))
}

/// Inverse of a small positive definite matrix given by its lower triangle.
#[inline(always)]
fn inverse_of(
    lower: &[[f64; MAX_PRESSURES]; MAX_PRESSURES],
    size: usize,
) -> [[f64; MAX_PRESSURES]; MAX_PRESSURES] {
    // Gauss-Jordan without pivoting: safe for positive definite matrices.
    let mut a = *lower;
    for m in 0..size {
        for n in m + 1..size {
            a[m][n] = a[n][m];
        }
    }
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
    b
}
