//! Which displacements are unknown, their numbers, and where their products stand in
//! the matrix.

use super::kernel::{MAX_NODES, NodeBlocks};
use crate::sparse::Pattern;
use crate::sparse::ordering::{Graph, elimination_order};

/// Numbers of the unknowns. Nodes are numbered in the order of elimination, so that
/// the matrix needs no permutation; the free components of a node follow each other.
#[derive(Clone, Debug)]
pub struct Unknowns {
    components: usize,
    /// First unknown of each node.
    first: Vec<u32>,
    /// Free components of each node, one bit each.
    free: Vec<u8>,
    count: usize,
    /// Where the matrix has entries.
    pub pattern: Pattern,
}

impl Unknowns {
    /// Numbers the free components of the nodes.
    ///
    /// `held` says whether a component of a node is not unknown; `groups` are the
    /// nodes that act on each other.
    pub fn new<'g>(
        points: &[[f64; 3]],
        components: usize,
        held: impl Fn(u32, usize) -> bool,
        groups: impl Iterator<Item = &'g [u32]> + Clone,
    ) -> Self {
        let mut used = vec![false; points.len()];
        for &node in groups.clone().flatten() {
            used[node as usize] = true;
        }
        let free: Vec<u8> = (0..points.len() as u32)
            .map(|node| {
                (0..components)
                    .filter(|&i| used[node as usize] && !held(node, i))
                    .fold(0, |mask, i| mask | 1 << i)
            })
            .collect();
        let graph = Graph::of_groups(points.len(), |node| free[node as usize] != 0, groups);
        let nodes: Vec<u32> = (0..points.len() as u32)
            .filter(|&node| free[node as usize] != 0)
            .collect();
        let order = if nodes.is_empty() {
            Vec::new()
        } else {
            elimination_order(&graph, points, nodes)
        };
        let mut first = vec![u32::MAX; points.len()];
        let mut count = 0;
        for &node in &order {
            first[node as usize] = count;
            count += free[node as usize].count_ones();
        }
        let pattern = pattern(&graph, &order, &first, &free);
        Self {
            components,
            first,
            free,
            count: count as usize,
            pattern,
        }
    }

    /// Number of unknowns.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Components of displacement of a node.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Number of an unknown; none where the component is held.
    #[inline]
    pub fn of(&self, node: u32, component: usize) -> Option<usize> {
        let free = self.free[node as usize];
        (free & (1 << component) != 0)
            .then(|| self.first[node as usize] as usize + rank(free, component))
    }

    /// Place in the values of the matrix of a pair of unknowns that act on each other.
    pub fn entry(&self, one: usize, other: usize) -> Option<usize> {
        let (row, column) = (one.max(other), one.min(other));
        let entries = self.pattern.column(column);
        let rows = &self.pattern.rows[entries.clone()];
        rows.binary_search(&(row as u32))
            .ok()
            .map(|at| entries.start + at)
    }

    /// Places of the pairs of nodes of a group, for [`Self::scatter`].
    pub fn places(&self, nodes: &[u32]) -> Vec<u32> {
        let mut places = Vec::with_capacity(nodes.len() * (nodes.len() + 1) / 2);
        for (a, &one) in nodes.iter().enumerate() {
            for &other in &nodes[..=a] {
                places.push(self.place(one, other));
            }
        }
        places
    }

    /// Local numbers of the nodes of a cell in the order of elimination.
    #[inline]
    fn in_order(&self, nodes: &[u32]) -> [u8; MAX_NODES] {
        let mut order = [0; MAX_NODES];
        for (local, &node) in nodes.iter().enumerate() {
            let first = self.first[node as usize];
            let mut at = local;
            while at > 0 && self.first[nodes[usize::from(order[at - 1])] as usize] > first {
                order[at] = order[at - 1];
                at -= 1;
            }
            order[at] = local as u8;
        }
        order
    }

    /// Places of the pairs of nodes of a cell, for [`Self::scatter_cell`].
    pub fn cell_places(&self, nodes: &[u32]) -> Vec<u32> {
        let order = self.in_order(nodes);
        let order = &order[..nodes.len()];
        let mut places = Vec::with_capacity(nodes.len() * (nodes.len() + 1) / 2);
        for (number, &column) in order.iter().enumerate() {
            for &row in &order[number..] {
                places.push(self.place(nodes[usize::from(row)], nodes[usize::from(column)]));
            }
        }
        places
    }

    /// Adds the tangent of a cell of `C` components at its places.
    pub fn scatter_cell<const C: usize>(
        &self,
        nodes: &[u32],
        places: &[u32],
        values: &mut [f64],
        blocks: &NodeBlocks<'_>,
    ) {
        let order = self.in_order(nodes);
        let order = &order[..nodes.len()];
        let all = (1u8 << C) - 1;
        let mut places = places;
        for (number, &column) in order.iter().enumerate() {
            let column_node = nodes[usize::from(column)] as usize;
            let first = self.first[column_node] as usize;
            let columns = self.free[column_node];
            if columns == 0 {
                // Nodes without unknowns come last.
                return;
            }
            let (own, rest) = places.split_at(order.len() - number);
            places = rest;
            for (&row, &place) in order[number..].iter().zip(own) {
                if place == u32::MAX {
                    continue;
                }
                let rows = self.free[nodes[usize::from(row)] as usize];
                let entries = blocks.between(usize::from(row), usize::from(column));
                let whole = rows == all && columns == all;
                for j in 0..C {
                    if !whole && columns & (1 << j) == 0 {
                        continue;
                    }
                    let rank_j = if whole { j } else { rank(columns, j) };
                    let start = self.pattern.column_starts[first + rank_j] as usize
                        + place as usize
                        - rank_j;
                    if whole && row != column {
                        let run = &mut values[start..start + C];
                        for i in 0..C {
                            run[i] += entries[i][j];
                        }
                        continue;
                    }
                    let from = if row == column { j } else { 0 };
                    for i in from..C {
                        if rows & (1 << i) != 0 {
                            values[start + rank(rows, i)] += entries[i][j];
                        }
                    }
                }
            }
        }
    }

    /// Offset in the column of the earlier node's first unknown of the later one's
    /// first unknown.
    fn place(&self, one: u32, other: u32) -> u32 {
        let (one, other) = (self.first[one as usize], self.first[other as usize]);
        if one == u32::MAX || other == u32::MAX {
            return u32::MAX;
        }
        let (row, column) = (one.max(other), one.min(other));
        let entries = self.pattern.column(column as usize);
        self.pattern.rows[entries]
            .binary_search(&row)
            .map_or(u32::MAX, |at| at as u32)
    }

    /// Adds the symmetric matrix of a group of nodes at its places:
    /// `of(i, a, j, b)` is the entry between component `i` of local node `a` and
    /// component `j` of local node `b`.
    #[inline(always)]
    pub fn scatter(
        &self,
        nodes: &[u32],
        places: &[u32],
        values: &mut [f64],
        of: impl Fn(usize, usize, usize, usize) -> f64,
    ) {
        let all = (1u8 << self.components) - 1;
        let mut number = 0;
        for (a, &one) in nodes.iter().enumerate() {
            let first_one = self.first[one as usize];
            for (b, &other) in nodes[..=a].iter().enumerate() {
                let place = places[number];
                number += 1;
                if place == u32::MAX {
                    continue;
                }
                let first_other = self.first[other as usize];
                // Rows belong to the node that is eliminated later.
                let (row, column, row_node, column_node) = if first_one >= first_other {
                    (a, b, one, other)
                } else {
                    (b, a, other, one)
                };
                let rows = self.free[row_node as usize];
                let columns = self.free[column_node as usize];
                let first_column = self.first[column_node as usize] as usize;
                let whole = rows == all && columns == all;
                for j in 0..self.components {
                    if !whole && columns & (1 << j) == 0 {
                        continue;
                    }
                    let rank_j = if whole { j } else { rank(columns, j) };
                    let start = self.pattern.column_starts[first_column + rank_j] as usize
                        + place as usize
                        - rank_j;
                    let from = if a == b { j } else { 0 };
                    for i in from..self.components {
                        if !whole && rows & (1 << i) == 0 {
                            continue;
                        }
                        let rank_i = if whole { i } else { rank(rows, i) };
                        values[start + rank_i] += of(i, row, j, column);
                    }
                }
            }
        }
    }
}

/// Free components before this one.
#[inline(always)]
fn rank(free: u8, component: usize) -> usize {
    (free & ((1 << component) - 1)).count_ones() as usize
}

fn pattern(graph: &Graph, order: &[u32], first: &[u32], free: &[u8]) -> Pattern {
    let mut pattern = Pattern {
        column_starts: vec![0],
        rows: Vec::new(),
    };
    let mut later = Vec::new();
    for &node in order {
        let own = first[node as usize];
        later.clear();
        for &other in graph.of(node) {
            let start = first[other as usize];
            if start != u32::MAX && start > own {
                later.extend(start..start + free[other as usize].count_ones());
            }
        }
        later.sort_unstable();
        let end = own + free[node as usize].count_ones();
        for column in own..end {
            pattern.rows.extend(column..end);
            pattern.rows.extend_from_slice(&later);
            pattern.column_starts.push(pattern.rows.len() as u32);
        }
    }
    pattern
}
