//! Finite elements of any mesh: bodies at large strain, and fields between conductors.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use taxel_fem::field::FieldError;
use taxel_fem::field::conduction::Conduction;
use taxel_fem::field::electrostatics::{Electrostatics, Infinity};
use taxel_fem::field::geometry::Geometry;
use taxel_fem::field::laplace::{Coefficient, Domain, MeshMotion};
use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{CellShape, Facet, LowerCell, Mesh as Cells};
use taxel_fem::problem::{
    Kinematics, Motion, Parameter, Pressure, Problem as Posed, ProblemError, Rule,
};
use taxel_fem::solver::newton::{Continue, Solver};
use taxel_fem::solver::stress::{nodal_stress, von_mises};

use crate::fault::{Fault, value_error};
use crate::pool::{self, Request};

/// Shapes of cells by the names of meshio.
const SHAPES: [(&str, CellShape); 12] = [
    ("triangle", CellShape::Tri7),
    ("triangle6", CellShape::Tri7),
    ("triangle7", CellShape::Tri7),
    ("quad", CellShape::Quad9),
    ("quad8", CellShape::Quad9),
    ("quad9", CellShape::Quad9),
    ("tetra", CellShape::Tet15),
    ("tetra10", CellShape::Tet15),
    ("tetra15", CellShape::Tet15),
    ("hexahedron", CellShape::Hex27),
    ("hexahedron20", CellShape::Hex27),
    ("hexahedron27", CellShape::Hex27),
];

/// Cells of one shape: name of the shape, nodes, regions.
type Block<'py> = (
    String,
    PyReadonlyArray2<'py, i64>,
    PyReadonlyArray1<'py, i64>,
);

/// A mesh with all the nodes that the elements need.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Mesh {
    cells: Cells,
}

#[pymethods]
impl Mesh {
    /// `surfaces` are lists of nodes; of a part of the boundary they name all that its sides have.
    #[new]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        blocks: Vec<Block<'_>>,
        regions: Vec<String>,
        surfaces: BTreeMap<String, Vec<i64>>,
    ) -> PyResult<Self> {
        let points = points.as_array();
        if points.ncols() != 3 {
            return Err(value_error(format!(
                "points: have {} coordinates each, not 3",
                points.ncols()
            )));
        }
        if let Some(wrong) = points.iter().find(|one| !one.is_finite()) {
            return Err(value_error(format!(
                "points: {wrong} is no coordinate; give finite numbers"
            )));
        }
        let count = points.nrows();
        let node = |number: i64, what: &str| {
            u32::try_from(number)
                .ok()
                .filter(|node| (*node as usize) < count)
                .ok_or_else(|| {
                    value_error(format!(
                        "{what}: there is no point {number}; they are 0 to {}",
                        count.saturating_sub(1)
                    ))
                })
        };
        let mut cells = Vec::new();
        for (name, nodes, of_cells) in &blocks {
            let Some((_, shape)) = SHAPES.iter().find(|(known, _)| known == name) else {
                let known = SHAPES.map(|(known, _)| known).join(", ");
                return Err(value_error(format!(
                    "cells: no shape is called {name:?}; use one of: {known}"
                )));
            };
            let (nodes, of_cells) = (nodes.as_array(), of_cells.as_array());
            if nodes.nrows() != of_cells.len() {
                return Err(value_error(format!(
                    "regions: {} for {} cells of the shape {name}",
                    of_cells.len(),
                    nodes.nrows()
                )));
            }
            for (row, region) in nodes.rows().into_iter().zip(of_cells) {
                let nodes = row.iter().map(|number| node(*number, "cells"));
                let region = u16::try_from(*region).map_err(|_| {
                    value_error(format!("regions: {region} is not the number of a name"))
                })?;
                cells.push(LowerCell {
                    shape: *shape,
                    region,
                    nodes: nodes.collect::<PyResult<_>>()?,
                });
            }
        }
        if let Some(other) = cells
            .iter()
            .find(|cell| cell.shape.dimension() != cells[0].shape.dimension())
        {
            return Err(value_error(format!(
                "cells: a {:?} among cells of {} dimensions; give those of the body alone",
                other.shape,
                cells[0].shape.dimension()
            )));
        }
        let names: Vec<&str> = regions.iter().map(String::as_str).collect();
        let points = points
            .rows()
            .into_iter()
            .map(|row| [row[0], row[1], row[2]]);
        let mut mesh = Cells::from_lower_cells(points.collect(), &cells, &names)
            .map_err(|error| value_error(error.to_string()))?;
        let boundary = mesh.boundary();
        for (name, given) in surfaces {
            let mut named = vec![false; mesh.points.len()];
            for number in &given {
                named[node(*number, &format!("surfaces.{name}"))? as usize] = true;
            }
            // The corners of a side decide: the middles may be new.
            let whole = |facet: &&Facet| {
                mesh.facet_nodes(**facet)
                    .all(|node| node as usize >= count || named[node as usize])
            };
            let facets: Vec<Facet> = boundary.iter().filter(whole).copied().collect();
            if !facets.is_empty() {
                mesh.surfaces.insert(name, facets);
            } else if given.is_empty() {
                return Err(value_error(format!("surfaces.{name}: has no point")));
            } else {
                let nodes = given.iter().map(|number| node(*number, &name));
                let mut nodes = nodes.collect::<PyResult<Vec<u32>>>()?;
                nodes.sort_unstable();
                nodes.dedup();
                mesh.node_sets.insert(name, nodes);
            }
        }
        Ok(Self { cells: mesh })
    }

    /// Points, cells by shape and regions, with the nodes that were added.
    fn complete<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        meshed(py, &self.cells)
    }
}

