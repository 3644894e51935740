//! Names of links on the command line.

use std::net::Ipv4Addr;
use std::path::PathBuf;

use super::error::LinkError;

/// A link as the command line names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkAddress {
    /// A serial port.
    Serial(SerialName),
    /// Host and port of a TCP server.
    Tcp(String),
    /// Host and port of a WebSocket server, and the path there.
    WebSocket {
        /// Host and port.
        host: String,
        /// The path, with the stroke that it begins with.
        path: String,
    },
    /// A UDP port of this machine.
    Udp {
        /// The port.
        port: u16,
        /// A multicast group to join.
        group: Option<Ipv4Addr>,
        /// The board, of others that send to the port.
        sender: Option<Ipv4Addr>,
    },
    /// The standard input, read once.
    StandardInput,
    /// A named pipe, read once.
    Pipe(PathBuf),
    /// A program and its arguments, started without a shell.
    Program(Vec<String>),
}

/// A serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SerialName {
    /// The one port whose USB names are those of the board file.
    Auto,
    /// The port of this name.
    Named(String),
}

/// How links are written, for messages.
const FORMS: &str = "serial:PORT, serial:auto, tcp:HOST:PORT, ws:HOST:PORT/PATH, udp:PORT[@GROUP|@SENDER], -, a named pipe, or exec:\"PROGRAM ARGUMENTS\"";

impl LinkAddress {
    /// True if `text` begins like a link and not like a recording or the twin.
    pub fn is_one(text: &str) -> bool {
        let kind = text.split_once(':').map(|(kind, _)| kind);
        text == "-"
            || matches!(kind, Some("serial" | "tcp" | "ws" | "udp" | "exec"))
            || (kind.is_none() && is_pipe(text))
    }

    /// Reads the name of a link.
    ///
    /// # Errors
    /// [`LinkError::Address`] with what is wrong and how links are written.
    pub fn parse(text: &str) -> Result<Self, LinkError> {
        let wrong = |message: String| LinkError::Address {
            text: text.into(),
            message,
        };
        if text == "-" {
            return Ok(Self::StandardInput);
        }
        let Some((kind, rest)) = text.split_once(':') else {
            if is_pipe(text) {
                return Ok(Self::Pipe(text.into()));
            }
            return Err(wrong(format!("is no link; use {FORMS}")));
        };
        match kind {
            "serial" => match rest {
                "" => Err(wrong(
                    "names no port; `taxel devices` lists them, and serial:auto takes the one that fits the board file".into(),
                )),
                "auto" => Ok(Self::Serial(SerialName::Auto)),
                name => Ok(Self::Serial(SerialName::Named(name.into()))),
            },
            "tcp" => tcp(rest).map(Self::Tcp).map_err(wrong),
            "ws" => web_socket(rest).map_err(wrong),
            "udp" => udp(rest).map_err(wrong),
            "exec" => words(rest).map(Self::Program).map_err(wrong),
            _ => Err(wrong(format!("\"{kind}\" is no kind of link; use {FORMS}"))),
        }
    }
}

#[cfg(unix)]
fn is_pipe(text: &str) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    std::fs::metadata(text).is_ok_and(|about| about.file_type().is_fifo())
}

#[cfg(not(unix))]
fn is_pipe(_: &str) -> bool {
    false
}

fn port(text: &str) -> Result<u16, String> {
    let wrong = || format!("\"{text}\" is no port; give a number from 1 to 65535");
    match text.parse() {
        Ok(0) | Err(_) => Err(wrong()),
        Ok(port) => Ok(port),
    }
}

fn tcp(rest: &str) -> Result<String, String> {
    let (host, number) = rest
        .rsplit_once(':')
        .ok_or("needs host and port, such as tcp:localhost:7000")?;
    port(number)?;
    let host = if host.is_empty() { "localhost" } else { host };
    Ok(format!("{host}:{number}"))
}

fn web_socket(rest: &str) -> Result<LinkAddress, String> {
    let rest = rest.strip_prefix("//").unwrap_or(rest);
    let (host, path) = match rest.find('/') {
        Some(at) => rest.split_at(at),
        None => (rest, "/"),
    };
    let plain = |c: char| c.is_ascii_graphic();
    if !path.chars().all(plain) {
        return Err(format!(
            "\"{path}\" is no path: it has letters without accents, digits and signs"
        ));
    }
    let host =
        tcp(host).map_err(|_| "needs host and port, such as ws:localhost:5000/".to_owned())?;
    Ok(LinkAddress::WebSocket {
        host,
        path: path.into(),
    })
}

