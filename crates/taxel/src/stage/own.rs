//! Elements of a user's own.

use std::fmt;
use std::sync::Arc;

use super::Parts;

/// An element of a user's own, read from the table `element.KEY` of a sensor file.
pub trait OwnElement: fmt::Debug + Send + Sync {
    /// The parts of its chain.
    fn parts(&self) -> Parts;
}

/// An element of a user's own with its key.
#[derive(Debug, Clone)]
pub struct OwnParts {
    /// Key below `element`.
    pub key: &'static str,
    /// The element.
    pub element: Arc<dyn OwnElement>,
}

impl PartialEq for OwnParts {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.element, &other.element)
    }
}
