//! The field between terminals: everything else is eliminated once.
//!
//! With the potentials of the terminals `t` and of the free nodes `f` the system is
//! `[K_ff K_ft; K_tf K_tt]`. The response to terminal `j` at one and the others at
//! zero is `x_j = -K_ff^-1 K_ft e_j`. Its flux through terminal `i`, the sum of the
//! rows of `K phi` over the nodes of `i`, is `K_tt + K_tf x`; the product of the
//! energies of `i` and `j` is `phi_i^T K phi_j`, summed over the cells by itself. Solved
//! exactly they are equal.

use taxel_numerics::dense::dot;

use super::FieldError;
use super::laplace::{Coefficient, Domain};
use super::system::{Entry, System};
use crate::mesh::Parts;
use crate::sparse::ordering::{Graph, elimination_order};

/// Nodes of one potential.
pub(super) struct Terminal {
    pub(super) name: String,
    pub(super) nodes: Vec<u32>,
}

/// Square matrix between the terminals, row first.
pub(super) type Square = Vec<Vec<f64>>;

/// Response of the field at the terminals.
pub(super) struct Response {
    /// From the energies; symmetric, its error is the square of that of the potential.
    pub(super) by_energy: Square,
    /// From the consistent nodal fluxes.
    pub(super) by_flux: Square,
    /// Potential of each node for each terminal at one; zero outside the field.
    pub(super) potentials: Vec<Vec<f64>>,
    /// Flux into each terminal with all other nodes at zero.
    pub(super) stiffness: Vec<f64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// In no cell of the field.
    Absent,
    Zero,
    Terminal(usize),
    Free(u32),
}

/// Entries of the matrix by the roles of their row and column.
struct Blocks {
    free: Vec<Entry>,
    /// Free row, terminal column.
    mixed: Vec<Entry>,
    terminal: Square,
}

/// Solves for each terminal at one with the others, and the nodes `zero`, at zero.
pub(super) fn respond(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    terminals: &[Terminal],
    zero: &Terminal,
) -> Result<Response, FieldError> {
    domain.check()?;
    let (roles, unknowns) = roles(domain, coefficients, terminals, zero)?;
    let blocks = assemble(domain, coefficients, &roles, terminals.len())?;
    let columns = solve(&blocks, unknowns, terminals.len())?;
    let potentials = columns.iter().enumerate();
    let potentials: Vec<_> = potentials
        .map(|(terminal, column)| spread(&roles, terminal, column))
        .collect();
    let by_energy = energies(domain, coefficients, &potentials)?;
    let by_flux = fluxes(&blocks, &columns);
    let stiffness = (0..terminals.len()).map(|t| blocks.terminal[t][t]);
    Ok(Response {
        by_energy,
        by_flux,
        potentials,
        stiffness: stiffness.collect(),
    })
}

fn roles(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    terminals: &[Terminal],
    zero: &Terminal,
) -> Result<(Vec<Role>, usize), FieldError> {
    let mesh = domain.mesh;
    let present = present(domain, coefficients);
    let mut roles = known_roles(domain, terminals, zero)?;
    for terminal in terminals {
        if !terminal.nodes.iter().any(|&node| present[node as usize]) {
            return Err(FieldError::Empty {
                name: terminal.name.clone(),
            });
        }
    }
    let free: Vec<u32> = (0..mesh.points.len())
        .filter(|&node| roles[node] == Role::Absent && present[node])
        .map(|node| node as u32)
        .collect();
    let order = order(domain, coefficients, &roles, free);
    for (place, &node) in order.iter().enumerate() {
        roles[node as usize] = Role::Free(place as u32);
    }
    reached(domain, coefficients, &roles)?;
    Ok((roles, order.len()))
}

/// Free nodes in the order of elimination.
fn order(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    roles: &[Role],
    free: Vec<u32>,
) -> Vec<u32> {
    if free.is_empty() {
        return free;
    }
    let mesh = domain.mesh;
    let cells = (0..mesh.cell_count())
        .filter(|&cell| coefficients[mesh.region_of(cell)].is_some())
        .map(|cell| mesh.cell(cell));
    let active = |node: u32| roles[node as usize] == Role::Absent;
    let graph = Graph::of_groups(mesh.points.len(), active, cells);
    elimination_order(&graph, &mesh.points, free)
}

/// Nodes of cells that carry a field.
fn present(domain: &Domain, coefficients: &[Option<Coefficient>]) -> Vec<bool> {
    let mesh = domain.mesh;
    let mut present = vec![false; mesh.points.len()];
    for cell in 0..mesh.cell_count() {
        if coefficients[mesh.region_of(cell)].is_some() {
            for &node in mesh.cell(cell) {
                present[node as usize] = true;
            }
        }
    }
    present
}