/// A solid: its law, constants and bulk modulus.
pub(crate) type Solid = (String, Vec<f64>, Option<f64>);

/// The material of a law by its name.
pub(crate) fn material((law, constants, bulk): &Solid) -> PyResult<Material> {
    let law = match (law.as_str(), constants.as_slice()) {
        ("mooney_rivlin", [c10, c01]) => Law::MooneyRivlin {
            c10: *c10,
            c01: *c01,
        },
        ("yeoh", [c10, c20, c30]) => Law::Yeoh {
            c10: *c10,
            c20: *c20,
            c30: *c30,
        },
        ("gent", [shear, limit]) => Law::Gent {
            shear: *shear,
            limit: *limit,
        },
        ("linear_elastic", [shear]) => Law::LinearElastic { shear: *shear },
        _ => return Err(value_error(format!("{law:?} is no law of a solid"))),
    };
    let volumetric = bulk.map_or(Volumetric::Incompressible, Volumetric::Quadratic);
    Material::new(law, volumetric).map_err(|error| value_error(error.to_string()))
}

/// Points, cells by shape in the names of meshio, regions.
pub(crate) fn meshed<'py>(py: Python<'py>, mesh: &Cells) -> PyResult<Bound<'py, PyDict>> {
    let points: Vec<f64> = mesh.points.iter().flatten().copied().collect();
    let points = Array2::from_shape_vec((mesh.points.len(), 3), points);
    let cells = PyList::empty(py);
    for (shape, name, kept) in [
        (CellShape::Quad9, "quad9", 9),
        (CellShape::Tri7, "triangle7", 7),
        (CellShape::Hex27, "hexahedron27", 27),
        // The node in the middle has no place in a tetrahedron of ten nodes.
        (CellShape::Tet15, "tetra15", 15),
    ] {
        let of_shape: Vec<usize> = (0..mesh.cell_count())
            .filter(|cell| mesh.shape(*cell) == shape)
            .collect();
        if of_shape.is_empty() {
            continue;
        }
        let nodes: Vec<i64> = of_shape
            .iter()
            .flat_map(|cell| mesh.cell(*cell))
            .map(|node| i64::from(*node))
            .collect();
        let nodes = Array2::from_shape_vec((of_shape.len(), kept), nodes);
        let nodes = nodes
            .map_err(|error| Fault::Solve(error.to_string()))?
            .into_pyarray(py);
        let regions: Array1<i64> = of_shape
            .iter()
            .map(|cell| i64::try_from(mesh.region_of(*cell)).unwrap_or(i64::MAX))
            .collect();
        cells.append((name, nodes, regions.into_pyarray(py)))?;
    }
    let found = PyDict::new(py);
    found.set_item(
        "points",
        points
            .map_err(|error| Fault::Solve(error.to_string()))?
            .into_pyarray(py),
    )?;
    found.set_item("cells", cells)?;
    found.set_item("regions", mesh.regions.clone())?;
    Ok(found)
}

fn wrong(error: ProblemError) -> PyErr {
    value_error(error.to_string())
}

/// A body with its supports and loads.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Problem {
    solver: Mutex<Solver>,
    parameters: Vec<(String, Parameter)>,
}

