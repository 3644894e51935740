//! What selections by place are in a mesh.

use taxel_fem::mesh::neighbours::SAME_PLACE;
use taxel_fem::mesh::{Facet, Mesh};

use super::axes::{component, letter};
use super::description::{Prescribed, ProblemFile};
use super::group::{BoxCorners, Group, PlaneAt, Selection};
use super::mistake::{Wrong, wrong};

/// A facet faces a direction that its normal leaves by less than 45 degrees: this is the cosine.
const FACES: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl Selection {
    /// Adds what is selected to the named surfaces or points of a mesh; `key` is that of the
    /// selection.
    fn add(&self, mesh: &mut Mesh, axes: &[usize], key: &str) -> Result<(), Wrong> {
        let surface = self.in_box.is_some()
            || self.plane.is_some()
            || self.normal.is_some()
            || self.of.is_some()
            || self.between.is_some()
            || self.outside == Some(true);
        let name = self.name();
        if let Some(point) = self.nearest {
            if surface {
                let message = "a point stands alone";
                return Err(wrong(key, message, "leave the other keys out"));
            }
            let inside: Vec<f64> = axes.iter().map(|&axis| point[axis]).collect();
            let nearest = nearest(mesh, &inside);
            mesh.node_sets.insert(name, nearest.into_iter().collect());
            return Ok(());
        }
        if self.outside == Some(false) || !surface {
            let help =
                "give one or more of: box, plane, normal, of, between, outside = true; or nearest";
            return Err(wrong(key, "nothing is selected", help));
        }
        let facets = self.facets(mesh, axes, key)?;
        if facets.is_empty() {
            let message =
                format!("nothing of the surface of the body is in the selection \"{name}\"");
            let help = "compare it with the size of the body, which `taxel solve --check` prints; lengths of the file are not in units of the mesh";
            return Err(wrong(key, message, help));
        }
        mesh.surfaces.insert(name, facets);
        Ok(())
    }

    fn facets(&self, mesh: &Mesh, axes: &[usize], key: &str) -> Result<Vec<Facet>, Wrong> {
        let region = |name: &String, key: String| {
            let known = mesh.regions.iter().position(|known| known == name);
            known.ok_or_else(|| {
                let message = format!("the mesh has no region \"{name}\"");
                let help = format!("give one of: {}", mesh.regions.join(", "));
                wrong(key, message, &help)
            })
        };
        let of = match &self.of {
            Some(name) => Some(region(name, format!("{key}.of"))?),
            None => None,
        };
        let mut facets = match &self.between {
            Some([one, other]) => mesh.interface([
                region(one, format!("{key}.between.0"))?,
                region(other, format!("{key}.between.1"))?,
            ]),
            None => mesh.boundary(),
        };
        let same = SAME_PLACE * mesh.size();
        let corners = |facet: Facet| {
            let count = mesh.shape(facet.cell as usize).facet_shape().corner_count();
            mesh.facet_nodes(facet)
                .take(count)
                .map(|node| mesh.points[node as usize])
        };
        if let Some(region) = of {
            facets.retain(|facet| mesh.region_of(facet.cell as usize) == region);
        }
        if let Some(PlaneAt { axis, at }) = self.plane {
            let along = component(axes, axis.number()).ok_or_else(|| {
                let message = format!("the mesh does not extend along {}", letter(axis.number()));
                wrong(format!("{key}.plane.axis"), message, "give one of its axes")
            })?;
            facets.retain(|&facet| corners(facet).all(|place| (place[along] - at).abs() <= same));
        }
        if let Some(BoxCorners { from, to }) = self.in_box {
            let inside = |place: [f64; 3]| {
                axes.iter()
                    .zip(place)
                    .all(|(&axis, x)| (from[axis] - same..=to[axis] + same).contains(&x))
            };
            facets.retain(|&facet| corners(facet).all(inside));
        }
        if let Some(normal) = self.normal {
            let wanted: Vec<f64> = axes.iter().map(|&axis| normal[axis]).collect();
            let length = wanted.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length == 0.0 {
                let message = "the direction is zero in the space of the mesh";
                let help = "give a direction such as [0, 1, 0]";
                return Err(wrong(format!("{key}.normal"), message, help));
            }
            facets.retain(|&facet| {
                let outward = mesh.outward(facet);
                let along: f64 = outward.iter().zip(&wanted).map(|(a, b)| a * b).sum();
                along >= FACES * length
            });
        }
        Ok(facets)
    }
}

