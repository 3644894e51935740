//! What each kind of element is made of.

pub(crate) mod in_plane;
pub(crate) mod microchannel;
pub(crate) mod piezoelectric;
pub(crate) mod three_axis;

mod array;
mod parts;

pub(crate) use array::Array;
