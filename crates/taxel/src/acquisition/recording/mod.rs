//! Recordings: bytes in, frames out.
