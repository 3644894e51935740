//! Optimisation: generalised differential evolution for one and for several objectives
//! (GDE3, Kukkonen and Lampinen 2005), then a local polish: of the best design, or of the ends of
//! a front and of the designs between them.

use std::cell::RefCell;
use std::collections::HashMap;

use rand_chacha::ChaCha12Rng;
use taxel::InputError;

use crate::plans::{draw, latin_hypercube, seeded};
use crate::run::Runner;
use crate::store::StoreError;
use crate::study::{Row, Status, Study, Values};
use crate::sweep::point_of;

/// Slack of a constraint, as a share of its limit: what counts as fulfilled.
pub const SLACK: f64 = 1e-6;
/// A constraint is active within this share of its limit, a bound within this share of its
/// range.
const ACTIVE: f64 = 1e-4;
/// Greatest number of evaluations of one local search: four starts at a corner of two constraints
/// took 42 to 46 in two variables.
const POLISH: usize = 150;
/// First radii of the searches for an end of a front: where designs that are not done lie around
/// it, one search alone may stop early.
const RADII: [f64; 2] = [0.02, 0.002];
/// Share of all evaluations that local searches may take.
const POLISH_SHARE: usize = 4;

/// A design with what the optimiser compares.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Share of the way of each variable, 0 to 1.
    pub shares: Vec<f64>,
    /// Its row.
    pub row: Row,
    /// Objectives, to be small.
    pub costs: Vec<f64>,
    /// Sum of the violations beyond the slack; infinite for a design that is not done.
    pub violation: f64,
}

/// Result of an optimisation.
#[derive(Debug, Clone)]
pub struct Optimum {
    /// Designs that no other one dominates, by the first objective; of one objective the best.
    /// Empty where no design fulfils all constraints.
    pub front: Vec<Candidate>,
    /// All other designs of the last population, and for a figure the dominated ones met on
    /// the way.
    pub dominated: Vec<Candidate>,
    /// The design with the least violation, where none fulfils all constraints.
    pub nearest: Option<Candidate>,
    /// Designs that were evaluated.
    pub evaluations: usize,
    /// True if the user stopped it.
    pub stopped: bool,
}

/// A constraint or bound that holds a design.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Active {
    /// A variable at its lower bound.
    Lower(String),
    /// A variable at its upper bound.
    Upper(String),
    /// A constraint.
    Constraint(String),
}

impl std::fmt::Display for Active {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lower(name) => write!(f, "{name} is at its lower bound"),
            Self::Upper(name) => write!(f, "{name} is at its upper bound"),
            Self::Constraint(name) => write!(f, "{name} is active"),
        }
    }
}

/// Constraints and bounds that are active for a design.
pub fn active(study: &Study, candidate: &Candidate) -> Vec<Active> {
    let mut found = Vec::new();
    for (variable, value) in study.variables.iter().zip(&candidate.row.point) {
        if let Values::Range { .. } = variable.values {
            let share = variable.values.share(*value);
            if share <= ACTIVE {
                found.push(Active::Lower(variable.name.clone()));
            } else if share >= 1.0 - ACTIVE {
                found.push(Active::Upper(variable.name.clone()));
            }
        }
    }
    let violations = study.violations(&candidate.row);
    for ((name, _), violation) in study.constraints.iter().zip(violations) {
        if violation.abs() <= ACTIVE {
            found.push(Active::Constraint(name.clone()));
        }
    }
    found
}

fn candidate(study: &Study, shares: Vec<f64>, row: Row) -> Candidate {
    let (costs, violation) = judged(study, &row);
    Candidate {
        shares,
        row,
        costs,
        violation,
    }
}

/// Costs and violation of a row.
fn judged(study: &Study, row: &Row) -> (Vec<f64>, f64) {
    let costs: Vec<f64> = study
        .objective_values(row)
        .into_iter()
        .zip(&study.objectives)
        .map(|(value, objective)| objective.sign * value)
        .collect();
    let usable = costs.iter().all(|cost| cost.is_finite());
    let violation = if row.status == Status::Done && usable {
        let violations = study.violations(row);
        let beyond = violations
            .into_iter()
            .map(|one| if one > SLACK { one } else { 0.0 });
        beyond.sum()
    } else {
        f64::INFINITY
    };
    (costs, violation)
}

