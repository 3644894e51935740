//! The state of a solution as text, from which it goes on.

use serde::{Deserialize, Serialize};
use taxel_fem::assembly::state::State;
use taxel_fem::problem::contact::{Anchor, Contact, ContactState};

use super::body::Body;

/// Version of this format.
const VERSION: u32 = 1;

/// A saved state that does not belong to a problem.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SavedError {
    /// The text is no saved state.
    #[error("is no saved state of taxel solve: {reason}")]
    NoState {
        /// What its reader says.
        reason: String,
    },
    /// Its version is not read.
    #[error("has version {found}; this program reads version {VERSION}")]
    Version {
        /// Version found.
        found: u32,
    },
    /// It was saved from another problem or mesh.
    #[error("was saved from another problem or another mesh; solve this one from the start")]
    OtherProblem,
    /// Its solids remember more than is saved.
    #[error("has no memory of solids that relax; solve the problem from the start")]
    Relaxing,
    /// Its numbers do not fit the mesh.
    #[error("is damaged: {what} has {found} numbers, not {expected}")]
    Damaged {
        /// What the numbers are.
        what: &'static str,
        /// Numbers found.
        found: usize,
        /// Numbers needed.
        expected: usize,
    },
    /// A point of a contact is held on a facet that the surface does not have.
    #[error("is damaged: a point of a contact is held on facet {found} of a surface of {facets}")]
    NoFacet {
        /// Number of the facet, from 0.
        found: usize,
        /// Facets of the surface.
        facets: usize,
    },
}

/// What is written. Numbers are their bits in sixteen hexadecimal digits, so that they come back
/// exactly.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    taxel_solve_state: u32,
    /// Of problem and mesh, by whoever calls.
    identity: String,
    steps_done: usize,
    targets: String,
    rows: Vec<String>,
    displacement: String,
    pressures: String,
    parameters: String,
    multipliers: Vec<String>,
    /// Four numbers for each contact point: 1 and a place, or zeros.
    anchors: Vec<String>,
    /// Multipliers have gone to the corners of facets.
    #[serde(default)]
    corners: bool,
}

impl Body {
    /// The present state as text (JSON); `identity` is what must be the same for it to be read
    /// again, such as a hash of problem and mesh.
    pub fn save(&self, identity: &str) -> String {
        let state = self.solver.state();
        let anchors = |contact: &ContactState| {
            let each = contact.anchors.iter().flat_map(|anchor| match anchor {
                // One on an obstacle, from two on the number of a facet.
                Some(Anchor {
                    place: [x, y, z],
                    facet,
                }) => [
                    facet.map_or(1.0, |facet| 2.0 + f64::from(facet)),
                    *x,
                    *y,
                    *z,
                ],
                None => [0.0; 4],
            });
            written(each)
        };
        let saved = Saved {
            taxel_solve_state: VERSION,
            identity: identity.to_owned(),
            steps_done: self.done,
            targets: written(self.solver.targets().iter().copied()),
            rows: self
                .rows
                .iter()
                .map(|row| written(row.iter().copied()))
                .collect(),
            displacement: written(state.displacement.iter().flatten().copied()),
            pressures: written(state.pressures.iter().flatten().copied()),
            parameters: written(state.parameters.iter().copied()),
            multipliers: state
                .contacts
                .iter()
                .map(|contact| written(contact.multipliers.iter().copied()))
                .collect(),
            anchors: state.contacts.iter().map(anchors).collect(),
            corners: state.corners,
        };
        // A struct of texts and numbers always becomes JSON.
        serde_json::to_string_pretty(&saved).unwrap_or_default() + "\n"
    }

