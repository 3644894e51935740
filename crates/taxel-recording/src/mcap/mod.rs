//! Recordings that survive: MCAP with small chunks, each with its CRC.
//!
//! A [`McapWriter`] puts the messages of nine topics ([`Topic`]) into chunks and writes each
//! chunk at once; whatever ends the program, the chunks before are whole. A [`McapReader`] believes
//! only chunks whose lengths and CRC agree, and finds the next one after damage. [`rewrite`]
//! makes a finished recording of what is whole.
//!
//! A [`Companion`] adds messages of types that another program knows, one of each for each touch.
//!
//! The files are those of <https://mcap.dev>, which other programs read: the messages are
//! those of ROS 2 (`ros2msg` schemas, `cdr` encoding). Nothing is compressed: a torn compressed
//! chunk is lost whole.

mod accompany;
mod cdr;
mod chunk_list;
mod companion;
mod message;
mod order;
mod reader;
mod record;
mod rewrite;
mod ros2;
mod scanner;
mod schemas;
mod storage;
mod writer;

pub use accompany::write_accompanied;
pub use companion::{Companion, CompanionTopic};
pub use message::{
    CertaintyMessage, ClockMessage, ContactMessage, EventMessage, FrameMessage, HealthMessage,
    LinkMessage, MarkMessage, Message, NO_TIME, RECONNECTED, RestKind, RestMessage, TouchMessage,
    WireMessage,
};
pub use reader::{Damage, Findings, McapReader, StoredMessage};
pub use record::{Attachment, MAGIC, Metadata};
pub(crate) use record::{Fields, code};
pub use rewrite::{Rewritten, rewrite};
pub use ros2::Ros2Messages;
pub use schemas::Topic;
pub use storage::Storage;
pub use writer::{McapWriter, RecordingHead};