/// True if `a` is at least as good as `b` in all objectives and better in one.
fn dominates(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a <= b) && a.iter().zip(b).any(|(a, b)| a < b)
}

/// The same with constraints: the smaller violation first.
fn better(a: &Candidate, b: &Candidate) -> bool {
    if a.violation == 0.0 && b.violation == 0.0 {
        dominates(&a.costs, &b.costs)
    } else {
        a.violation < b.violation
    }
}

/// Indices of the fronts of a population: those that nothing dominates, then those that only
/// they dominate, and so on.
fn fronts(population: &[Candidate]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..population.len()).collect();
    let mut fronts = Vec::new();
    while !left.is_empty() {
        let beaten = |one: &usize| {
            left.iter()
                .any(|other| better(&population[*other], &population[*one]))
        };
        let (rest, front): (Vec<usize>, Vec<usize>) = left.iter().partition(|one| beaten(one));
        if front.is_empty() {
            // Values that compare with nothing.
            fronts.push(rest);
            break;
        }
        fronts.push(front);
        left = rest;
    }
    fronts
}

/// Index within `front` of the design whose neighbours are nearest.
fn most_crowded(population: &[Candidate], front: &[usize]) -> usize {
    let mut distance = vec![0.0; front.len()];
    let objectives = population[front[0]].costs.len();
    for objective in 0..objectives {
        let cost = |at: &usize| population[front[*at]].costs[objective];
        let mut order: Vec<usize> = (0..front.len()).collect();
        order.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        let (first, last) = (order[0], order[order.len() - 1]);
        let span = cost(&last) - cost(&first);
        distance[first] = f64::INFINITY;
        distance[last] = f64::INFINITY;
        if span > 0.0 {
            for three in order.windows(3) {
                distance[three[1]] += (cost(&three[2]) - cost(&three[0])) / span;
            }
        }
    }
    (0..front.len())
        .min_by(|a, b| distance[*a].total_cmp(&distance[*b]))
        .unwrap_or(0)
}

/// The best `size` of a population: front by front, the last one thinned where it is most
/// crowded.
fn selected(population: Vec<Candidate>, size: usize) -> Vec<Candidate> {
    let mut keep: Vec<usize> = Vec::new();
    for mut front in fronts(&population) {
        while keep.len() + front.len() > size {
            if keep.len() >= size {
                front.clear();
                break;
            }
            let crowded = most_crowded(&population, &front);
            front.remove(crowded);
        }
        keep.extend(front);
    }
    keep.sort_unstable();
    let mut population: Vec<Option<Candidate>> = population.into_iter().map(Some).collect();
    keep.into_iter()
        .filter_map(|index| population[index].take())
        .collect()
}

/// Refuses a study that cannot be optimised; `file` is its name for messages.
///
/// # Errors
/// A study without an objective, or with a variable that varies nothing.
pub fn possible(study: &Study, file: &str) -> Result<(), InputError> {
    let wrong = |message: &str, help: &str| Err(InputError::whole(file, message).help(help));
    if study.objectives.is_empty() {
        let help = "add [objectives] with minimise or maximise";
        return wrong("no objective is given", help);
    }
    if study.variables.is_empty() || study.variables.iter().any(|one| !one.values.varies()) {
        let help = "add range = [least, greatest]";
        return wrong(
            "every variable of an optimisation needs a range or values",
            help,
        );
    }
    Ok(())
}

