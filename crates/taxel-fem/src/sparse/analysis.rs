//! Symbolic factorisation of a pattern, once for all values: the tree of fronts, their
//! rows, and where everything stands.

use std::ops::Range;

use super::Pattern;
use super::tiles::SIDE;

/// Unknowns that are eliminated together, with the rows that they act on.
#[derive(Clone, Debug)]
pub(super) struct Front {
    /// Number of unknowns.
    pub(super) width: usize,
    /// First one of [`Analysis::indices`], and of [`Analysis::places`].
    first: usize,
    height: usize,
    /// First column of the factor.
    pub(super) values: usize,
    /// First column of what the front leaves to its parent, in its stack.
    pub(super) update: usize,
    /// In which of both stacks.
    pub(super) stack: usize,
    /// Number of its branch; [`TOP`] above all branches.
    pub(super) branch: u32,
    /// Range of [`Analysis::children`].
    children: (usize, usize),
}

impl Front {
    /// Strips of 8 rows of the triangle.
    #[inline(always)]
    pub(super) fn pivot_strips(&self) -> usize {
        self.width.div_ceil(SIDE)
    }

    /// Rows below the triangle.
    #[inline(always)]
    pub(super) fn rows(&self) -> usize {
        self.height - self.width
    }

    /// Strips of 8 rows below the triangle.
    #[inline(always)]
    pub(super) fn row_strips(&self) -> usize {
        self.rows().div_ceil(SIDE)
    }

    /// Columns of 8 rows of the factor.
    #[inline(always)]
    pub(super) fn size(&self) -> usize {
        (self.pivot_strips() + self.row_strips()) * self.width
    }

    /// Columns of 8 rows of what is left to the parent.
    #[inline(always)]
    pub(super) fn update_size(&self) -> usize {
        triangle(self.row_strips())
    }
}

/// Columns of the tiles of so many strips of a lower half.
#[inline(always)]
pub(super) const fn triangle(strips: usize) -> usize {
    strips * (strips + 1) / 2 * SIDE
}

/// Number of the fronts above all branches.
pub(super) const TOP: u32 = u32::MAX;

/// Fronts that are worked through by themselves, with stacks of their own: a branch of the tree
/// with all below it, or what is above all branches.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    /// Its fronts; of the top all fronts, of which those of branches are passed over.
    pub(super) fronts: Range<usize>,
    /// Greatest size of both stacks.
    pub(super) stacks: [usize; 2],
    /// Size of its greatest front, and strips of its widest one.
    pub(super) largest: usize,
    pub(super) widest: usize,
}

/// The tree of fronts.
#[derive(Clone, Debug, Default)]
pub(super) struct Analysis {
    /// Children before their parents.
    pub(super) fronts: Vec<Front>,
    indices: Vec<u32>,
    places: Vec<u32>,
    children: Vec<u32>,
    /// Columns of 8 rows of the whole factor.
    pub(super) values: usize,
    /// Branches that several threads work through at once; the greatest work first.
    pub(super) branches: Vec<Part>,
    /// What is above them: without branches, all.
    pub(super) top: Part,
}

impl Analysis {
    /// Unknowns of a front, and rows below.
    #[inline(always)]
    pub(super) fn indices(&self, front: &Front) -> (&[u32], &[u32]) {
        self.indices[front.first..][..front.height].split_at(front.width)
    }

    /// Where the rows below a front stand in its parent: its unknowns come first, its
    /// rows after the strips of the unknowns.
    #[inline(always)]
    pub(super) fn places(&self, front: &Front) -> &[u32] {
        &self.places[front.first + front.width..front.first + front.height]
    }

    /// Numbers of the children of a front.
    #[inline(always)]
    pub(super) fn children(&self, front: &Front) -> &[u32] {
        &self.children[front.children.0..front.children.1]
    }

    /// For so many threads.
    pub(super) fn of(pattern: &Pattern, threads: usize) -> Self {
        let mut drafts = Drafts::of(pattern);
        drafts.merge();
        let mut analysis = drafts.in_order(pattern.size());
        analysis.divide(threads);
        analysis
    }

