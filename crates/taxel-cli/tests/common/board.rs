//! Boards, virtual devices and running services for the tests of links.
#![allow(dead_code, reason = "not every test needs all")]

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::Folder;

/// A board that sends 256 counts, with number, time and check.
const BOARD: &str = r#"
schema = 1
name = "256 counts"
[link.serial]
baud = 4_000_000
native_usb = true
[framing.cobs]
[packet]
fields = [
  { is = "sequence", type = "u32" },
  { is = "time", type = "u64", unit = "us" },
  { is = "value", name = "c{1..256}", type = "u16" },
]
check = { kind = "CRC-32/ISO-HDLC" }
"#;

/// The board file in `folder`.
pub(crate) fn board(folder: &Folder) -> String {
    let path = folder.path("board.toml");
    fs::write(&path, BOARD).unwrap();
    path
}

/// A program that runs beside the test and is ended with it.
pub(crate) struct Beside {
    child: Child,
    /// Its first line: the name of a port, or the address of the page.
    pub(crate) line: String,
    pub(crate) input: Option<ChildStdin>,
}

impl Beside {
    /// Starts `taxel` and waits for its first line.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        output.read_line(&mut line).unwrap();
        let input = child.stdin.take();
        // What follows is read, so that it never waits for this test.
        std::thread::spawn(move || {
            let mut rest = Vec::new();
            let _ = output.read_to_end(&mut rest);
        });
        Self {
            child,
            line: line.trim().to_owned(),
            input,
        }
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A virtual three-axis array on `place`.
pub(crate) fn device(board: &str, place: &str, more: &[&str]) -> Beside {
    let mut arguments = vec!["device", "three-axis-8x8", "--board", board, "--on", place];
    arguments.extend(more);
    Beside::start(&arguments)
}

/// A WebSocket to the page at `address` whose answers are not read yet.
pub(crate) fn web_socket(address: &str) -> TcpStream {
    let rest = address.strip_prefix("http://").unwrap();
    let (host, query) = rest.split_once("/?").unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let request = format!(
        "GET /ws?{query} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).unwrap();
    stream
}

/// Objects of the lines of a text.
pub(crate) fn objects(text: &str) -> Vec<Value> {
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Waits until `met`, for at most ten seconds.
#[track_caller]
pub(crate) fn wait_until(mut met: impl FnMut() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(10);
    while !met() {
        assert!(Instant::now() < deadline, "it did not come about in 10 s");
        std::thread::sleep(Duration::from_millis(10));
    }
}