/// Optimises the objectives of the study of `runner`.
///
/// The same seed gives the same designs on any number of threads, and again from a store.
///
/// # Errors
/// When the store cannot be written.
pub fn optimise(runner: &mut Runner<'_>) -> Result<Optimum, StoreError> {
    let study = runner.study;
    let options = study.optimize;
    let size = options.population.min(options.evaluations);
    let dimensions = study.variables.len();
    let mut random = seeded(options.seed);
    let alone = study.objectives.len() == 1;
    let mut polish = 0;
    if continuous(study) > 0 {
        polish = options.evaluations / POLISH_SHARE;
        if alone {
            polish = polish.min(POLISH);
        }
    }
    let mut evaluations = 0;
    let mut dominated = Vec::new();
    let mut stopped = false;
    let first = latin_hypercube(dimensions, size, options.seed);
    let mut population = evaluated(runner, first, &mut evaluations, &mut stopped)?;
    while evaluations + size + polish <= options.evaluations && !stopped && population.len() > 3 {
        let trials: Vec<Vec<f64>> = (0..population.len())
            .map(|index| trial(&population, index, &mut random))
            .collect();
        let parents = population.len();
        let children = evaluated(runner, trials, &mut evaluations, &mut stopped)?;
        if children.len() < parents {
            // Stopped: the last whole generation counts.
            break;
        }
        let mut next = Vec::with_capacity(2 * parents);
        for (parent, child) in population.into_iter().zip(children) {
            if better(&child, &parent) || child.costs == parent.costs {
                dominated.push(parent);
                next.push(child);
            } else if better(&parent, &child) {
                dominated.push(child);
                next.push(parent);
            } else {
                next.extend([parent, child]);
            }
        }
        population = selected(next, size);
    }
    let mut front = nondominated(&population);
    if !stopped && polish > 0 && !front.is_empty() {
        let replaced = if alone {
            let search = Search::alone(&front[0], 0, polish);
            let found = polished(runner, vec![search], &mut evaluations, &mut stopped)?;
            let least = front[0].costs[0];
            let better = |one: &Candidate| one.costs[0] < least;
            let better = found.into_iter().flatten().find(better);
            front.splice(0..0, better);
            Vec::new()
        } else {
            polished_front(runner, &mut front, polish, &mut evaluations, &mut stopped)?
        };
        dominated.extend(replaced);
    }
    if alone {
        front.truncate(1);
    }
    let nearest = front.is_empty().then(|| {
        let least = |a: &&Candidate, b: &&Candidate| a.violation.total_cmp(&b.violation);
        population.iter().chain(&dominated).min_by(least).cloned()
    });
    Ok(Optimum {
        front,
        dominated,
        nearest: nearest.flatten(),
        evaluations,
        stopped,
    })
}

/// Variables that a local method can move.
fn continuous(study: &Study) -> usize {
    let moves = |values: &Values| matches!(values, Values::Range { .. });
    study
        .variables
        .iter()
        .filter(|one| moves(&one.values))
        .count()
}

fn evaluated(
    runner: &mut Runner<'_>,
    shares: Vec<Vec<f64>>,
    evaluations: &mut usize,
    stopped: &mut bool,
) -> Result<Vec<Candidate>, StoreError> {
    let study = runner.study;
    let points: Vec<Vec<f64>> = shares
        .iter()
        .map(|shares| point_of(study, shares))
        .collect();
    let rows = runner.rows(&points)?;
    *stopped |= rows.iter().any(Option::is_none);
    *evaluations += rows.iter().flatten().count();
    let pairs = shares.into_iter().zip(rows);
    Ok(pairs
        .filter_map(|(shares, row)| Some(candidate(study, shares, row?)))
        .collect())
}

/// DE/rand/1/bin: a third design moved by the difference of two others, crossed with the
/// parent. The factor varies, so that no line of differences repeats.
fn trial(population: &[Candidate], parent: usize, random: &mut ChaCha12Rng) -> Vec<f64> {
    const CROSSING: f64 = 0.9;
    let mut pick = |used: &[usize]| loop {
        let index = (draw(random) * population.len() as f64) as usize;
        if !used.contains(&index) {
            return index;
        }
    };
    let a = pick(&[parent]);
    let b = pick(&[parent, a]);
    let c = pick(&[parent, a, b]);
    let factor = 0.3 + 0.5 * draw(random);
    let dimensions = population[parent].shares.len();
    let always = (draw(random) * dimensions as f64) as usize;
    (0..dimensions)
        .map(|k| {
            let own = population[parent].shares[k];
            let crosses = draw(random) < CROSSING;
            if k != always && !crosses {
                return own;
            }
            let [a, b, c] = [a, b, c].map(|index| population[index].shares[k]);
            // At a bound it stays: optima often lie there.
            (c + factor * (a - b)).clamp(0.0, 1.0)
        })
        .collect()
}