    /// Chooses the branches for so many threads, and the places in the stacks.
    fn divide(&mut self, threads: usize) {
        let own: Vec<f64> = self
            .fronts
            .iter()
            .map(|front| work((front.width, front.rows())))
            .collect();
        // Of all that is below, and the first front of it.
        let mut whole = own.clone();
        let mut first: Vec<usize> = (0..own.len()).collect();
        let mut inner = vec![false; own.len()];
        for number in 0..own.len() {
            for &child in self.children(&self.fronts[number]) {
                whole[number] += whole[child as usize];
                first[number] = first[number].min(first[child as usize]);
                inner[child as usize] = true;
            }
        }
        let mut roots: Vec<usize> = (0..own.len()).filter(|&front| !inner[front]).collect();
        let total: f64 = own.iter().sum();
        let mut best = (total, Vec::new());
        if threads > 1 && total > WORTH {
            let mut top = 0.0;
            loop {
                roots.sort_by(|&a, &b| whole[b].total_cmp(&whole[a]));
                let time = top + longest(roots.iter().map(|&root| whole[root]), threads);
                if time < best.0 {
                    best = (time, roots.clone());
                }
                if roots.len() > BRANCHES * threads || whole[roots[0]] < total / SMALLEST {
                    break;
                }
                let split = roots.remove(0);
                let front = &self.fronts[split];
                // Of the triangle a panel is eliminated alone, with what is left of it.
                let share = (1.5 * PANEL as f64 / front.pivot_strips() as f64).min(1.0);
                let alone = work((front.width, 0)) * share;
                top += alone + (own[split] - alone) / threads as f64;
                roots.extend(self.children(front).iter().map(|&child| child as usize));
                if roots.is_empty() {
                    break;
                }
            }
        }
        for (number, &root) in best.1.iter().enumerate() {
            let fronts = first[root]..root + 1;
            for front in &mut self.fronts[fronts.clone()] {
                front.branch = number as u32;
            }
            let part = self.part(fronts, number as u32);
            self.branches.push(part);
        }
        self.top = self.part(0..self.fronts.len(), TOP);
    }

    /// Puts what the fronts of a part leave on its stacks.
    fn part(&mut self, fronts: Range<usize>, branch: u32) -> Part {
        let mut part = Part {
            fronts: fronts.clone(),
            ..Part::default()
        };
        let mut tops = [0; 2];
        for number in fronts {
            if self.fronts[number].branch != branch {
                continue;
            }
            let front = &mut self.fronts[number];
            let stack = front.stack;
            front.update = tops[stack];
            tops[stack] += front.update_size();
            part.stacks[stack] = part.stacks[stack].max(tops[stack]);
            part.largest = part.largest.max(front.size());
            part.widest = part.widest.max(front.pivot_strips());
            let front = &self.fronts[number];
            for &child in self.children(front) {
                let child = &self.fronts[child as usize];
                if child.branch == branch {
                    tops[1 - stack] -= child.update_size();
                }
            }
        }
        part
    }
}

/// Work of all fronts from which on branches are shared among threads: about 5 ms.
const WORTH: f64 = 1e7;
/// Strips that one thread eliminates before all threads solve the rows below with them; a
/// multiple of three.
pub(super) const PANEL: usize = 18;
/// Branches for each thread, at most.
const BRANCHES: usize = 8;
/// No branch of a smaller share of all work is divided.
const SMALLEST: f64 = 16.0;

/// Time of the busiest thread that takes works, the greatest first, whenever it is free.
fn longest(works: impl Iterator<Item = f64>, threads: usize) -> f64 {
    let mut busy = vec![0.0; threads];
    for work in works {
        busy.sort_by(f64::total_cmp);
        busy[0] += work;
    }
    busy.into_iter().fold(0.0, f64::max)
}

const NONE: u32 = u32::MAX;

/// Parent of each column in the tree of elimination.
fn parents(pattern: &Pattern) -> Vec<u32> {
    let upper = pattern.transposed();
    let mut parents = vec![NONE; pattern.size()];
    // Short cuts towards the roots.
    let mut above = parents.clone();
    for row in 0..pattern.size() {
        for entry in upper.column(row) {
            let mut column = upper.rows[entry] as usize;
            while column < row {
                let next = std::mem::replace(&mut above[column], row as u32);
                if next == NONE {
                    parents[column] = row as u32;
                    break;
                }
                column = next as usize;
            }
        }
    }
    parents
}

/// Fronts while they are made.
#[derive(Default)]
struct Drafts {
    columns: Vec<Vec<u32>>,
    rows: Vec<Vec<u32>>,
    children: Vec<Vec<u32>>,
    parent: Vec<u32>,
}

