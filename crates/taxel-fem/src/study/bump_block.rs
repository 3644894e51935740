//! A bump on an elastic block with four cavities and stiff plates above and below each: how
//! much the plates near each other under a small force on the bump, and under air in the
//! cavities.
//!
//! Linear response of a quarter of the block: x and y lead outward from its axis, z upward
//! from the upper faces of the cavities. A force on one flank is half of a load that is the
//! same on both sides, and half of one that is opposite.

mod half;
mod pressed;

pub use pressed::{Pressed, PressedBlock, PressedPath};

use half::{Half, Mirror};

use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Facet, Grading, Grid3, Growth, Mesh, MeshError, Part};
use crate::problem::ProblemError;
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::Solver;

/// The block at rest; lengths in m, x alike y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpBlock {
    /// From the axis to the outer face.
    pub half: f64,
    /// From the axis to the near and to the far wall of a cavity.
    pub cavity: [f64; 2],
    /// From the axis to the near and to the far edge of a plate.
    pub plate: [f64; 2],
    /// Thickness of the plates.
    pub plate_thickness: f64,
    /// Elastomer from the bottom to the lower plate's upper face.
    pub lower: f64,
    /// Elastomer between the lower plate and the cavity.
    pub insulation: f64,
    /// Height of the cavities.
    pub air: f64,
    /// Elastomer from the cavities to the bump.
    pub upper: f64,
    /// Height of the bump.
    pub bump: f64,
    /// Half side of the bump at its base and at its flat top.
    pub bump_half: [f64; 2],
    /// True if a block like this one follows on each side along x, all of one piece; then the
    /// outer face across x is that of the last block.
    pub in_row: bool,
}

/// Cavities of the quarter that is solved: of the block itself, and of the next one in a row
/// the near and the far one.
const CAVITIES: [&str; 3] = ["gap", "near", "far"];

/// What holds the outer faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockSides {
    /// Nothing: a piece that is cut out.
    Free,
    /// Mirror images under the same load.
    Symmetric,
}

/// A uniform force on the top of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopForce {
    /// Downward.
    Normal,
    /// Along x.
    Side,
}

/// Numbers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockDivision {
    /// Across: wall, from wall to plate, inner and outer half of the plate, from plate to
    /// wall, beyond.
    pub across: [usize; 6],
    /// Upward: lower layer, upper layer, each strip of the bump. Thin layers have one.
    pub upward: [usize; 3],
}

impl BlockDivision {
    /// About 6 thousand unknowns: on the unit of P2 closings are 1 to 4 % off the next one.
    pub const COARSE: Self = Self {
        across: [1, 1, 1, 1, 1, 1],
        upward: [1, 1, 1],
    };
    /// About 29 thousand unknowns: on the unit of P2 closings are within 2 % of graded meshes,
    /// the largest closing within 4 %.
    pub const USUAL: Self = Self {
        across: [1, 2, 2, 2, 2, 2],
        upward: [2, 2, 2],
    };

    /// One cell more in each interval.
    #[must_use]
    pub fn finer(self) -> Self {
        Self {
            across: self.across.map(|count| count + 1),
            upward: self.upward.map(|count| count + 1),
        }
    }
}

/// Number of strips of equal height on a flank of the bump, from its foot up.
pub const STRIPS: usize = 4;

/// Answer to a uniform force on the flat top, per newton on the whole block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopAnswer {
    /// Mean closing of the cavity between the plates of this quarter, m/N.
    pub closing: f64,
    /// Largest closing anywhere in the cavity over the mean.
    pub hottest: f64,
    /// Slope of the closing over the plate along x and along y, outward, 1/N.
    pub slopes: [f64; 2],
    /// Volume that the cavity loses, m3/N.
    pub volume: f64,
    /// In a row: mean closing of the near and of the far cavity of the next block, m/N.
    pub beside: Option<[f64; 2]>,
}

/// Answer to a uniform force on a strip of the flank that looks along x, per newton.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StripAnswer {
    /// Closing under a force toward the axis: half the sum of both sides along x, and half of
    /// what the side of the flank closes more than the other, m/N.
    pub by_side_force: [f64; 2],
    /// The same under a downward force.
    pub by_downward_force: [f64; 2],
    /// Mean rise of the strip under each of the two, m/N.
    pub rise: [f64; 2],
}

