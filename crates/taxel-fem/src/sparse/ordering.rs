//! In which order the nodes are eliminated: once for a mesh, on the graph of its
//! nodes. Minimum degree in the plane, nested dissection in space, where it needs
//! less than half of the operations.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Neighbours of each node, ascending, without itself.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// The graph in which the nodes of each group are all neighbours of each other;
    /// nodes that are not `active` have none.
    pub fn of_groups<'g>(
        nodes: usize,
        active: impl Fn(u32) -> bool,
        groups: impl Iterator<Item = &'g [u32]> + Clone,
    ) -> Self {
        // Which groups hold a node.
        let mut starts = vec![0u32; nodes + 1];
        for &node in groups.clone().flatten() {
            starts[node as usize + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let mut next = starts.clone();
        let mut holders = vec![0u32; *starts.last().unwrap_or(&0) as usize];
        let lists: Vec<&[u32]> = groups.collect();
        for (number, list) in lists.iter().enumerate() {
            for &node in *list {
                holders[next[node as usize] as usize] = number as u32;
                next[node as usize] += 1;
            }
        }
        let mut graph = Self {
            starts: vec![0],
            neighbours: Vec::new(),
        };
        let mut seen = vec![u32::MAX; nodes];
        for node in 0..nodes as u32 {
            if active(node) {
                let first = graph.neighbours.len();
                let held = starts[node as usize] as usize..starts[node as usize + 1] as usize;
                for &holder in &holders[held] {
                    for &other in lists[holder as usize] {
                        if other != node && active(other) && seen[other as usize] != node {
                            seen[other as usize] = node;
                            graph.neighbours.push(other);
                        }
                    }
                }
                graph.neighbours[first..].sort_unstable();
            }
            graph.starts.push(graph.neighbours.len() as u32);
        }
        graph
    }

    /// Neighbours of a node.
    pub fn of(&self, node: u32) -> &[u32] {
        &self.neighbours
            [self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize]
    }

    /// Number of nodes.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }
}

/// Nodes in the order of elimination.
pub fn elimination_order(graph: &Graph, points: &[[f64; 3]], nodes: Vec<u32>) -> Vec<u32> {
    let flat = nodes
        .iter()
        .all(|&node| points[node as usize][2] == points[nodes[0] as usize][2]);
    if flat {
        return minimum_degree(graph, &nodes);
    }
    let mut side = vec![Side::None; graph.size()];
    let mut order = Vec::with_capacity(nodes.len());
    dissect(graph, points, nodes, &mut side, &mut order);
    order
}

/// Minimum degree on the part of the graph between these nodes.
fn minimum_degree(graph: &Graph, nodes: &[u32]) -> Vec<u32> {
    let mut local = vec![u32::MAX; graph.size()];
    for (number, &node) in nodes.iter().enumerate() {
        local[node as usize] = number as u32;
    }
    let mut starts = vec![0u32];
    let mut rows = Vec::new();
    for &node in nodes {
        let first = rows.len();
        rows.push(local[node as usize]);
        rows.extend(
            graph
                .of(node)
                .iter()
                .map(|&other| local[other as usize])
                .filter(|&other| other != u32::MAX),
        );
        rows[first..].sort_unstable();
        starts.push(rows.len() as u32);
    }
    let n = nodes.len();
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
    let (mut forward, mut inverse) = (vec![0u32; n], vec![0u32; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, rows.len()));
    let done = amd::order(
        &mut forward,
        &mut inverse,
        pattern,
        amd::Control::default(),
        MemStack::new(&mut memory),
    );
    match done {
        Ok(_) => forward.iter().map(|&k| nodes[k as usize]).collect(),
        // Any order is right; this one is only slower.
        Err(_) => nodes.to_vec(),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    None,
    Low,
    High,
    Cut,
}

/// Parts of at most so many nodes are left to minimum degree.
const LEAF: usize = 150;

/// Cuts the nodes by a plane across their longest extent; both parts come first, the
/// nodes that separate them last.
fn dissect(
    graph: &Graph,
    points: &[[f64; 3]],
    nodes: Vec<u32>,
    side: &mut [Side],
    order: &mut Vec<u32>,
) {
    if nodes.len() <= LEAF {
        order.extend(minimum_degree_small(graph, &nodes));
        return;
    }
    let Some(separator) = best_cut(graph, points, &nodes, side) else {
        order.extend(minimum_degree_small(graph, &nodes));
        return;
    };
    let (axis, value) = separator;
    let (low, high, cut) = split(graph, points, &nodes, side, axis, value);
    drop(nodes);
    dissect(graph, points, low, side, order);
    dissect(graph, points, high, side, order);
    order.extend(cut);
}

/// Minimum degree of a small part, without tables of the size of the whole graph.
fn minimum_degree_small(graph: &Graph, nodes: &[u32]) -> Vec<u32> {
    let mut sorted = nodes.to_vec();
    sorted.sort_unstable();
    let mut groups = Vec::new();
    for (number, &node) in sorted.iter().enumerate() {
        for other in graph.of(node) {
            if let Ok(other) = sorted.binary_search(other)
                && other > number
            {
                groups.push([number as u32, other as u32]);
            }
        }
    }
    let small = Graph::of_groups(
        sorted.len(),
        |_| true,
        groups.iter().map(<[u32; 2]>::as_slice),
    );
    let all: Vec<u32> = (0..sorted.len() as u32).collect();
    minimum_degree(&small, &all)
        .into_iter()
        .map(|k| sorted[k as usize])
        .collect()
}

/// The plane of the smallest separator among some near the middle.
fn best_cut(
    graph: &Graph,
    points: &[[f64; 3]],
    nodes: &[u32],
    side: &mut [Side],
) -> Option<(usize, f64)> {
    let mut extent = [(f64::INFINITY, f64::NEG_INFINITY); 3];
    for &node in nodes {
        for d in 0..3 {
            let x = points[node as usize][d];
            extent[d] = (extent[d].0.min(x), extent[d].1.max(x));
        }
    }
    let longest = (0..3).fold(0.0_f64, |most, d| most.max(extent[d].1 - extent[d].0));
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..3 {
        if extent[axis].1 - extent[axis].0 < 0.6 * longest {
            continue;
        }
        let mut places: Vec<f64> = nodes.iter().map(|&n| points[n as usize][axis]).collect();
        places.sort_unstable_by(f64::total_cmp);
        let mut tried = f64::NAN;
        for percent in [50, 45, 55, 40, 60] {
            let middle = places[places.len() * percent / 100];
            // The planes of nodes at and just beyond the quantile.
            let beyond = places.partition_point(|&x| x <= middle);
            for value in [Some(middle), places.get(beyond).copied()]
                .into_iter()
                .flatten()
            {
                if value == tried || value <= places[0] {
                    continue;
                }
                tried = value;
                let (low, high, cut) = split(graph, points, nodes, side, axis, value);
                if low.is_empty() || high.is_empty() {
                    continue;
                }
                let balance = low.len().max(high.len()) as f64 / nodes.len() as f64;
                let cost = cut.len() as f64 * (1.0 + 2.0 * (balance - 0.5).max(0.0));
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, value));
                }
            }
        }
    }
    best.map(|(_, axis, value)| (axis, value))
}

/// Nodes below the plane, above it, and those at or above it that touch what is below.
fn split(
    graph: &Graph,
    points: &[[f64; 3]],
    nodes: &[u32],
    side: &mut [Side],
    axis: usize,
    value: f64,
) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
    for &node in nodes {
        side[node as usize] = if points[node as usize][axis] < value {
            Side::Low
        } else {
            Side::High
        };
    }
    for &node in nodes {
        if side[node as usize] == Side::High
            && graph
                .of(node)
                .iter()
                .any(|&n| side[n as usize] == Side::Low)
        {
            side[node as usize] = Side::Cut;
        }
    }
    let (mut low, mut high, mut cut) = (Vec::new(), Vec::new(), Vec::new());
    for &node in nodes {
        match side[node as usize] {
            Side::Low => low.push(node),
            Side::High => high.push(node),
            _ => cut.push(node),
        }
        side[node as usize] = Side::None;
    }
    (low, high, cut)
}
