//! Two thick plates that face each other across air and an insulation, in a layer:
//! the plane section across one straight edge, with what stands beside it.

use super::grid::{Sizes, line, name_nodes, plane, space};
use super::{check, growth};
use crate::field::FieldError;
use crate::field::electrostatics::{Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use crate::field::geometry::Geometry;
use crate::field::laplace::{Coefficient, Domain, MeshMotion};
use crate::mesh::Mesh;

/// What stands beside the plates, on both sides alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// Another pair of plates, both at zero.
    Grounded(Neighbour),
    /// Another pair of plates, the upper driven with the own one, the lower at zero.
    Driven(Neighbour),
}

impl Beside {
    fn neighbour(self) -> Option<Neighbour> {
        match self {
            Self::Nothing => None,
            Self::Grounded(neighbour) | Self::Driven(neighbour) => Some(neighbour),
        }
    }
}

/// Another pair of plates at the same heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Distance from edge to edge.
    pub distance: f64,
    /// Width.
    pub width: f64,
}

/// The plates and their layer, lengths in any one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacingPlates {
    /// Air between insulation and upper plate.
    pub air: f64,
    /// Insulation on the lower plate.
    pub insulation: f64,
    /// Relative permittivity of insulation and layer.
    pub permittivity: f64,
    /// Thickness of a plate.
    pub plate: f64,
    /// Half of the width of the plates.
    pub half_width: f64,
    /// Air beyond the edges, between the walls.
    pub cavity: f64,
    /// What stands beside.
    pub beside: Beside,
    /// Layer above the lower face of the upper plate, air above it.
    pub above: f64,
    /// Layer below the lower plate.
    pub below: f64,
    /// A plane at zero under the layer.
    pub grounded_plane: bool,
    /// Where the field ends beyond the last air of the section. It ends at the lower face of the
    /// layer too.
    pub margin: f64,
    /// Air above the solid, up to the outer boundary.
    pub air_above: f64,
}

/// Two square plates alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquarePlates {
    /// Capacitance in space over the permittivity of vacuum, in the unit of the lengths.
    pub in_space: f64,
    /// The same of plates and edges, without corners.
    pub by_edges: f64,
    /// Nodes of the quarter in space.
    pub unknowns: usize,
}

impl FacingPlates {
    /// Charge of the own lower plate per edge, metre and volt on the own upper plate, over
    /// the permittivity of vacuum, less what plates without edges would have. Half of the
    /// section is solved; nothing passes its outer boundary.
    ///
    /// # Errors
    /// [`FieldError`] for lengths, ratios or levels out of range.
    pub fn edge_excess(&self, level: u32) -> Result<f64, FieldError> {
        let neighbour = self.beside.neighbour();
        self.check(level)?;
        let least = self.air.min(self.plate).min(self.insulation);
        let edge = Some(0.05 * least / f64::from(level));
        let wall = Some(0.5 * self.air);
        let half = self.half_width;
        let mut across = vec![(0.0, None), (half, edge), (half + self.cavity, wall)];
        let mut last = half + self.cavity;
        if let Some(Neighbour { distance, width }) = neighbour {
            let (near, far) = (half + distance, half + distance + width);
            last = far + self.cavity;
            across.extend([
                (near - self.cavity, wall),
                (near, edge),
                (far, edge),
                (last, wall),
            ]);
        }
        let end = last + self.margin;
        across.push((end, None));
        let insulated = -self.air - self.insulation;
        let base = insulated - self.plate - self.below;
        let up = vec![
            (base, None),
            (insulated - self.plate, edge),
            (insulated, edge),
            (-self.air, edge),
            (0.0, edge),
            (self.plate, edge),
            (self.above, None),
            (self.above + self.air_above, None),
        ];
        let sizes = Sizes {
            growth: growth(level),
            largest: 0.25 * self.margin / f64::from(level),
        };
        let region = |place: [f64; 2]| Some(self.region(place));
        let mut mesh = plane(&line(sizes, &across), &line(sizes, &up), &region);
        let mut zero = Vec::new();
        if neighbour.is_some() {
            zero.push("ground");
        }
        if self.grounded_plane {
            name_nodes(&mut mesh, "plane", &|p| p[1] == base);
            zero.push("plane");
        }
        // Alone, the two plates carry opposite charges: one of them is the zero.
        let alone = zero.is_empty();
        let conductors: &[&str] = if alone {
            zero.push("lower");
            &["upper"]
        } else {
            &["upper", "lower"]
        };
        let found = Electrostatics {
            domain: Domain {
                mesh: &mesh,
                geometry: Geometry::Plane,
                motion: MeshMotion::None,
                exterior: None,
            },
            permittivities: &[
                ("air", Coefficient::Scalar(1.0)),
                ("layer", Coefficient::Scalar(self.permittivity)),
            ],
            conductors,
            floating: &[],
            zero: &zero,
            infinity: Infinity::Free,
        }
        .capacitance()?;
        let charge = if alone {
            found.matrix[0][0]
        } else {
            -found.matrix[1][0]
        };
        let gap = self.air + self.insulation / self.permittivity;
        Ok(charge / VACUUM_PERMITTIVITY - half / gap)
    }