    /// Goes back to a state that [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`SavedError`]; the body then stays as it was.
    pub fn restore(&mut self, text: &str, identity: &str) -> Result<(), SavedError> {
        let saved: Saved = serde_json::from_str(text).map_err(|error| SavedError::NoState {
            reason: error.to_string(),
        })?;
        if saved.taxel_solve_state != VERSION {
            return Err(SavedError::Version {
                found: saved.taxel_solve_state,
            });
        }
        if saved.identity != identity {
            return Err(SavedError::OtherProblem);
        }
        if self
            .solver
            .problem()
            .relaxations
            .iter()
            .any(Option::is_some)
        {
            return Err(SavedError::Relaxing);
        }
        let rest = State::rest(self.solver.problem());
        let mut state = rest.clone();
        let parameters = rest.parameters.len();
        let columns = self.columns().len() - 1;
        state.parameters = read("parameters", &saved.parameters, Some(parameters))?;
        let targets = read("targets", &saved.targets, Some(parameters))?;
        let nodes = rest.displacement.len();
        let moved = read("displacement", &saved.displacement, Some(3 * nodes))?;
        state.displacement = moved.as_chunks().0.to_vec();
        let width = rest.pressures.as_flattened().len();
        let pressures = read("pressures", &saved.pressures, Some(width))?;
        state.pressures = pressures.as_chunks().0.to_vec();
        state.corners = saved.corners;
        let same = |what, found: usize, expected: usize| {
            if found == expected {
                return Ok(());
            }
            Err(SavedError::Damaged {
                what,
                found,
                expected,
            })
        };
        same("contacts", saved.multipliers.len(), rest.contacts.len())?;
        same("contacts", saved.anchors.len(), rest.contacts.len())?;
        for (number, contact) in state.contacts.iter_mut().enumerate() {
            let points = self.solver.contact(number).gaps.len();
            contact.multipliers = read("multipliers", &saved.multipliers[number], None)?;
            let given = contact.multipliers.len();
            same("multipliers", given, if given == 0 { 0 } else { points })?;
            let anchors = read("anchors", &saved.anchors[number], None)?;
            let given = anchors.len();
            same("anchors", given, if given == 0 { 0 } else { 4 * points })?;
            let anchor = |&[held, x, y, z]: &[f64; 4]| {
                (held != 0.0).then_some(Anchor {
                    place: [x, y, z],
                    facet: (held >= 2.0).then_some((held - 2.0) as u32),
                })
            };
            contact.anchors = anchors.as_chunks().0.iter().map(anchor).collect();
            let facets = match &self.solver.problem().contacts[number] {
                Contact::Surfaces(pair) => pair.second.len(),
                Contact::Obstacle(_) | Contact::Walls(_) => 0,
            };
            let named = contact.anchors.iter().flatten();
            if let Some(found) = named
                .filter_map(|anchor| Some(anchor.facet? as usize))
                .find(|facet| *facet >= facets)
            {
                return Err(SavedError::NoFacet { found, facets });
            }
        }
        let rows = saved.rows.iter();
        let rows: Vec<Vec<f64>> = rows
            .map(|row| read("a row", row, Some(columns)))
            .collect::<Result<_, _>>()?;
        same("rows", rows.len(), saved.steps_done + 1)?;
        if saved.steps_done > self.steps.len() {
            return Err(SavedError::OtherProblem);
        }
        self.solver.restart(state, targets);
        self.done = saved.steps_done;
        self.rows = rows;
        Ok(())
    }
}

fn written(numbers: impl Iterator<Item = f64>) -> String {
    numbers.fold(String::new(), |mut text, number| {
        use std::fmt::Write as _;
        let _ = write!(text, "{:016x}", number.to_bits());
        text
    })
}

fn read(what: &'static str, text: &str, expected: Option<usize>) -> Result<Vec<f64>, SavedError> {
    let damaged = |found: usize| SavedError::Damaged {
        what,
        found,
        expected: expected.unwrap_or(text.len().div_ceil(16)),
    };
    let digits = text.as_bytes();
    let (words, rest) = digits.as_chunks::<16>();
    let mut numbers = Vec::with_capacity(words.len());
    for word in words {
        let bits = std::str::from_utf8(word)
            .ok()
            .and_then(|word| u64::from_str_radix(word, 16).ok());
        // Not a number is what an unknown value of a row is.
        numbers.push(f64::from_bits(bits.ok_or_else(|| damaged(numbers.len()))?));
    }
    if !rest.is_empty() || expected.is_some_and(|expected| expected != numbers.len()) {
        return Err(damaged(numbers.len()));
    }
    Ok(numbers)
}