/// Answer to a pressure in all four cavities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureAnswer {
    /// Mean opening between the plates, m/Pa.
    pub opening: f64,
    /// Volume that one cavity gains, m3/Pa.
    pub volume: f64,
}

/// All linear responses of the block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockAnswer {
    /// To a force downward on the top.
    pub normal: TopAnswer,
    /// To a force along x on the top.
    pub side: TopAnswer,
    /// To forces on the strips of a flank.
    pub strips: [StripAnswer; STRIPS],
    /// To a pressure in the cavities.
    pub pressure: PressureAnswer,
    /// Volume of a cavity at rest, m3.
    pub cavity: f64,
    /// Number of unknowns of the larger solution.
    pub unknowns: usize,
}

/// Solids of a linear elastic law: Young's modulus, Pa, and Poisson's ratio below 0.5.
pub fn linear(modulus: f64, poisson: f64) -> Material {
    Material {
        law: Law::LinearElastic {
            shear: 0.5 * modulus / (1.0 + poisson),
        },
        volumetric: Volumetric::Quadratic(modulus / (3.0 * (1.0 - 2.0 * poisson))),
    }
}

/// The same at large strain: neo-Hookean, with the moduli of [`linear`] at rest.
pub fn large_strain(modulus: f64, poisson: f64) -> Material {
    let linear = linear(modulus, poisson);
    Material {
        law: Law::neo_hookean(linear.law.shear_modulus()),
        ..linear
    }
}

impl BumpBlock {
    /// The mesh: regions `soft` and `stiff`, the cavity `gap`, the outer faces, and the `section`
    /// along x through the inner edges of the plates, which pictures show.
    ///
    /// # Errors
    /// [`MeshError`] for lengths that make no block.
    pub fn mesh(&self, division: BlockDivision) -> Result<Mesh, MeshError> {
        let [lower, upper, strip] = division.upward.map(Grading::Uniform);
        self.mesh_by(
            division.across.map(Grading::Uniform),
            [lower, upper, strip, strip],
        )
    }

    /// The same with cells that double away from the edges of plates and cavities and from the
    /// foot of the bump, where the smallest has this size, m. Not of a row.
    ///
    /// # Errors
    /// As [`Self::mesh`].
    pub fn graded_mesh(&self, smallest: f64) -> Result<Mesh, MeshError> {
        let growth = Growth::doubling(smallest);
        let both = Grading::FromBoth(growth);
        let (from_start, from_end) = (Grading::FromStart(growth), Grading::FromEnd(growth));
        self.mesh_by(
            [from_end, both, both, both, both, from_start],
            [from_end, both, from_start, Grading::Uniform(1)],
        )
    }

