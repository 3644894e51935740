//! Which files of other programs are recognised, by their first bytes.

use std::fmt;

use crate::mcap::{Fields, MAGIC, code};
use taxel_ground::InputError;

/// The kind of a file of another program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignFormat {
    /// MCAP of another program, such as a bag of ROS 2.
    Mcap,
    /// Bag of ROS 2 in SQLite (`.db3`).
    Sqlite,
    /// Bag of ROS 1.
    Bag,
    /// XDF of LabRecorder.
    Xdf,
    /// An array of NumPy.
    Npy,
    /// Several arrays of NumPy.
    Npz,
    /// HDF5.
    Hdf5,
    /// Arrays of MATLAB 5 to 7.
    Mat,
    /// Arrays of MATLAB 4.
    Mat4,
}

impl fmt::Display for ForeignFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mcap => "MCAP of another program",
            Self::Sqlite => "bag of ROS 2 (SQLite)",
            Self::Bag => "bag of ROS 1",
            Self::Xdf => "XDF (LabRecorder)",
            Self::Npy => "array of NumPy (NPY)",
            Self::Npz => "arrays of NumPy (NPZ)",
            Self::Hdf5 => "HDF5",
            Self::Mat => "MAT-file of MATLAB 5 to 7",
            Self::Mat4 => "MAT-file of MATLAB 4",
        })
    }
}

/// Bytes at the beginning of a file that show its kind: HDF5 may have a head of its own before.
pub const BEGIN: usize = 520;

impl ForeignFormat {
    /// The kind of a file that begins with these bytes, [`BEGIN`] or all of it.
    pub fn of(begin: &[u8]) -> Option<Self> {
        let is = |mark: &[u8]| begin.starts_with(mark);
        let hdf5 = b"\x89HDF\r\n\x1a\n";
        Some(if is(b"SQLite format 3\0") {
            Self::Sqlite
        } else if is(b"#ROSBAG V2.0") {
            Self::Bag
        } else if is(b"XDF:") {
            Self::Xdf
        } else if is(b"\x93NUMPY") {
            Self::Npy
        } else if is(b"PK\x03\x04") {
            Self::Npz
        } else if is(hdf5) || begin.get(512..).is_some_and(|rest| rest.starts_with(hdf5)) {
            Self::Hdf5
        } else if is(b"MATLAB 5.0 MAT-file") {
            Self::Mat
        } else if Mat4Head::of(begin).is_some_and(|head| head.names(begin)) {
            Self::Mat4
        } else if is(&MAGIC) && is_mcap_of_others(begin) {
            Self::Mcap
        } else {
            return None;
        })
    }
}

/// The head of an array of MATLAB 4. The format has no mark: its files are known by a head whose
/// numbers are all of the few that are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Mat4Head {
    pub(crate) big: bool,
    /// Of the numbers: 0 to 5.
    pub(crate) precision: u32,
    /// 0 numbers, 1 text, 2 a sparse array.
    pub(crate) kind: u32,
    pub(crate) rows: u32,
    pub(crate) columns: u32,
    pub(crate) complex: bool,
    /// Bytes of the name, with the zero that ends it.
    pub(crate) name: u32,
}

impl Mat4Head {
    /// Bytes before the name.
    pub(crate) const LENGTH: usize = 20;

    /// The head at the beginning of these bytes.
    pub(crate) fn of(bytes: &[u8]) -> Option<Self> {
        let (words, _) = bytes.get(..Self::LENGTH)?.as_chunks::<4>();
        // The first word is 1000 for the order of bytes, 10 for the numbers and 1 for the kind.
        let big = u32::from_le_bytes(words[0]) > 52;
        let word = |at: usize| {
            let word = words[at];
            if big {
                u32::from_be_bytes(word)
            } else {
                u32::from_le_bytes(word)
            }
        };
        let first = word(0).checked_sub(if big { 1000 } else { 0 })?;
        let head = Self {
            big,
            precision: first / 10,
            kind: first % 10,
            rows: word(1),
            columns: word(2),
            complex: word(3) == 1,
            name: word(4),
        };
        let sound = head.precision <= 5
            && head.kind <= 2
            && word(3) <= 1
            && head.rows.max(head.columns) <= i32::MAX.cast_unsigned()
            && (2..=64).contains(&head.name);
        sound.then_some(head)
    }

    /// True if a name follows the head.
    fn names(self, bytes: &[u8]) -> bool {
        let name = bytes.get(Self::LENGTH..Self::LENGTH + self.name as usize);
        let name = name.and_then(|name| name.strip_suffix(&[0]));
        name.is_some_and(|name| {
            name[0].is_ascii_alphabetic()
                && name
                    .iter()
                    .all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
        })
    }
}

/// The refusal of a file of another program where only bytes one after the other can be read.
pub(crate) fn refused(file: &str, format: ForeignFormat) -> InputError {
    InputError::whole(file, format!("this is a file of another program: {format}"))
        .help("taxel recording inspect FILE lists what it holds, taxel recording import FILE -o NEW.csv makes a recording of it")
}

/// True if an MCAP file that begins so was not written by this program.
fn is_mcap_of_others(begin: &[u8]) -> bool {
    let library = || {
        let mut fields = Fields(begin.get(MAGIC.len()..)?);
        if fields.u8()? != code::HEADER {
            return None;
        }
        fields.u64()?;
        fields.text()?;
        fields.text()
    };
    library().is_some_and(|library| !library.starts_with("taxel"))
}