/// Roles of the nodes whose potential is known; no node has two.
fn known_roles(
    domain: &Domain,
    terminals: &[Terminal],
    zero: &Terminal,
) -> Result<Vec<Role>, FieldError> {
    let points = &domain.mesh.points;
    let mut roles = vec![Role::Absent; points.len()];
    let numbered = terminals.iter().enumerate();
    let all = numbered.map(|(number, terminal)| (terminal, Role::Terminal(number)));
    for (terminal, role) in all.chain([(zero, Role::Zero)]) {
        for &node in &terminal.nodes {
            let known = &mut roles[node as usize];
            if let Role::Terminal(first) = *known
                && *known != role
            {
                return Err(FieldError::Touching {
                    first: terminals[first].name.clone(),
                    second: terminal.name.clone(),
                    node,
                    at: points[node as usize],
                });
            }
            *known = role;
        }
    }
    Ok(roles)
}

/// Checks that each connected part of the field has a node of known potential.
fn reached(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    roles: &[Role],
) -> Result<(), FieldError> {
    let mut parts = Parts::of_cells(domain.mesh, |region| coefficients[region].is_some());
    let mut known = vec![false; roles.len()];
    for (node, role) in roles.iter().enumerate() {
        if matches!(role, Role::Zero | Role::Terminal(_)) {
            known[parts.root(node as u32) as usize] = true;
        }
    }
    let mut lost = |&node: &usize| {
        matches!(roles[node], Role::Free(_)) && !known[parts.root(node as u32) as usize]
    };
    let unknowns = (0..roles.len()).filter(&mut lost).count();
    if unknowns == 0 {
        return Ok(());
    }
    Err(FieldError::Undetermined { unknowns })
}

fn assemble(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    roles: &[Role],
    terminals: usize,
) -> Result<Blocks, FieldError> {
    let mut blocks = Blocks {
        free: Vec::new(),
        mixed: Vec::new(),
        terminal: vec![vec![0.0; terminals]; terminals],
    };
    domain.for_each_cell(coefficients, &mut |nodes, matrix| {
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate() {
                let value = matrix[a * nodes.len() + b];
                match (roles[row as usize], roles[column as usize]) {
                    (Role::Free(i), Role::Free(j)) if i >= j => blocks.free.push((i, j, value)),
                    (Role::Free(i), Role::Terminal(t)) => {
                        blocks.mixed.push((i, t as u32, value));
                    }
                    (Role::Terminal(s), Role::Terminal(t)) => blocks.terminal[s][t] += value,
                    _ => {}
                }
            }
        }
    })?;
    Ok(blocks)
}

fn solve(blocks: &Blocks, unknowns: usize, count: usize) -> Result<Vec<Vec<f64>>, FieldError> {
    let mut system = System::new(unknowns, &blocks.free)?;
    (0..count)
        .map(|terminal| {
            let mut right = vec![0.0; unknowns];
            for &(i, t, value) in &blocks.mixed {
                if t as usize == terminal {
                    right[i as usize] -= value;
                }
            }
            system.solve(&right)
        })
        .collect()
}

fn spread(roles: &[Role], terminal: usize, free: &[f64]) -> Vec<f64> {
    roles
        .iter()
        .map(|role| match *role {
            Role::Free(i) => free[i as usize],
            Role::Terminal(t) if t == terminal => 1.0,
            _ => 0.0,
        })
        .collect()
}

fn fluxes(blocks: &Blocks, columns: &[Vec<f64>]) -> Square {
    let mut by_flux = blocks.terminal.clone();
    for &(i, t, value) in &blocks.mixed {
        for (j, column) in columns.iter().enumerate() {
            by_flux[t as usize][j] += value * column[i as usize];
        }
    }
    by_flux
}

/// `phi_i^T K phi_j`, cell by cell. A constant has no energy, so the potentials are taken
/// from that of the first node: what is small in small cells is not lost in rounding.
fn energies(
    domain: &Domain,
    coefficients: &[Option<Coefficient>],
    potentials: &[Vec<f64>],
) -> Result<Square, FieldError> {
    let count = potentials.len();
    let mut energies = vec![vec![0.0; count]; count];
    let mut local = Vec::new();
    domain.for_each_cell(coefficients, &mut |nodes, matrix| {
        let size = nodes.len();
        local.clear();
        for potential in potentials {
            let first = potential[nodes[0] as usize];
            local.extend(nodes.iter().map(|&node| potential[node as usize] - first));
        }
        for i in 0..count {
            let phi = &local[i * size..(i + 1) * size];
            let flux: Vec<f64> = matrix.chunks(size).map(|row| dot(row, phi)).collect();
            for j in 0..=i {
                energies[i][j] += dot(&flux, &local[j * size..(j + 1) * size]);
            }
        }
    })?;
    for i in 0..count {
        for j in 0..i {
            energies[j][i] = energies[i][j];
        }
    }
    Ok(energies)
}
