//! Design studies.