#[pymethods]
impl Problem {
    /// `supports`: surface, component and the parameter that moves it; `pressures`: surface and
    /// parameter.
    #[new]
    fn new(
        py: Python<'_>,
        mesh: &Mesh,
        kinematics: &str,
        materials: Vec<Solid>,
        supports: Vec<(String, usize, Option<String>)>,
        pressures: Vec<(String, String)>,
    ) -> PyResult<Self> {
        let kinematics = match kinematics {
            "plane_strain" => Kinematics::PlaneStrain,
            "axisymmetric" => Kinematics::Axisymmetric,
            "solid" => Kinematics::Solid,
            other => {
                return Err(value_error(format!(
                    "kinematics: {other:?} is not one of plane_strain, axisymmetric, solid"
                )));
            }
        };
        let mut posed = Posed::new(mesh.cells.clone(), kinematics).map_err(wrong)?;
        posed.materials = materials.iter().map(material).collect::<PyResult<_>>()?;
        let mut parameters: Vec<(String, Parameter)> = Vec::new();
        let mut parameter = |posed: &mut Posed, name: &str| {
            let known = parameters.iter().find(|(known, _)| known == name);
            if let Some((_, parameter)) = known {
                return *parameter;
            }
            let made = posed.parameter(name, Rule::Given);
            parameters.push((name.to_owned(), made));
            made
        };
        for (surface, component, moved) in &supports {
            let motion = match moved {
                None => Motion::Fixed,
                Some(name) => Motion::Driven(parameter(&mut posed, name), 1.0),
            };
            posed.support(surface, *component, motion).map_err(wrong)?;
        }
        for (name, by) in &pressures {
            let surface = posed.surface(name).map_err(wrong)?;
            let parameter = parameter(&mut posed, by);
            posed.pressures.push(Pressure { surface, parameter });
        }
        posed.check().map_err(wrong)?;
        let solver = pool::run(py, |_| Ok(Solver::new(posed)?))?;
        Ok(Self {
            solver: Mutex::new(solver),
            parameters,
        })
    }

    /// Names of the parameters in the order in which they are solved.
    fn parameters(&self) -> Vec<String> {
        let names = self.parameters.iter();
        names.map(|(name, _)| name.clone()).collect()
    }

    /// Loads to these parameters in adaptive steps.
    fn solve(&self, py: Python<'_>, targets: Vec<f64>) -> PyResult<()> {
        if targets.len() != self.parameters.len() {
            return Err(value_error("solve: one number for each parameter"));
        }
        pool::run(py, |request: Request<'_>| {
            let mut solver = self.solver.lock().unwrap_or_else(PoisonError::into_inner);
            let flag = request.flag();
            solver.stop_when(move || flag.load(Ordering::Relaxed));
            solver.load_to(&targets, |_, _| Continue::Yes)?;
            Ok(())
        })
    }

    /// Displacement of each point: points x 3.
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let solver = self.solver.lock().unwrap_or_else(PoisonError::into_inner);
        table(py, &solver.state().displacement)
    }

    /// Cauchy stress 11, 22, 33, 12, 23, 13 at each point, and von Mises'.
    #[allow(clippy::type_complexity, reason = "two arrays")]
    fn stress<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
        let stress = pool::run(py, |_| {
            let solver = self.solver.lock().unwrap_or_else(PoisonError::into_inner);
            Ok(nodal_stress(solver.problem(), solver.state()))
        })?;
        let single: Vec<f64> = stress.iter().map(|one| von_mises(*one)).collect();
        Ok((table(py, &stress)?, single.into_pyarray(py)))
    }

    /// Force that holds the points of a surface, summed.
    fn reaction(&self, surface: &str) -> PyResult<[f64; 3]> {
        let mut solver = self.solver.lock().unwrap_or_else(PoisonError::into_inner);
        let components = solver.problem().kinematics.components();
        let mesh = &solver.problem().mesh;
        let nodes = mesh.nodes_of(surface).ok_or_else(|| {
            let known: Vec<&str> = mesh
                .surfaces
                .keys()
                .chain(mesh.node_sets.keys())
                .map(String::as_str)
                .collect();
            value_error(format!(
                "the mesh has no surface {surface:?}; it has {}",
                known.join(", ")
            ))
        })?;
        let found = solver.evaluate().map_err(Fault::from)?;
        let mut sum = [0.0; 3];
        for node in nodes {
            for (i, sum) in sum.iter_mut().take(components).enumerate() {
                *sum += found.forces[node as usize * components + i];
            }
        }
        Ok(sum)
    }
}

/// Rows of numbers as an array.
fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: &[[f64; N]],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let values: Vec<f64> = rows.iter().flatten().copied().collect();
    let values = Array2::from_shape_vec((rows.len(), N), values)
        .map_err(|error| Fault::Solve(error.to_string()))?;
    Ok(values.into_pyarray(py))
}

