//! The standard input and named pipes: read once, never sought.

use std::fs::File;
use std::io::{self, Read};
use std::path::PathBuf;
use std::time::Duration;
use taxel::shown;

use super::error::LinkError;
use super::port::{Link, Port, Received, received};

/// The standard input.
pub(crate) struct StandardInput;

impl Link for StandardInput {
    fn name(&self) -> String {
        "standard input".into()
    }

    fn waits(&self) -> bool {
        true
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        Ok(Box::new(Once(io::stdin())))
    }
}

/// A named pipe.
pub(crate) struct Pipe(pub(crate) PathBuf);

impl Link for Pipe {
    fn name(&self) -> String {
        shown::path(&self.0)
    }

    fn waits(&self) -> bool {
        true
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        // This waits for the writer.
        let file = File::open(&self.0).map_err(|error| LinkError::Open {
            name: self.name(),
            reason: format!("cannot be opened: {error}"),
        })?;
        Ok(Box::new(Once(file)))
    }
}

/// A file descriptor that can be waited for.
#[cfg(unix)]
pub(crate) trait Waitable: std::os::fd::AsFd {}
#[cfg(unix)]
impl<T: std::os::fd::AsFd> Waitable for T {}
/// A handle; elsewhere a read waits as long as it likes.
#[cfg(not(unix))]
pub(crate) trait Waitable {}
#[cfg(not(unix))]
impl<T> Waitable for T {}

/// True if there are bytes, or an end, within `patience`.
#[cfg(unix)]
pub(crate) fn ready(input: &impl Waitable, patience: Duration) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let timeout = Timespec {
        tv_sec: patience.as_secs().try_into().unwrap_or(i64::MAX),
        tv_nsec: patience.subsec_nanos().into(),
    };
    let mut waiting = [PollFd::new(input, PollFlags::IN)];
    match poll(&mut waiting, Some(&timeout)) {
        Ok(ready) => Ok(ready > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(unix))]
pub(crate) fn ready(_: &impl Waitable, _: Duration) -> io::Result<bool> {
    Ok(true)
}

struct Once<T>(T);

impl<T: Waitable + Send> Port for Once<T>
where
    T: ReadNow,
{
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if !ready(&self.0, patience)? {
            return Ok(Received::Nothing);
        }
        Ok(match received(self.0.read_now(buffer))? {
            Received::End => Received::Done,
            other => other,
        })
    }

    fn write(&mut self, _: &[u8]) -> io::Result<()> {
        // There is no way back to whoever writes.
        Ok(())
    }
}

/// Reads past every buffer of this process: what it held could not be waited for.
trait ReadNow {
    fn read_now(&mut self, buffer: &mut [u8]) -> io::Result<usize>;
}

impl ReadNow for File {
    fn read_now(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.read(buffer)
    }
}

impl ReadNow for io::Stdin {
    #[cfg(unix)]
    fn read_now(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(rustix::io::read(&*self, buffer)?)
    }

    #[cfg(not(unix))]
    fn read_now(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.lock().read(buffer)
    }
}