fn udp(rest: &str) -> Result<LinkAddress, String> {
    let (number, address) = match rest.split_once('@') {
        None => (rest, None),
        Some((number, address)) => {
            let parsed: Option<Ipv4Addr> = address.parse().ok();
            let parsed = parsed.ok_or_else(|| {
                format!("\"{address}\" is no address; give that of the board, or a multicast group from 224.0.0.0 to 239.255.255.255")
            })?;
            (number, Some(parsed))
        }
    };
    let group = address.filter(Ipv4Addr::is_multicast);
    let sender = address.filter(|address| !address.is_multicast());
    Ok(LinkAddress::Udp {
        port: port(number)?,
        group,
        sender,
    })
}

/// The words of a command: separated by blanks, held together by quotes; a backslash takes the
/// next character as it is, but for within single quotes.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    let mut characters = text.chars();
    while let Some(c) = characters.next() {
        match (c, quote) {
            ('\\', None | Some('"')) => {
                let next = characters
                    .next()
                    .ok_or("ends in a backslash; write two for one")?;
                word.get_or_insert_default().push(next);
            }
            ('"' | '\'', None) => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (c, Some(open)) if c == open => quote = None,
            (c, None) if c.is_whitespace() => words.extend(word.take()),
            (c, _) => word.get_or_insert_default().push(c),
        }
    }
    if let Some(open) = quote {
        return Err(format!("a quote {open} is not closed"));
    }
    words.extend(word);
    if words.is_empty() {
        return Err("names no program, such as exec:\"./daq.py --rate 1000\"".into());
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_read() {
        let parsed = |text: &str| LinkAddress::parse(text).unwrap();
        assert_eq!(parsed("-"), LinkAddress::StandardInput);
        assert_eq!(parsed("serial:auto"), LinkAddress::Serial(SerialName::Auto));
        let named = SerialName::Named("/dev/ttyACM0".into());
        assert_eq!(parsed("serial:/dev/ttyACM0"), LinkAddress::Serial(named));
        assert_eq!(
            parsed("tcp::7000"),
            LinkAddress::Tcp("localhost:7000".into())
        );
        for text in ["ws:xela:5000/live?x=1", "ws://xela:5000/live?x=1"] {
            let (host, path) = ("xela:5000".into(), "/live?x=1".into());
            assert_eq!(parsed(text), LinkAddress::WebSocket { host, path });
        }
        assert_eq!(
            parsed("tcp:[::1]:7000"),
            LinkAddress::Tcp("[::1]:7000".into())
        );
        let group = Some(Ipv4Addr::new(239, 1, 2, 3));
        assert_eq!(
            parsed("udp:9000@239.1.2.3"),
            LinkAddress::Udp {
                port: 9000,
                group,
                sender: None
            }
        );
        assert_eq!(
            parsed("udp:9000@10.0.0.7"),
            LinkAddress::Udp {
                port: 9000,
                group: None,
                sender: Some(Ipv4Addr::new(10, 0, 0, 7))
            }
        );
        let program = ["./a b", "--rate", "10 00", ""].map(String::from).to_vec();
        let text = "exec:'./a b' --rate  10\\ 00 \"\"";
        assert_eq!(parsed(text), LinkAddress::Program(program));
    }

    #[test]
    fn what_is_no_link_is_refused_with_what_to_write() {
        for (text, expected) in [
            ("serial:", "taxel devices"),
            ("tcp:localhost", "tcp:localhost:7000"),
            ("tcp:localhost:0", "1 to 65535"),
            ("udp:70000", "1 to 65535"),
            ("udp:7000@10.0.0", "224.0.0.0"),
            ("ws:localhost", "ws:localhost:5000"),
            ("ws:localhost:1/a b", "is no path"),
            ("exec:", "names no program"),
            ("exec:\"a", "is not closed"),
            ("usb:1", "tcp:HOST:PORT"),
        ] {
            let message = LinkAddress::parse(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