    /// The mesh with these cells: across as [`BlockDivision::across`]; upward the lower layer, the
    /// upper one, the lowest strip of the bump and each other one.
    fn mesh_by(
        &self,
        across_cells: [Grading; 6],
        [lower, upper, foot, strip]: [Grading; 4],
    ) -> Result<Mesh, MeshError> {
        let middle = self.bump_half[0];
        let marks = [
            0.0,
            self.cavity[0],
            self.plate[0],
            middle,
            self.plate[1],
            self.cavity[1],
            self.half,
        ];
        let across = Axis::new(&marks, &across_cells)?;
        let along = self.along(&marks, &across_cells)?;
        let thin = Grading::Uniform(1);
        let floor = -self.air;
        let below = floor - self.insulation;
        let mut heights = vec![
            below - self.lower,
            below - self.plate_thickness,
            below,
            floor,
            0.0,
            self.plate_thickness,
            self.upper,
        ];
        let strips = (1..=STRIPS).map(|strip| strip as f64 / STRIPS as f64);
        heights.extend(strips.map(|share| self.upper + self.bump * share));
        let mut cells = vec![lower, thin, thin, thin, thin, upper, foot];
        cells.resize(heights.len() - 1, strip);
        let up = Axis::new(&heights, &cells)?;
        let within = |x: f64, [low, high]: [f64; 2]| low < x && x < high;
        let part = |[x, y, z]: [f64; 3]| {
            let (x, centre) = self.across_axis(x);
            let under_plate = within(x.abs(), self.plate) && within(y, self.plate);
            let plates = [
                [below - self.plate_thickness, below],
                [0.0, self.plate_thickness],
            ];
            let in_cavity = within(x.abs(), self.cavity) && within(y, self.cavity);
            if z > self.upper && (x.abs() > middle || y > middle) {
                Part::Void("beside")
            } else if within(z, [floor, 0.0]) && in_cavity {
                Part::Void(match (centre > 0.0, x < 0.0) {
                    (false, _) => CAVITIES[0],
                    (true, true) => CAVITIES[1],
                    (true, false) => CAVITIES[2],
                })
            } else if under_plate && plates.iter().any(|plate| within(z, *plate)) {
                Part::Region("stiff")
            } else {
                Part::Region("soft")
            }
        };
        let mut mesh = Grid3::new([along, across, up], "soft").mesh_by(&part)?;
        let top = self.upper + self.bump;
        let pressed: Vec<Facet> = mesh.surfaces.get("top").map_or_else(Vec::new, |surface| {
            let own = |facet: &&Facet| {
                let mut nodes = mesh.facet_nodes(**facet);
                nodes.all(|node| mesh.points[node as usize][0] <= self.half)
            };
            surface.iter().filter(own).copied().collect()
        });
        mesh.surfaces.insert("pressed".to_owned(), pressed);
        let flank = mesh.surfaces.get("beside.left").cloned();
        for strip in 0..STRIPS {
            let foot = self.upper + self.bump * strip as f64 / STRIPS as f64;
            let within = |node: u32| {
                let [x, _, z] = mesh.points[node as usize];
                let height = (z - foot) / self.bump * STRIPS as f64;
                // A billionth of the length is the rounding of the places.
                x <= self.half && (-1e-9..=1.0 + 1e-9).contains(&height)
            };
            let facets = flank.iter().flatten().copied();
            let own = facets.filter(|facet| mesh.facet_nodes(*facet).all(within));
            let own = own.collect();
            mesh.surfaces.insert(strip_name(strip), own);
        }
        let section = section(&mesh, self.plate[0]);
        mesh.surfaces.insert("section".to_owned(), section);
        // The bumps narrow upward: their cells with them.
        let narrow = 1.0 - self.bump_half[1] / self.bump_half[0];
        for point in &mut mesh.points {
            let factor = 1.0 - narrow * (point[2] - self.upper).max(0.0) / (top - self.upper);
            let (x, centre) = self.across_axis(point[0]);
            point[0] = centre + factor * x;
            point[1] *= factor;
        }
        Ok(mesh)
    }

    /// Place along x from the axis of its block, and where that axis is.
    fn across_axis(&self, x: f64) -> (f64, f64) {
        let centre = if x > self.half { 2.0 * self.half } else { 0.0 };
        (x - centre, centre)
    }

    /// Axis along x: marks and cells of the block, then those of the next one, which lie like
    /// the block and its mirror image.
    fn along(&self, marks: &[f64], cells: &[Grading]) -> Result<Axis, MeshError> {
        let (mut marks, mut cells) = (marks.to_vec(), cells.to_vec());
        if self.in_row {
            let (own, counts) = (marks.clone(), cells.clone());
            let centre = 2.0 * self.half;
            let back = own.iter().rev().skip(1).map(|mark| centre - mark);
            marks.extend(back.chain(own.iter().skip(1).map(|mark| centre + mark)));
            let mirrored = counts.iter().rev().map(|cells| cells.mirrored());
            cells.extend(mirrored.chain(counts.iter().copied()));
        }
        Axis::new(&marks, &cells)
    }

    /// Solves a block whose cavities each keep a gas, under a force on the top: closing between
    /// the plates, m, and pressure of the gas, Pa, which is an unknown of the solution and
    /// follows `p = scale (V0/V - 1)`. `force` in N on the whole block.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block, or the solution fails.
    pub fn solve_sealed(
        &self,
        solids: [Material; 2],
        sides: BlockSides,
        division: BlockDivision,
        [scale, force]: [f64; 2],
    ) -> Result<[f64; 2], Failure> {
        let mesh = self
            .mesh(division)
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let mut half = Half::at_rest(self, mesh, solids, sides, Mirror::Same)?;
        half.seal(scale)?;
        half.load(force)?;
        half.now()
    }

