//! Programs that write bytes: a closed library, a data acquisition card.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::error::LinkError;
use super::port::{Link, Port, Received, received};
use super::stream::ready;

/// Time between the request to end and the end.
const PATIENCE: Duration = Duration::from_secs(2);
/// Longest line of its standard error that is passed on whole, bytes.
const LONGEST_LINE: u64 = 4096;

/// Hears what the operator should know.
pub(crate) type Tell = Arc<dyn Fn(&str) + Send + Sync>;

/// A program that is started without a shell, in a process group of its own.
pub(crate) struct Program {
    words: Vec<String>,
    tell: Tell,
}

impl Program {
    /// `words` are the program and its arguments.
    pub(crate) fn new(words: Vec<String>, tell: Tell) -> Self {
        Self { words, tell }
    }

    fn program(&self) -> &str {
        self.words.first().map_or("", String::as_str)
    }
}

impl Link for Program {
    fn name(&self) -> String {
        format!("exec:{}", self.program())
    }

    fn waits(&self) -> bool {
        true
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        let mut command = Command::new(self.program());
        command
            .args(&self.words[1..])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        own_group(&mut command);
        let refuse = |reason: String| LinkError::Never {
            name: self.name(),
            reason,
        };
        let mut child = command
            .spawn()
            .map_err(|error| refuse(format!("cannot be started: {error}")))?;
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(refuse("has no standard output".into()));
        };
        let (name, tell) = (self.program().to_owned(), Arc::clone(&self.tell));
        // It ends with the standard error of the program.
        std::thread::spawn(move || pass_on(errors, &name, &*tell));
        Ok(Box::new(Running {
            input: child.stdin.take(),
            output,
            child,
            ended: None,
        }))
    }
}

/// Hands the lines of the standard error on, with the name of the program.
fn pass_on(errors: impl io::Read, name: &str, tell: &(dyn Fn(&str) + Send + Sync)) {
    let mut errors = BufReader::new(errors);
    let mut line = Vec::new();
    loop {
        line.clear();
        let read = errors
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line);
        if !matches!(read, Ok(1..)) {
            return;
        }
        let text = String::from_utf8_lossy(&line);
        tell(&format!("{name}: {}", text.trim_end()));
    }
}

struct Running {
    child: Child,
    input: Option<ChildStdin>,
    output: ChildStdout,
    /// Since when the program has ended while its output is held open by another that it began.
    ended: Option<Instant>,
}

impl Port for Running {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if !ready(&self.output, patience)? {
            let Some(status) = self.child.try_wait()? else {
                return Ok(Received::Nothing);
            };
            return match self.ended.get_or_insert_with(Instant::now).elapsed() {
                held if held < PATIENCE => Ok(Received::Nothing),
                _ if status.success() => Ok(Received::Done),
                _ => Err(io::Error::other(format!("the program ended: {status}"))),
            };
        }
        let read = received(self.output.read(buffer))?;
        if read != Received::End {
            return Ok(read);
        }
        // Its standard output is closed; it may still be ending.
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            match self.child.try_wait()? {
                Some(status) if status.success() => return Ok(Received::Done),
                Some(status) => {
                    return Err(io::Error::other(format!("the program ended: {status}")));
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        }
        Ok(Received::End)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.input {
            Some(input) => input.write_all(bytes).and_then(|()| input.flush()),
            None => Ok(()),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.input.take());
        if matches!(self.child.try_wait(), Ok(Some(_))) {
            if self.ended.is_some() {
                // Others of its group hold its output.
                ask_to_end(&mut self.child);
            }
            return;
        }
        ask_to_end(&mut self.child);
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        end(&mut self.child);
        let _ = self.child.wait();
    }
}

#[cfg(unix)]
fn own_group(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    // Ctrl-C is for us: the program is ended when its bytes are no longer read.
    command.process_group(0);
}

#[cfg(not(unix))]
fn own_group(_: &mut Command) {}

#[cfg(unix)]
fn signal(child: &Child, signal: rustix::process::Signal) {
    let group = i32::try_from(child.id())
        .ok()
        .and_then(rustix::process::Pid::from_raw);
    if let Some(group) = group {
        let _ = rustix::process::kill_process_group(group, signal);
    }
}

#[cfg(unix)]
fn ask_to_end(child: &mut Child) {
    signal(child, rustix::process::Signal::TERM);
}

#[cfg(unix)]
fn end(child: &mut Child) {
    signal(child, rustix::process::Signal::KILL);
}

#[cfg(not(unix))]
fn ask_to_end(child: &mut Child) {
    let _ = child.kill();
}

#[cfg(not(unix))]
fn end(child: &mut Child) {
    let _ = child.kill();
}