/// The node of cells that is nearest to a point.
fn nearest(mesh: &Mesh, point: &[f64]) -> Option<u32> {
    let distance = |node: &u32| -> f64 {
        let place = mesh.points[*node as usize];
        place
            .iter()
            .zip(point)
            .map(|(x, at)| (x - at).powi(2))
            .sum()
    };
    (0..mesh.points.len() as u32).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Adds the selections of a file to the named parts of its mesh.
pub(super) fn select(file: &ProblemFile, mesh: &mut Mesh, axes: &[usize]) -> Result<(), Wrong> {
    let mut known: Vec<&Group> = Vec::new();
    for (key, group) in all(file) {
        let Some(selection) = &group.selection else {
            continue;
        };
        match known.iter().find(|other| other.name == group.name) {
            Some(other) if *other == group => continue,
            Some(_) => {
                let message = format!("another selection is called \"{}\"", group.name);
                return Err(wrong(key, message, "give each its own name"));
            }
            None => {}
        }
        let mut taken = mesh
            .surfaces
            .keys()
            .chain(mesh.node_sets.keys())
            .chain(&mesh.regions);
        if taken.any(|taken| *taken == group.name) {
            let message = format!("the mesh has a group \"{}\"", group.name);
            return Err(wrong(key, message, "give the selection another name"));
        }
        selection.add(mesh, axes, &key)?;
        known.push(group);
    }
    Ok(())
}

/// All groups that a file refers to, with their keys.
fn all(file: &ProblemFile) -> Vec<(String, &Group)> {
    fn list<'f>(key: &str, groups: &'f [Group], to: &mut Vec<(String, &'f Group)>) {
        let numbered = groups.iter().enumerate();
        to.extend(numbered.map(|(at, group)| (format!("{key}.{at}"), group)));
    }
    let mut all = Vec::new();
    for (at, driver) in file.parameter.iter().enumerate() {
        if let Some(Prescribed::Displacement(point)) = &driver.prescribes {
            all.push((
                format!("parameter.{at}.prescribes.displacement.at"),
                &point.at,
            ));
        }
    }
    for (at, support) in file.support.iter().enumerate() {
        all.push((format!("support.{at}.on"), &support.on));
    }
    for (at, rigid) in file.rigid.iter().enumerate() {
        all.push((format!("rigid.{at}.on"), &rigid.on));
    }
    for (at, constraint) in file.constraint.iter().enumerate() {
        let key = format!("constraint.{at}");
        list(
            &format!("{key}.periodic"),
            constraint.periodic.as_ref().map_or(&[], |pair| &pair[..]),
            &mut all,
        );
        all.extend(
            constraint
                .mean
                .iter()
                .map(|mean| (format!("{key}.mean.on"), &mean.on)),
        );
        all.extend(
            constraint
                .point
                .iter()
                .map(|point| (format!("{key}.point.at"), &point.at)),
        );
        let terms = constraint.follows.iter().enumerate();
        all.extend(terms.map(|(at, term)| (format!("{key}.follows.{at}.at"), &term.at)));
    }
    for (at, load) in file.load.iter().enumerate() {
        all.push((format!("load.{at}.on"), &load.on));
    }
    for (at, obstacle) in file.obstacle.iter().enumerate() {
        all.push((format!("obstacle.{at}.surface"), &obstacle.surface));
    }
    for (at, contact) in file.contact.iter().enumerate() {
        list(
            &format!("contact.{at}.surfaces"),
            &contact.surfaces,
            &mut all,
        );
    }
    for (at, tie) in file.tie.iter().enumerate() {
        list(&format!("tie.{at}.surfaces"), &tie.surfaces, &mut all);
    }
    for (at, cavity) in file.cavity.iter().enumerate() {
        list(&format!("cavity.{at}.wall"), &cavity.wall, &mut all);
    }
    if let Some(capacitance) = &file.capacitance {
        list("capacitance.electrodes", &capacitance.electrodes, &mut all);
        list("capacitance.ground", &capacitance.ground, &mut all);
        list("capacitance.floating", &capacitance.floating, &mut all);
    }
    for (at, resistance) in file.resistance.iter().enumerate() {
        all.push((format!("resistance.{at}.from"), &resistance.from));
        all.push((format!("resistance.{at}.to"), &resistance.to));
    }
    list("output.reactions", &file.output.reactions, &mut all);
    list("output.displacements", &file.output.displacements, &mut all);
    all
}