    /// Two square plates as wide as these, alone: their capacitance in space, and that of plates
    /// and four edges as plane fields on the same lines of cells. Their difference is what the
    /// corners add; it is better than either.
    ///
    /// A quarter is solved. The smallest cells are half of the least of air, plate and insulation
    /// over `fine`, and grow by `1 + 1/fine` from one to the next. What stands beside and a grounded
    /// plane count for nothing.
    ///
    /// # Errors
    /// [`FieldError`] for lengths and ratios out of range.
    pub fn square_alone(&self, fine: f64) -> Result<SquarePlates, FieldError> {
        let alone = Self {
            beside: Beside::Nothing,
            grounded_plane: false,
            ..*self
        };
        alone.check(1)?;
        if !(1.0..=4.0).contains(&fine) {
            return Err(FieldError::OutOfRange {
                quantity: "fineness",
                value: fine,
                allowed: "from 1 to 4",
            });
        }
        let edge = Some(0.5 * self.air.min(self.plate).min(self.insulation) / fine);
        let (half, open) = (self.half_width, self.half_width + self.cavity);
        let insulated = -self.air - self.insulation;
        let base = insulated - self.plate - self.below;
        let sizes = Sizes {
            growth: 1.0 + 1.0 / fine,
            largest: 0.5 * self.margin / fine,
        };
        let across = [
            (0.0, None),
            (half, edge),
            (open, None),
            (open + self.margin, None),
        ];
        let up = [
            (base, None),
            (insulated - self.plate, edge),
            (insulated, edge),
            (-self.air, edge),
            (0.0, edge),
            (self.plate, edge),
            (self.above, None),
            (self.above + self.air_above, None),
        ];
        let (across, up) = (line(sizes, &across), line(sizes, &up));
        let section = plane(&across, &up, &|place| Some(alone.region(place)));
        let quarter = space([&across, &across, &up], &|[x, y, z]| {
            alone.region([x.max(y), z])
        });
        let unknowns = quarter.points.len();
        let gap = self.air + self.insulation / self.permittivity;
        let excess = alone.charge(&section)? - half / gap;
        Ok(SquarePlates {
            in_space: 4.0 * alone.charge(&quarter)?,
            by_edges: 4.0 * (half * half / gap + 2.0 * half * excess),
            unknowns,
        })
    }

    /// Charge of the lower plate at one volt on the upper one, over the permittivity of vacuum.
    fn charge(&self, mesh: &Mesh) -> Result<f64, FieldError> {
        let geometry = if mesh.dimension() == 2 {
            Geometry::Plane
        } else {
            Geometry::Solid
        };
        let found = Electrostatics {
            domain: Domain {
                mesh,
                geometry,
                motion: MeshMotion::None,
                exterior: None,
            },
            permittivities: &[
                ("air", Coefficient::Scalar(1.0)),
                ("layer", Coefficient::Scalar(self.permittivity)),
            ],
            conductors: &["upper"],
            floating: &[],
            zero: &["lower"],
            infinity: Infinity::Free,
        }
        .capacitance()?;
        Ok(found.matrix[0][0] / VACUUM_PERMITTIVITY)
    }

    /// Refuses lengths, ratios and levels out of range.
    fn check(&self, level: u32) -> Result<(), FieldError> {
        let unit = self.air;
        check(
            level,
            &[
                ("insulation over air", self.insulation / unit),
                ("plate over air", self.plate / unit),
                ("half width over air", self.half_width / unit),
                ("cavity over air", self.cavity / unit),
                ("layer above over air", self.above / unit),
                ("layer below over air", self.below / unit),
                ("margin over air", self.margin / unit),
                ("air above over air", self.air_above / unit),
                ("permittivity", self.permittivity),
            ],
        )?;
        if let Some(Neighbour { distance, width }) = self.beside.neighbour()
            && !(distance > 2.0 * self.cavity
                && distance.is_finite()
                && width > 0.0
                && width.is_finite())
        {
            return Err(FieldError::OutOfRange {
                quantity: "distance of the neighbour",
                value: distance,
                allowed: "above twice the cavity beyond an edge",
            });
        }
        Ok(())
    }

    /// The part of the section at a place.
    fn region(&self, [x, y]: [f64; 2]) -> &'static str {
        let (half, insulated) = (self.half_width, -self.air - self.insulation);
        let own = x < half;
        let (mut other, mut open) = (false, x < half + self.cavity);
        if let Some(Neighbour { distance, width }) = self.beside.neighbour() {
            let (near, far) = (half + distance, half + distance + width);
            other = x > near && x < far;
            open |= x > near - self.cavity && x < far + self.cavity;
        }
        let driven = matches!(self.beside, Beside::Driven(_));
        let upper = y > 0.0 && y < self.plate;
        let lower = y < insulated && y > insulated - self.plate;
        match () {
            () if own && upper => "upper",
            () if own && lower => "lower",
            () if other && upper && driven => "upper",
            () if other && (upper || lower) => "ground",
            () if open && y > -self.air && y < 0.0 => "air",
            () if y > self.above => "air",
            () => "layer",
        }
    }
}