/// Feasible designs of a population that no other one dominates, by their first cost.
fn nondominated(population: &[Candidate]) -> Vec<Candidate> {
    let feasible = || population.iter().filter(|one| one.violation == 0.0);
    let on_front = |one: &&Candidate| !feasible().any(|other| dominates(&other.costs, &one.costs));
    let mut front: Vec<Candidate> = feasible().filter(on_front).cloned().collect();
    front.sort_by(|a, b| a.costs[0].total_cmp(&b.costs[0]));
    front.dedup_by(|a, b| a.row.point == b.row.point);
    front
}

/// A local search: one cost is made small from a start, others are held.
struct Search {
    start: Candidate,
    /// Index of the cost that is made small.
    objective: usize,
    /// Index, greatest value and size of each cost that is held.
    held: Vec<(usize, f64, f64)>,
    /// First radius, as a share of the way of a variable.
    radius: f64,
    /// Most evaluations.
    budget: usize,
}

impl Search {
    fn alone(start: &Candidate, objective: usize, budget: usize) -> Self {
        Self {
            start: start.clone(),
            objective,
            held: Vec::new(),
            radius: RADII[0],
            budget,
        }
    }

    /// By how much the held costs are too large, each as a share of its size.
    fn excess<'a>(&'a self, one: &'a Candidate) -> impl Iterator<Item = f64> + 'a {
        let held = self.held.iter();
        held.map(|(index, limit, size)| (one.costs[*index] - limit) / size)
    }

    /// True if a design may be the answer.
    fn holds(&self, one: &Candidate) -> bool {
        one.violation == 0.0 && self.excess(one).all(|excess| excess <= SLACK)
    }
}

/// Polishes a front in place with at most `budget` evaluations: the ends of each objective first,
/// then every design in its first objective with the others held (the method of ε-constraints,
/// Haimes, Lasdon and Wismer 1971). Returns the designs that were replaced.
fn polished_front(
    runner: &mut Runner<'_>,
    front: &mut Vec<Candidate>,
    budget: usize,
    evaluations: &mut usize,
    stopped: &mut bool,
) -> Result<Vec<Candidate>, StoreError> {
    let objectives = front[0].costs.len();
    let mut replaced = Vec::new();
    let before = *evaluations;
    let each = POLISH.min(budget / (2 * objectives * RADII.len()));
    for radius in RADII {
        let ends = (0..objectives).map(|objective| {
            let cost = |one: &&Candidate| one.costs[objective];
            let end = front.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
            Search {
                radius,
                ..Search::alone(end.unwrap_or(&front[0]), objective, each)
            }
        });
        let found = polished(runner, ends.collect(), evaluations, stopped)?;
        // An end is a new design beside those that it does not dominate.
        front.extend(found.into_iter().flatten());
        let all = std::mem::take(front);
        *front = nondominated(&all);
        let stays = |one: &Candidate| front.iter().any(|kept| kept.row.point == one.row.point);
        replaced.extend(all.into_iter().filter(|one| !stays(one)));
    }

    let each = POLISH.min((budget - (*evaluations - before).min(budget)) / front.len());
    // Fewer evaluations than corners of a simplex find nothing.
    if *stopped || each < continuous(runner.study) + 2 {
        return Ok(replaced);
    }
    let width = |objective: usize| {
        let costs = front.iter().map(|one| one.costs[objective]);
        let (least, greatest) = costs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), cost| {
            (a.min(cost), b.max(cost))
        });
        if greatest > least {
            greatest - least
        } else {
            1.0
        }
    };
    let held = |one: &Candidate| {
        let others = 1..objectives;
        others
            .map(|index| (index, one.costs[index], width(index)))
            .collect()
    };
    let searches = front.iter().map(|one| Search {
        held: held(one),
        ..Search::alone(one, 0, each)
    });
    let found = polished(runner, searches.collect(), evaluations, stopped)?;
    for (one, found) in front.iter_mut().zip(found) {
        if let Some(found) = found.filter(|found| found.costs[0] < one.costs[0]) {
            replaced.push(std::mem::replace(one, found));
        }
    }
    *front = nondominated(front);
    Ok(replaced)
}