impl Drafts {
    /// Neighbouring columns with the same rows, and no other child, are one front.
    fn of(pattern: &Pattern) -> Self {
        let n = pattern.size();
        let parents = parents(pattern);
        let mut count = vec![0u32; n];
        for &parent in parents.iter().filter(|&&parent| parent != NONE) {
            count[parent as usize] += 1;
        }
        let mut drafts = Self::default();
        let mut front_of = vec![NONE; n];
        let mut seen = vec![NONE; n];
        // Fronts by the column that they act on first.
        let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); n];
        for column in 0..n {
            let own = &pattern.rows[pattern.column(column)];
            let last = (drafts.columns.len() as u32).wrapping_sub(1);
            let follows = column > 0 && parents[column - 1] == column as u32;
            if follows && count[column] == 1 && own.iter().all(|&row| seen[row as usize] == last) {
                drafts.columns[last as usize].push(column as u32);
                front_of[column] = last;
                continue;
            }
            if column > 0 && parents[column - 1] != NONE {
                waiting[parents[column - 1] as usize].push(last);
            }
            let number = drafts.columns.len() as u32;
            let children = std::mem::take(&mut waiting[column]);
            let below = children.iter().flat_map(|&c| &drafts.rows[c as usize]);
            let mut rows = Vec::new();
            seen[column] = number;
            for &row in own.iter().chain(below) {
                if row as usize > column && seen[row as usize] != number {
                    seen[row as usize] = number;
                    rows.push(row);
                }
            }
            drafts.columns.push(vec![column as u32]);
            drafts.rows.push(rows);
            drafts.children.push(children);
            front_of[column] = number;
        }
        for (columns, rows) in drafts.columns.iter().zip(&mut drafts.rows) {
            let last = columns[columns.len() - 1];
            rows.retain(|&row| row > last);
            let parent = parents[last as usize];
            let front = front_of.get(parent as usize).copied();
            drafts.parent.push(front.unwrap_or(NONE));
        }
        drafts
    }

    /// Joins children with their parent where one larger front is less work.
    fn merge(&mut self) {
        for parent in 0..self.columns.len() {
            let mut children = std::mem::take(&mut self.children[parent]);
            let mut kept = Vec::new();
            children.sort_by_key(|&child| self.rows[child as usize].len());
            while let Some(child) = children.pop() {
                let size = |front: usize| (self.columns[front].len(), self.rows[front].len());
                let (own, other) = (size(parent), size(child as usize));
                let joined = (own.0 + other.0, own.1);
                if work(joined) > work(own) + work(other) {
                    kept.push(child);
                    continue;
                }
                let mut columns = std::mem::take(&mut self.columns[child as usize]);
                columns.append(&mut self.columns[parent]);
                self.columns[parent] = columns;
                self.rows[child as usize].clear();
                for &grandchild in &self.children[child as usize] {
                    self.parent[grandchild as usize] = parent as u32;
                }
                kept.append(&mut self.children[child as usize]);
            }
            self.children[parent] = kept;
        }
    }

    /// Numbers the fronts, children first, and finds the places of everything.
    fn in_order(&self, unknowns: usize) -> Analysis {
        let order = self.order();
        let mut rank = vec![0u32; unknowns];
        let mut number_of = vec![NONE; self.columns.len()];
        let mut next = 0;
        for (number, &(draft, _)) in order.iter().enumerate() {
            number_of[draft as usize] = number as u32;
            for &column in &self.columns[draft as usize] {
                rank[column as usize] = next;
                next += 1;
            }
        }
        let mut analysis = Analysis::default();
        for &(draft, level) in &order {
            let (columns, rows) = (&self.columns[draft as usize], &self.rows[draft as usize]);
            let first = analysis.indices.len();
            analysis.indices.extend(columns);
            analysis.indices.extend(rows);
            analysis.indices[first + columns.len()..]
                .sort_unstable_by_key(|&row| rank[row as usize]);
            let begin = analysis.children.len();
            let children = self.children[draft as usize].iter();
            analysis
                .children
                .extend(children.map(|&child| number_of[child as usize]));
            let front = Front {
                width: columns.len(),
                first,
                height: columns.len() + rows.len(),
                values: analysis.values,
                update: 0,
                stack: level % 2,
                branch: TOP,
                children: (begin, analysis.children.len()),
            };
            analysis.values += front.size();
            analysis.fronts.push(front);
        }
        analysis.find_places(unknowns);
        analysis
    }

    /// Fronts with their level in the tree, children before parents, those of a parent
    /// right before it: what they leave behind is a stack.
    fn order(&self) -> Vec<(u32, usize)> {
        let mut order = Vec::new();
        let alive = |front: &usize| !self.columns[*front].is_empty();
        let roots = (0..self.columns.len()).filter(|&front| self.parent[front] == NONE);
        let mut open: Vec<(u32, usize)> =
            roots.filter(alive).map(|front| (front as u32, 0)).collect();
        // Parents first and turned round.
        while let Some((front, level)) = open.pop() {
            order.push((front, level));
            let children = self.children[front as usize].iter();
            open.extend(children.map(|&child| (child, level + 1)));
        }
        order.reverse();
        order
    }
}

impl Analysis {
    fn find_places(&mut self, unknowns: usize) {
        self.places = vec![0; self.indices.len()];
        let mut local = vec![0u32; unknowns];
        for front in &self.fronts {
            let (columns, rows) = self.indices(front);
            let below = (front.pivot_strips() * SIDE) as u32;
            for (number, &column) in columns.iter().enumerate() {
                local[column as usize] = number as u32;
            }
            for (number, &row) in rows.iter().enumerate() {
                local[row as usize] = below + number as u32;
            }
            for &child in &self.children[front.children.0..front.children.1] {
                let child = &self.fronts[child as usize];
                for at in child.first + child.width..child.first + child.height {
                    self.places[at] = local[self.indices[at] as usize];
                }
            }
        }
    }
}

/// About how long a front takes, in products of eight numbers with one.
fn work((width, rows): (usize, usize)) -> f64 {
    let (width, rows) = (width as f64, rows as f64);
    let height = width + rows;
    let squares = |n: f64| n * (n + 1.0) * (2.0 * n + 1.0) / 6.0;
    let products = (squares(height) - squares(rows)) / 16.0;
    products + UPDATE * rows * rows / 2.0 + ENTRY * width * height + FRONT
}

/// Work of an entry left to the parent, of an entry of the factor, and of a front.
const UPDATE: f64 = 4.0;
const ENTRY: f64 = 3.0;
const FRONT: f64 = 700.0;
