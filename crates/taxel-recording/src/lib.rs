//! Frames of tactile sensors, and recordings of them: bytes in, frames out.
//!
//! A [`Frame`] is one reading of every channel, a [`Stream`] says what the channels
//! are. [`Recording`] decodes frames from bytes, [`ChannelWriter`] encodes them.
//! Nothing here opens a file, reads a clock or knows a device.
//!
//! Five formats are read, recognised by content and never by the name of the
//! file:
//!
//! | format | begins with | described in |
//! |---|---|---|
//! | raw channels | `sequence,time [s],r0c0.11 [fF],...` | [`ChannelWriter`] |
//! | Tekscan I-Scan CSV and F-Scan ASF | `DATA_TYPE MOVIE` | [`Format::Tekscan`] |
//! | XSENSOR CSV | `File:,"C:\...XSN"` | [`Format::Xsensor`] |
//! | tables of other programs | names of columns, or rows of numbers | [`Format::Table`], [`Columns`] |
//! | MCAP of taxel | the bytes `89 4d 43 41 50 30 0d 0a` | [`mcap`] |
//!
//! A decoder holds one line and one frame, whatever the length of the file,
//! and reads from any [`BufRead`](std::io::BufRead).
//!
//! # Example
//! ```
//! use taxel_recording::Recording;
//!
//! let text = "time [s],r0c0 [kPa],r0c1 [kPa]\n0.00,1.5,2\n0.01,1.6,\n";
//! let recording = Recording::open("press.csv", text.as_bytes())?;
//! assert_eq!((recording.stream().rows, recording.stream().columns), (1, 2));
//! let frames = recording.collect::<Result<Vec<_>, _>>()?;
//! assert_eq!(frames[1].time_ns, 10_000_000);
//! assert_eq!(frames[1].values[0], 1600.0);
//! assert!(frames[1].values[1].is_nan());
//! # Ok::<(), taxel_recording::RecordingError>(())
//! ```
//!
//! # Example: a value that is not a number is named
//! ```
//! use taxel_recording::Recording;
//!
//! let text = "time [s],r0c0 [kPa]\n0.00,1.5\n0.01,l.6\n";
//! let mut recording = Recording::open("press.csv", text.as_bytes()).unwrap();
//! assert!(recording.next().unwrap().is_ok());
//! let error = recording.next().unwrap().unwrap_err();
//! assert!(error.to_string().starts_with("press.csv:3:6: r0c0 [kPa]"));
//! assert!(recording.next().is_none());
//! ```

mod check;
pub mod export;
pub mod foreign;
mod foreign_format;
mod frame;
pub mod mcap;
mod recording;

pub use foreign_format::ForeignFormat;
pub use frame::{Frame, FrameFlags, Quantity, SignalUnit, Stream};
pub use recording::{
    Change, ChannelWriter, Columns, Format, Recording, RecordingError, RecordingOptions, Taken,
    described_stream, description_of,
};