/// Local searches by COBYLA (Powell 1994) over the continuous variables, side by side: the best
/// design that each met, where one of them holds.
///
/// COBYLA asks for one design after the other. Each search is run again from its start with what
/// is known until it asks for something new; what all ask is evaluated together.
fn polished(
    runner: &mut Runner<'_>,
    searches: Vec<Search>,
    evaluations: &mut usize,
    stopped: &mut bool,
) -> Result<Vec<Option<Candidate>>, StoreError> {
    let study = runner.study;
    let mut known: Vec<HashMap<Vec<u64>, Candidate>> = Vec::new();
    known.resize_with(searches.len(), HashMap::new);
    while !*stopped {
        let asks: Vec<(usize, Vec<f64>)> = searches
            .iter()
            .zip(&known)
            .enumerate()
            .filter(|(_, (search, known))| known.len() < search.budget)
            .filter_map(|(index, (search, known))| Some((index, asked(study, search, known)?)))
            .collect();
        if asks.is_empty() {
            break;
        }
        let (indices, shares): (Vec<usize>, Vec<Vec<f64>>) = asks.into_iter().unzip();
        let found = evaluated(runner, shares, evaluations, stopped)?;
        if *stopped {
            break;
        }
        for (index, found) in indices.into_iter().zip(found) {
            known[index].insert(place_of(&found.shares), found);
        }
    }
    // Of all that a search met the best that holds.
    let best = |(search, known): (Search, HashMap<Vec<u64>, Candidate>)| {
        let met = known.into_values().filter(|one| search.holds(one));
        met.min_by(|a, b| {
            let by_cost = a.costs[search.objective].total_cmp(&b.costs[search.objective]);
            by_cost.then_with(|| place_of(&a.shares).cmp(&place_of(&b.shares)))
        })
    };
    Ok(searches.into_iter().zip(known).map(best).collect())
}

/// Shares as what can be looked up.
fn place_of(shares: &[f64]) -> Vec<u64> {
    shares.iter().map(|share| share.to_bits()).collect()
}

