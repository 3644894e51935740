//! A point of a surface over another surface: its distance, and the derivatives of its forces.
//!
//! The point `x` looks along the normal of its own surface at the point `y` of the other,
//! `x - y = g n` with `n` against that normal. Pressure and friction act along and across `n`, so
//! no force turns suddenly where `y` passes from one facet to the next. What is not symmetric in
//! the tangent stands in products.

use taxel_numerics::dense::dot3;

use super::foot::{Foot, duals, inverse, minus};
use super::friction::{Friction, friction};
use super::hardening::hardened;
use super::points::{ContactPoint, each_point_of};
use super::surfaces::{PairTables, Search};
use crate::problem::contact::{ContactState, Gap};
use crate::problem::{Problem, SurfacePair};

/// A vector for each node of a pair of facets.
pub(super) type Nodal = Vec<[f64; 3]>;

/// A point of a surface over another one.
pub(super) struct Meeting {
    /// Number of the facet of the second surface.
    pub(super) facet: usize,
    pub(super) foot: Foot,
    pub(super) gap: Gap,
    pub(super) pressure: f64,
    /// Contact stiffness, Pa/m.
    pub(super) stiffness: f64,
    /// Vectors that are dual to the tangents of the own surface, and those across `n` that are
    /// dual to the tangents of the second.
    raised: [[f64; 3]; 2],
    across: [[f64; 3]; 2],
    directions: usize,
}

/// Change of the forces at a point by a motion: `forces (motion . u)`.
pub(super) struct Change {
    pub(super) forces: Nodal,
    pub(super) motion: Nodal,
}

fn scaled(by: f64, v: [f64; 3]) -> [f64; 3] {
    v.map(|x| by * x)
}

fn add(sum: &mut [f64; 3], by: f64, v: [f64; 3]) {
    for d in 0..3 {
        sum[d] += by * v[d];
    }
}

/// Adds a multiple of one set of vectors to another.
fn add_all(sum: &mut [[f64; 3]], by: f64, of: &[[f64; 3]]) {
    for (sum, v) in sum.iter_mut().zip(of) {
        add(sum, by, *v);
    }
}

/// Every contact point of a pair, with what it is over.
pub(super) fn each_meeting(
    problem: &Problem,
    (contact, places): (&ContactState, &[[f64; 3]]),
    (tables, pair): (&PairTables, &SurfacePair),
    hears: &mut dyn FnMut(&ContactPoint<'_>, Option<Meeting>),
) {
    let mut search = Search::new(tables, places);
    let table_of = |facet, _| &tables.tables[facet];
    each_point_of(problem, &pair.first, (&table_of, places), &mut |point| {
        let multiplier = contact.multiplier(point.number);
        let meeting = search.ahead(point).and_then(|(facet, foot)| {
            let stiffness = hardened(pair.stiffness, tables.hardening, multiplier);
            let pressure = multiplier - stiffness * foot.distance;
            Meeting::new(point, places, (facet, foot), [pressure, stiffness])
        });
        hears(point, meeting);
    });
}

/// Friction at a point that touches a surface.
pub(super) struct Rubbing {
    pub(super) friction: Friction,
    /// Height of the point over its anchor along the normal, m.
    height: f64,
    /// Facet of the second surface that the anchor is on, with the shape functions there.
    held: (usize, Vec<f64>),
}

/// Friction at a point that touches a surface; none before it has an anchor.
pub(super) fn rub_surface(
    (tables, pair): (&PairTables, &SurfacePair),
    contact: &ContactState,
    point: &ContactPoint<'_>,
    meeting: &Meeting,
    places: &[[f64; 3]],
) -> Option<Rubbing> {
    let anchor = contact
        .anchor(point.number)
        .filter(|_| pair.friction > 0.0)?;
    let facet = anchor.facet? as usize;
    let (held, values) = tables.place_on(facet, anchor.place, places);
    let bound = contact.bound(point.number, pair.friction, meeting.pressure.max(0.0));
    Some(Rubbing {
        friction: friction(&meeting.gap, point.place, held, pair.stiffness, bound),
        height: dot3(minus(point.place, held), meeting.gap.normal),
        held: (facet, values),
    })
}

impl Rubbing {
    /// Motion of the point of the second surface against the anchor: factors of the nodes of
    /// both facets.
    pub(super) fn parting<'t>(
        &'t self,
        tables: &'t PairTables,
        meeting: &'t Meeting,
    ) -> impl Iterator<Item = (u32, f64)> + 't {
        let here = tables.second[meeting.facet].iter();
        let there = tables.second[self.held.0].iter();
        let here = here.zip(&meeting.foot.shapes.values);
        let there = there.zip(&self.held.1);
        here.map(|(&node, &value)| (node, value))
            .chain(there.map(|(&node, &value)| (node, -value)))
    }
}

