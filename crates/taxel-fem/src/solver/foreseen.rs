//! Ways of a step that are known without its path.

/// Ways of the nodes in a step as its tangents foresee them, m.
pub(super) struct Foreseen {
    /// From the state before: along the last step, or the first change of the iteration.
    pub(super) ahead: Vec<[f64; 3]>,
    /// From the state found back to the targets before.
    pub(super) back: Vec<[f64; 3]>,
}