    /// The block under a force on its top, N on the whole block, whose cavities keep a gas of the
    /// pressure scale `gas`, Pa, or none: its deformed quarter, for pictures and files.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block, or the solution fails.
    pub fn loaded(
        &self,
        solids: [Material; 2],
        sides: BlockSides,
        division: BlockDivision,
        (along, force): (TopForce, f64),
        gas: Option<f64>,
    ) -> Result<Solver, Failure> {
        let mesh = self
            .mesh(division)
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let mirror = match along {
            TopForce::Normal => Mirror::Same,
            TopForce::Side => Mirror::Opposite,
        };
        let mut half = Half::at_rest(self, mesh, solids, sides, mirror)?;
        // A side force takes from the air of one side what it adds to that of the other.
        if let (Some(scale), TopForce::Normal) = (gas, along) {
            half.seal(scale)?;
        }
        half.load(force)?;
        Ok(half.solver)
    }

    /// Solves the block of a soft and a stiff solid under small loads.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block, or the solution fails.
    pub fn solve(
        &self,
        solids: [Material; 2],
        sides: BlockSides,
        division: BlockDivision,
    ) -> Result<BlockAnswer, Failure> {
        let mesh = self
            .mesh(division)
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        self.solve_on(mesh, solids, sides)
    }

    /// The same on a mesh of this block.
    ///
    /// # Errors
    /// [`Failure`] when the solution fails.
    pub fn solve_on(
        &self,
        mesh: Mesh,
        solids: [Material; 2],
        sides: BlockSides,
    ) -> Result<BlockAnswer, Failure> {
        let same = Half::solve(self, mesh.clone(), solids, sides, Mirror::Same)?;
        let opposite = Half::solve(self, mesh, solids, sides, Mirror::Opposite)?;
        let top = |half: &Half<'_>| {
            let top = half.answer(half.loads.top);
            let [closing, largest] = half.closing(0, top)?;
            let beside = |cavity| Ok::<_, ProblemError>(half.closing(cavity, top)?[0]);
            Ok(TopAnswer {
                closing,
                hottest: largest / closing,
                slopes: half.slopes(top)?,
                volume: -top.volumes[0],
                beside: if self.in_row {
                    Some([beside(1)?, beside(2)?])
                } else {
                    None
                },
            })
        };
        let strip = |strip: usize| {
            let [side, down] = same.loads.strips[strip];
            let closing = |half: &Half<'_>, load| Ok(half.closing(0, half.answer(load))?[0]);
            let rise = |half: &Half<'_>, load| half.rise(strip, half.answer(load));
            Ok(StripAnswer {
                by_side_force: [closing(&same, side)?, closing(&opposite, side)?],
                by_downward_force: [closing(&same, down)?, closing(&opposite, down)?],
                rise: [
                    rise(&same, side)? + rise(&opposite, side)?,
                    rise(&same, down)? + rise(&opposite, down)?,
                ],
            })
        };
        let answer = || {
            let inside = same.answer(same.loads.pressure);
            let mut strips = [StripAnswer::default(); STRIPS];
            for (number, answer) in strips.iter_mut().enumerate() {
                *answer = strip(number)?;
            }
            Ok(BlockAnswer {
                normal: top(&same)?,
                side: top(&opposite)?,
                strips,
                pressure: PressureAnswer {
                    opening: -same.closing(0, inside)?[0],
                    volume: inside.volumes[0],
                },
                cavity: same.cavity(),
                unknowns: same.solver.unknowns().max(opposite.solver.unknowns()),
            })
        };
        answer().map_err(|error| Failure::at_start(Reason::Problem(error)))
    }
}

/// The sides of the cells beyond a plane y that lie in it.
fn section(mesh: &Mesh, plane: f64) -> Vec<Facet> {
    let beyond = |node: u32| mesh.points[node as usize][1] - plane;
    // A billionth of the length is the rounding of the places.
    let in_plane = |node: u32| beyond(node).abs() <= 1e-9 * plane;
    let cells = (0..mesh.cell_count()).filter(|&cell| {
        let nodes = mesh.cell(cell);
        nodes
            .iter()
            .all(|&node| beyond(node) > 0.0 || in_plane(node))
    });
    let sides = cells.flat_map(|cell| {
        let count = mesh.shape(cell).sides().len();
        (0..count).map(move |side| Facet {
            cell: cell as u32,
            side: side as u8,
        })
    });
    sides
        .filter(|facet| mesh.facet_nodes(*facet).all(in_plane))
        .collect()
}

/// Name of the surface of a strip of the flank.
fn strip_name(strip: usize) -> String {
    format!("strip{strip}")
}