impl Meeting {
    fn new(
        point: &ContactPoint<'_>,
        places: &[[f64; 3]],
        (facet, foot): (usize, Foot),
        [pressure, stiffness]: [f64; 2],
    ) -> Option<Self> {
        let (tangents, facing) = point.frame(places);
        let directions = point.directions();
        let metric =
            std::array::from_fn(|k| std::array::from_fn(|l| dot3(tangents[k], tangents[l])));
        let metric = inverse(metric, directions)?;
        let raised = std::array::from_fn(|k| {
            std::array::from_fn(|d| (0..directions).map(|l| metric[k][l] * tangents[l][d]).sum())
        });
        let normal = scaled(-1.0, facing);
        Some(Self {
            facet,
            gap: Gap {
                distance: foot.distance,
                normal,
                curvature: [[0.0; 3]; 3],
            },
            pressure,
            stiffness,
            raised,
            across: duals(foot.tangents, normal, directions)?,
            directions,
            foot,
        })
    }

    /// A vector at the point, and its opposite on the second surface.
    pub(super) fn pull(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
        v: [f64; 3],
    ) -> Nodal {
        let pulled = numbers.iter().map(|&[own, other]| {
            let own = own.map_or(0.0, |k| point.values[k]);
            let other = other.map_or(0.0, |k| self.foot.shapes.values[k]);
            scaled(own - other, v)
        });
        pulled.collect()
    }

    /// How much the own tangent turns along the normal.
    fn turn(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
        along: usize,
    ) -> Nodal {
        let turned = numbers.iter().map(|&[own, _]| {
            let slope = own.map_or(0.0, |k| point.slopes[k][along]);
            scaled(slope, self.gap.normal)
        });
        turned.collect()
    }

    /// What a force on the second surface becomes when it moves along a reference coordinate.
    fn shifted(&self, numbers: &[[Option<usize>; 2]], v: [f64; 3], along: usize) -> Nodal {
        let shifted = numbers.iter().map(|&[_, other]| {
            let slope = other.map_or(0.0, |k| self.foot.shapes.gradients[k][along]);
            scaled(slope, v)
        });
        shifted.collect()
    }

    /// Motion by which a reference coordinate of the point of the second surface changes.
    fn drift(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
        along: usize,
    ) -> Nodal {
        let dual = self.across[along];
        let mut motion = self.pull(numbers, point, dual);
        for k in 0..self.directions {
            let turn = self.turn(numbers, point, k);
            let by = self.gap.distance * dot3(dual, self.raised[k]);
            add_all(&mut motion, by, &turn);
        }
        motion
    }

    /// Motion that opens the distance, beyond that along the normal: the second surface is
    /// inclined against the first.
    pub(super) fn incline(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
    ) -> Nodal {
        let (normal, facing) = (self.gap.normal, self.foot.normal);
        let across = dot3(facing, normal);
        let inclined = minus(scaled(1.0 / across, facing), normal);
        let mut motion = self.pull(numbers, point, inclined);
        for k in 0..self.directions {
            let by = self.gap.distance * dot3(inclined, self.raised[k]);
            add_all(&mut motion, by, &self.turn(numbers, point, k));
        }
        motion
    }

    /// Changes of a pressure's forces by the turn of the own surface and by the way of the point
    /// along the second, per pressure.
    pub(super) fn changes(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
    ) -> Vec<Change> {
        let along = 0..self.directions;
        along
            .flat_map(|k| {
                [
                    Change {
                        forces: self.pull(numbers, point, self.raised[k]),
                        motion: self.turn(numbers, point, k),
                    },
                    Change {
                        forces: self.shifted(numbers, self.gap.normal, k),
                        motion: self.drift(numbers, point, k),
                    },
                ]
            })
            .collect()
    }

    /// The same of friction.
    pub(super) fn friction_changes(
        &self,
        numbers: &[[Option<usize>; 2]],
        point: &ContactPoint<'_>,
        rubbing: &Rubbing,
    ) -> Vec<Change> {
        let along = 0..self.directions;
        let (rubbing, height) = (&rubbing.friction, rubbing.height);
        along
            .flat_map(|k| {
                let own = self.raised[k];
                let mut turned = scaled(dot3(rubbing.traction, own), self.gap.normal);
                for d in 0..3 {
                    turned[d] += height * dot3(rubbing.tangent[d], own);
                }
                [
                    Change {
                        forces: self.pull(numbers, point, turned),
                        motion: self.turn(numbers, point, k),
                    },
                    Change {
                        forces: self.shifted(numbers, scaled(-1.0, rubbing.traction), k),
                        motion: self.drift(numbers, point, k),
                    },
                ]
            })
            .collect()
    }
}
