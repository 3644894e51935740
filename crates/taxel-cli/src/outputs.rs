//! Results to files and to the standard output.

use std::borrow::Cow;
use std::io::{IsTerminal as _, Write as _};
use std::path::Path;

use taxel_files::notes::visible;
pub(crate) use taxel_files::outputs::{
    Existing, cannot_write, check, is_standard, remove_unfinished, write_file,
};

use crate::{Done, Stop};

/// Writes a result to the standard output; to a terminal with its control characters
/// written out.
pub(crate) fn print(text: &str) -> Result<Done, Stop> {
    let mut output = std::io::stdout().lock();
    let shown = if output.is_terminal() {
        Cow::Owned(visible(text))
    } else {
        Cow::Borrowed(text)
    };
    let written = output
        .write_all(shown.as_bytes())
        .and_then(|()| output.flush());
    match written {
        // Whoever reads may stop early (`taxel ... | head`).
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Stop::Failed(format!("cannot write the result: {error}")))
        }
        _ => Ok(Done::Complete),
    }
}

/// Writes what is said beside a result: to the standard output, or to the standard error
/// where `output` takes the standard output.
pub(crate) fn print_beside(output: Option<&Path>, text: &str) -> Result<Done, Stop> {
    if output.is_some_and(is_standard) {
        let _ = std::io::stderr().write_all(text.as_bytes());
        return Ok(Done::Complete);
    }
    print(text)
}

/// Writes a result to `output`, or to the standard output.
pub(crate) fn write(output: Option<&Path>, existing: Existing, text: &str) -> Result<Done, Stop> {
    write_pieces(output, existing, |sink| sink(text)).map(|()| Done::Complete)
}

/// Where pieces of a result go.
pub(crate) type Sink<'a> = &'a mut dyn FnMut(&str) -> Result<(), Stop>;

/// Writes the pieces of a result that `give` hands out to `output`, or to the
/// standard output.
///
/// A result appears only when it is whole: a file is written beside its place
/// and then moved there, and the standard output waits for the last piece.
pub(crate) fn write_pieces(
    output: Option<&Path>,
    existing: Existing,
    give: impl FnOnce(Sink<'_>) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let Some(path) = output.filter(|path| !is_standard(path)) else {
        let mut whole = String::new();
        give(&mut |piece| {
            whole.push_str(piece);
            Ok(())
        })?;
        return print(&whole).map(drop);
    };
    write_file(path, existing, |file| {
        give(&mut |piece| {
            let written = file.write_all(piece.as_bytes());
            written.map_err(|error| cannot_write(path, &error))
        })
    })
}