/// The shares of the first design that a search asks for and that is not known; none when it ends
/// with what is known.
fn asked(study: &Study, search: &Search, known: &HashMap<Vec<u64>, Candidate>) -> Option<Vec<f64>> {
    let moving: Vec<usize> = (0..study.variables.len())
        .filter(|index| matches!(study.variables[*index].values, Values::Range { .. }))
        .collect();
    let asked: RefCell<Option<Vec<f64>>> = RefCell::new(None);
    // Nothing that comes after the first question matters.
    let at = |x: &[f64]| -> Option<&Candidate> {
        let mut asked = asked.borrow_mut();
        if asked.is_some() {
            return None;
        }
        let mut shares = search.start.shares.clone();
        for (index, share) in moving.iter().zip(x) {
            shares[*index] = share.clamp(0.0, 1.0);
        }
        let found = known.get(&place_of(&shares));
        if found.is_none() {
            *asked = Some(shares);
        }
        found.filter(|one| one.row.status == Status::Done)
    };
    let size = search.start.costs[search.objective].abs();
    let size = if size > 0.0 { size } else { 1.0 };
    // A design that is not done is worse than any other, and outside.
    let cost = |x: &[f64], (): &mut ()| -> f64 {
        let cost = at(x).map_or(f64::NAN, |one| one.costs[search.objective] / size);
        if cost.is_finite() { cost } else { 1e6 }
    };
    let at = &at;
    let room = |index: usize| {
        move |x: &[f64], (): &mut ()| -> f64 {
            let excess = at(x).and_then(|one| {
                let all = study.violations(&one.row).into_iter();
                all.chain(search.excess(one)).nth(index)
            });
            excess
                .filter(|one| one.is_finite())
                .map_or(-1.0, |one| -one)
        }
    };
    let count = study.constraints.len() + search.held.len();
    let constraints: Vec<_> = (0..count).map(room).collect();
    let x: Vec<f64> = moving
        .iter()
        .map(|index| search.start.shares[*index])
        .collect();
    let bounds = vec![(0.0, 1.0); x.len()];
    let tolerances = cobyla::StopTols {
        ftol_rel: 1e-12,
        xtol_rel: 1e-9,
        ..cobyla::StopTols::default()
    };
    // How it ends does not matter: the designs that it met are judged by their own answers.
    let _ = cobyla::minimize(
        cost,
        &x,
        &bounds,
        &constraints,
        (),
        search.budget,
        cobyla::RhoBeg::All(search.radius),
        Some(tolerances),
    );
    asked.into_inner()
}

/// Result of the same problem on a plan of random designs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    /// Designs that fulfil all constraints.
    pub feasible: usize,
    /// Designs that are better than the optimum, or that dominate a design of the front while
    /// none of it dominates them, each by more than a millionth.
    pub lost_to: usize,
}

/// Compares an optimum with a random plan of `points` designs.
///
/// # Errors
/// When the store cannot be written.
pub fn check(
    runner: &mut Runner<'_>,
    optimum: &Optimum,
    points: usize,
) -> Result<Checked, StoreError> {
    let dimensions = runner.study.variables.len();
    // Another seed than that of the first population.
    let mut random = seeded(runner.study.optimize.seed ^ 0x5eed);
    let plan = (0..points).map(|_| (0..dimensions).map(|_| draw(&mut random)).collect());
    let (mut evaluations, mut stopped) = (0, false);
    let found = evaluated(runner, plan.collect(), &mut evaluations, &mut stopped)?;
    let feasible: Vec<&Candidate> = found.iter().filter(|one| one.violation == 0.0).collect();
    let beats = |one: &&&Candidate| {
        // Worse by a millionth it must still be better.
        let worse: Vec<f64> = one
            .costs
            .iter()
            .map(|cost| cost + 1e-6 * cost.abs())
            .collect();
        optimum.front.is_empty()
            || optimum
                .front
                .iter()
                .any(|other| dominates(&worse, &other.costs))
    };
    Ok(Checked {
        feasible: feasible.len(),
        lost_to: feasible.iter().filter(beats).count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(costs: &[f64], violation: f64) -> Candidate {
        Candidate {
            shares: vec![0.0],
            row: Row {
                point: Vec::new(),
                status: Status::Done,
                reason: String::new(),
                answers: Vec::new(),
            },
            costs: costs.to_vec(),
            violation,
        }
    }

    #[test]
    fn feasible_designs_come_first_and_fronts_are_thinned_where_they_are_crowded() {
        let population = vec![
            one(&[0.0, 4.0], 0.0),
            one(&[1.0, 1.0], 0.0),
            one(&[1.1, 0.9], 0.0),
            one(&[4.0, 0.0], 0.0),
            one(&[-9.0, -9.0], 1.0),
            one(&[2.0, 2.0], 0.0),
        ];
        let fronts = fronts(&population);
        assert_eq!(fronts[0], [0, 1, 2, 3]);
        assert_eq!(fronts[1], [5]);
        assert_eq!(fronts[2], [4]);
        let kept = selected(population, 3);
        let firsts: Vec<f64> = kept.iter().map(|one| one.costs[0]).collect();
        assert!(firsts.contains(&0.0) && firsts.contains(&4.0) && firsts.len() == 3);
    }
}
