//! Commands to a virtual device while it runs: lines of JSON that move what presses.

use std::io::{self, BufRead, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::time::Duration;

use serde::Deserialize;
use taxel::acquisition::Press;

use super::error::DeviceError;
use super::outlet::server_address;

/// Where commands come from, as the command line names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ControlPlace {
    /// A TCP server on this address.
    Tcp(String),
    /// Lines of the standard input.
    StandardInput,
}

impl ControlPlace {
    /// Reads the name of a place.
    ///
    /// # Errors
    /// [`DeviceError::Place`] with what is wrong and how places are written.
    pub fn parse(text: &str) -> Result<Self, DeviceError> {
        let wrong = |message: String| DeviceError::Place {
            option: "--control",
            text: text.into(),
            message,
        };
        match text.split_once(':') {
            _ if text == "-" => Ok(Self::StandardInput),
            Some(("tcp", rest)) => server_address(rest).map(Self::Tcp).map_err(wrong),
            _ => Err(wrong("is no place for commands; use tcp:PORT or -".into())),
        }
    }
}

/// Longest line, bytes.
const LONGEST_LINE: u64 = 4096;
/// Clients at a time.
const MOST_CLIENTS: usize = 8;
/// Commands that wait.
const WAITING: usize = 64;
/// Longest wait for an answer of the device.
const PATIENCE: Duration = Duration::from_secs(2);

/// A command as it is written.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Request {
    /// Presses from now on at this place with this force.
    Move(Move),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Move {
    #[serde(default)]
    at_m: [f64; 2],
    force_n: [f64; 3],
    #[serde(default = "usual_radius")]
    radius_m: f64,
}

fn usual_radius() -> f64 {
    4e-3
}

/// A command to the player, and the way of its answer.
pub(super) struct Command {
    pub(super) press: Press,
    answer: Option<Sender<String>>,
}

impl Command {
    /// Says that it is done, with the number of the first frame that shows it.
    pub(super) fn done(&self, sequence: u64) {
        self.answer(&format!("{{\"moved\":true,\"from_sequence\":{sequence}}}"));
    }

    /// Says why it cannot be done.
    pub(super) fn refused(&self, why: &str) {
        self.answer(&serde_json::json!({ "error": why }).to_string());
    }

    fn answer(&self, line: &str) {
        if let Some(answer) = &self.answer {
            // The client may have gone.
            let _ = answer.send(line.into());
        }
    }
}

/// Reads one command.
fn read(line: &[u8]) -> Result<Press, String> {
    let Request::Move(wanted) = serde_json::from_slice(line).map_err(|error| error.to_string())?;
    let numbers = wanted.at_m.iter().chain(&wanted.force_n);
    if !numbers
        .chain([&wanted.radius_m])
        .all(|number| number.abs() < 1e3)
    {
        return Err("a number is not finite or far too large: m and N are meant".into());
    }
    if wanted.radius_m < 1e-6 {
        return Err("radius_m must be at least 1e-6".into());
    }
    Ok(Press {
        at: wanted.at_m,
        force: wanted.force_n,
        radius: wanted.radius_m,
    })
}

/// Listens from now on: the commands, and the name of the place.
pub(super) fn listen(place: &ControlPlace) -> Result<(Receiver<Command>, String), DeviceError> {
    let (sender, commands) = sync_channel(WAITING);
    let name = match place {
        ControlPlace::StandardInput => {
            std::thread::spawn(move || lines(io::stdin().lock(), &sender, None));
            "-".to_owned()
        }
        ControlPlace::Tcp(address) => {
            let fail = |cause| DeviceError::Wire {
                name: address.clone(),
                cause,
            };
            let listener = TcpListener::bind(address).map_err(fail)?;
            let name = format!("tcp:{}", listener.local_addr().map_err(fail)?);
            std::thread::spawn(move || accept(&listener, &sender));
            name
        }
    };
    Ok((commands, name))
}

fn accept(listener: &TcpListener, commands: &SyncSender<Command>) {
    let clients = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else { continue };
        if clients.load(Ordering::Relaxed) >= MOST_CLIENTS {
            continue;
        }
        clients.fetch_add(1, Ordering::Relaxed);
        let (commands, clients) = (commands.clone(), Arc::clone(&clients));
        std::thread::spawn(move || {
            let _ = stream.set_nodelay(true);
            if let Ok(input) = stream.try_clone() {
                lines(BufReader::new(input), &commands, Some(stream));
            }
            clients.fetch_sub(1, Ordering::Relaxed);
        });
    }
}

/// Hands the commands of one client on, and the answers back, until it goes.
fn lines(mut input: impl BufRead, commands: &SyncSender<Command>, mut output: Option<TcpStream>) {
    let mut line = Vec::new();
    loop {
        line.clear();
        let read_line = input
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line);
        if !matches!(read_line, Ok(1..)) {
            return;
        }
        let answer = if line.len() as u64 == LONGEST_LINE && !line.ends_with(b"\n") {
            Err(format!("a line has at most {LONGEST_LINE} bytes"))
        } else {
            read(&line).and_then(|press| {
                let (sender, answer) = channel();
                let command = Command {
                    press,
                    answer: output.is_some().then_some(sender),
                };
                if commands.send(command).is_err() {
                    return Err("the device has ended".into());
                }
                let waits = output.is_some();
                let patience = if waits { PATIENCE } else { Duration::ZERO };
                let answered = answer.recv_timeout(patience);
                Ok(answered.unwrap_or_else(|_| "{\"moved\":null}".into()))
            })
        };
        let answer = answer.unwrap_or_else(|why| serde_json::json!({ "error": why }).to_string());
        if let Some(output) = &mut output
            && writeln!(output, "{answer}").is_err()
        {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_and_mistakes_named() {
        let press = read(br#"{"move":{"force_n":[0,0,0.5]}}"#).unwrap();
        assert_eq!((press.at, press.force), ([0.0; 2], [0.0, 0.0, 0.5]));
        for (line, expected) in [
            (&br#"{"move":{"force":[0,0,1]}}"#[..], "force"),
            (br#"{"lift":{}}"#, "lift"),
            (br#"{"move":{"force_n":[0,0,1e9]}}"#, "m and N"),
            (br#"{"move":{"force_n":[0,0,1],"radius_m":0}}"#, "radius_m"),
            (b"[[[[", "expected value"),
        ] {
            let message = read(line).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
