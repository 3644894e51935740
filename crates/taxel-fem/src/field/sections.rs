//! Sections of a prismatic void or solid along its axis, and the slender formula.
