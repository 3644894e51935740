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
        } else if is(&MAGIC) && is_mcap_of_others(begin) {
            Self::Mcap
        } else {
            return None;
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
