//! What a device adds to a plan.

use crate::bill::Layer;
use crate::mask::{Mask, Mould};

/// Masks, moulds, layers, and what is missing.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub(crate) masks: Vec<Mask>,
    pub(crate) moulds: Vec<Mould>,
    pub(crate) layers: Vec<Layer>,
    pub(crate) missing: Vec<String>,
}