/// Where a field is solved, as Python gives it.
struct Place<'a> {
    domain: Domain<'a>,
    coefficients: Vec<(&'a str, Coefficient)>,
}

fn place<'a>(
    mesh: &'a Mesh,
    geometry: &str,
    coefficients: &'a [(String, f64)],
    displacement: Option<&'a [[f64; 3]]>,
) -> PyResult<Place<'a>> {
    let geometry = match geometry {
        "plane" => Geometry::Plane,
        "axisymmetric" => Geometry::Axisymmetric,
        "solid" => Geometry::Solid,
        other => {
            return Err(value_error(format!(
                "geometry: {other:?} is not one of plane, axisymmetric, solid"
            )));
        }
    };
    let motion = displacement.map_or(MeshMotion::None, MeshMotion::Moved);
    let coefficients = coefficients.iter();
    Ok(Place {
        domain: Domain {
            mesh: &mesh.cells,
            geometry,
            motion,
            exterior: None,
        },
        coefficients: coefficients
            .map(|(name, value)| (name.as_str(), Coefficient::Scalar(*value)))
            .collect(),
    })
}

fn moved(
    mesh: &Mesh,
    displacement: Option<PyReadonlyArray2<'_, f64>>,
) -> PyResult<Option<Vec<[f64; 3]>>> {
    let Some(displacement) = displacement else {
        return Ok(None);
    };
    let displacement = displacement.as_array();
    let needed = [mesh.cells.points.len(), 3];
    if displacement.shape() != needed {
        return Err(value_error(format!(
            "displacement: has the shape {:?}; the mesh with all its points needs {needed:?}",
            displacement.shape()
        )));
    }
    if let Some(wrong) = displacement.iter().find(|one| !one.is_finite()) {
        return Err(value_error(format!("displacement: {wrong} is no length")));
    }
    let rows = displacement.rows().into_iter();
    Ok(Some(rows.map(|row| [row[0], row[1], row[2]]).collect()))
}

fn unsolved(error: FieldError) -> Fault {
    Fault::Solve(error.to_string())
}

/// Maxwell's matrix of conductors by energy and by flux, and the potentials.
#[pyfunction]
#[pyo3(signature = (mesh, geometry, permittivities, conductors, zero, floating, displacement = None))]
#[allow(
    clippy::too_many_arguments,
    reason = "they stand in the class of Python"
)]
pub(crate) fn capacitance<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    geometry: &str,
    permittivities: Vec<(String, f64)>,
    conductors: Vec<String>,
    zero: Vec<String>,
    floating: Vec<String>,
    displacement: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let displacement = moved(mesh, displacement)?;
    let place = place(mesh, geometry, &permittivities, displacement.as_deref())?;
    let [conductors, zero, floating] = [&conductors, &zero, &floating]
        .map(|names| names.iter().map(String::as_str).collect::<Vec<_>>());
    let found = pool::run(py, |_| {
        let posed = Electrostatics {
            domain: place.domain,
            permittivities: &place.coefficients,
            conductors: &conductors,
            floating: &floating,
            zero: &zero,
            infinity: Infinity::Free,
        };
        posed.capacitance().map_err(unsolved)
    })?;
    let given = PyDict::new(py);
    for (name, rows) in [
        ("matrix", found.matrix),
        ("by_flux", found.by_flux),
        ("potentials", found.potentials),
    ] {
        let width = rows.first().map_or(0, Vec::len);
        let count = rows.len();
        let rows = Array2::from_shape_vec((count, width), rows.concat())
            .map_err(|error| Fault::Solve(error.to_string()))?;
        given.set_item(name, rows.into_pyarray(py))?;
    }
    Ok(given)
}

/// Resistance between two surfaces by power and by flux, and the potential at 1 V.
#[pyfunction]
#[pyo3(signature = (mesh, geometry, conductivities, ends, displacement = None))]
pub(crate) fn resistance<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    geometry: &str,
    conductivities: Vec<(String, f64)>,
    ends: [String; 2],
    displacement: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<(f64, f64, Bound<'py, PyArray1<f64>>)> {
    let displacement = moved(mesh, displacement)?;
    let place = place(mesh, geometry, &conductivities, displacement.as_deref())?;
    let found = pool::run(py, |_| {
        let posed = Conduction {
            domain: place.domain,
            conductivities: &place.coefficients,
            from: &ends[0],
            to: &ends[1],
        };
        posed.resistance().map_err(unsolved)
    })?;
    Ok((
        found.by_power,
        found.by_flux,
        found.potential.into_pyarray(py),
    ))
}
