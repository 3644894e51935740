//! One file per command; each only asks the library and shows the answer.

pub(crate) mod calibrate;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod device;
pub(crate) mod devices;
pub(crate) mod estimate;
pub(crate) mod export;
pub(crate) mod fabricate;
pub(crate) mod listen;
pub(crate) mod live;
pub(crate) mod material;
pub(crate) mod optimize;
pub(crate) mod predict;
pub(crate) mod recording;
pub(crate) mod reproduce;
pub(crate) mod schema;
pub(crate) mod solve;
pub(crate) mod study;
pub(crate) mod sweep;
pub(crate) mod tabulate;
pub(crate) mod tolerance;
pub(crate) mod twin;
pub(crate) mod verify;
