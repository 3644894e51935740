//! Where a virtual device sends its bytes.

use std::io::{self, Read as _, Write as _};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::path::PathBuf;

use super::error::DeviceError;

/// Where a virtual device sends its bytes, as the command line names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DevicePlace {
    /// A pseudo terminal, with a link of this name that leads to it.
    Terminal(Option<PathBuf>),
    /// A TCP server on this address.
    Tcp(String),
    /// Datagrams to this address.
    Udp(String),
    /// The standard output.
    StandardOutput,
}

/// How places are written, for messages.
const FORMS: &str = "pty, pty:LINK, tcp:PORT, tcp:HOST:PORT, udp:HOST:PORT, or -";

impl DevicePlace {
    /// Reads the name of a place.
    ///
    /// # Errors
    /// [`DeviceError::Place`] with what is wrong and how places are written.
    pub fn parse(text: &str) -> Result<Self, DeviceError> {
        let wrong = |message: String| DeviceError::Place {
            option: "--on",
            text: text.into(),
            message,
        };
        match text.split_once(':').unwrap_or((text, "")) {
            ("-", "") => Ok(Self::StandardOutput),
            ("pty", "") if cfg!(unix) => Ok(Self::Terminal(None)),
            ("pty", link) if cfg!(unix) => Ok(Self::Terminal(Some(link.into()))),
            ("pty", _) => Err(wrong(
                "this system has no pseudo terminals; use tcp:PORT".into(),
            )),
            ("tcp", rest) => server_address(rest).map(Self::Tcp).map_err(wrong),
            ("udp", rest) => match rest.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
                    Ok(Self::Udp(rest.into()))
                }
                _ => Err(wrong(
                    "needs host and port, such as udp:localhost:9000".into(),
                )),
            },
            _ => Err(wrong(format!("is no place for a wire; use {FORMS}"))),
        }
    }
}

/// `PORT` on the loopback, or `HOST:PORT`; port 0 takes a free one.
pub(super) fn server_address(text: &str) -> Result<String, String> {
    let (host, port) = text.rsplit_once(':').unwrap_or(("127.0.0.1", text));
    match port.parse::<u16>() {
        Ok(_) if !host.is_empty() => Ok(format!("{host}:{port}")),
        _ => Err(format!(
            "\"{text}\" is no address; give a port from 0 to 65535, such as tcp:7000, or HOST:PORT"
        )),
    }
}

/// An open place. What cannot be sent at once waits, up to a limit.
pub(super) trait Outlet {
    /// Name that leads to it.
    fn name(&self) -> String;

    /// Looks for connections: how many are new.
    fn connections(&mut self) -> io::Result<usize>;

    /// True if somebody is connected.
    fn connected(&self) -> bool;

    /// What was written to it since it was last asked; some do not hear.
    fn heard(&mut self) -> Vec<u8> {
        Vec::new()
    }

    /// Sends bytes to all.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Unplugs it.
    fn leave(&mut self);

    /// Plugs it in again.
    fn come_back(&mut self) -> io::Result<()>;
}

pub(super) fn open(place: &DevicePlace) -> Result<Box<dyn Outlet>, DeviceError> {
    let fail = |name: &str| {
        let name = name.to_owned();
        move |cause: io::Error| DeviceError::Wire { name, cause }
    };
    Ok(match place {
        #[cfg(unix)]
        DevicePlace::Terminal(link) => {
            Box::new(terminal::Terminal::open(link.clone()).map_err(fail("pty"))?)
        }
        #[cfg(not(unix))]
        DevicePlace::Terminal(_) => {
            return Err(fail("pty")(io::ErrorKind::Unsupported.into()));
        }
        DevicePlace::Tcp(address) => Box::new(Server::open(address).map_err(fail(address))?),
        DevicePlace::Udp(address) => Box::new(Datagrams::open(address).map_err(fail(address))?),
        DevicePlace::StandardOutput => Box::new(StandardOutput),
    })
}

/// Bytes that may wait for a client; more and it is too slow for this board.
const WAITING: usize = 4 << 20;

struct Client {
    stream: TcpStream,
    waiting: Vec<u8>,
}

impl Client {
    /// Sends what waits and `bytes` as far as they go; an error ends the client.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.waiting.extend_from_slice(bytes);
        let mut sent = 0;
        while sent < self.waiting.len() {
            match self.stream.write(&self.waiting[sent..]) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(bytes) => sent += bytes,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.waiting.drain(..sent);
        if self.waiting.len() > WAITING {
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(())
    }

    /// True while the other side is there; what it says is added to `heard`.
    fn alive(&mut self, heard: &mut Vec<u8>) -> bool {
        let mut buffer = [0; 256];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => return false,
                Ok(bytes) => hear(heard, &buffer[..bytes]),
                Err(error) => {
                    return matches!(
                        error.kind(),
                        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
                    );
                }
            }
        }
    }
}

/// Most bytes that are kept of what a computer says.
const MOST_HEARD: usize = 256;

/// Keeps the first bytes of what is said.
fn hear(heard: &mut Vec<u8>, bytes: &[u8]) {
    let room = MOST_HEARD.saturating_sub(heard.len());
    heard.extend(bytes.iter().take(room));
}

struct Server {
    heard: Vec<u8>,
    address: String,
    listener: Option<TcpListener>,
    clients: Vec<Client>,
}

impl Server {
    fn open(address: &str) -> io::Result<Self> {
        let mut server = Self {
            heard: Vec::new(),
            address: address.into(),
            listener: None,
            clients: Vec::new(),
        };
        server.come_back()?;
        Ok(server)
    }
}

impl Outlet for Server {
    fn name(&self) -> String {
        format!("tcp:{}", self.address)
    }

    fn connections(&mut self) -> io::Result<usize> {
        let heard = &mut self.heard;
        self.clients
            .retain_mut(|client| client.alive(heard) && client.send(&[]).is_ok());
        let Some(listener) = &self.listener else {
            return Ok(0);
        };
        let before = self.clients.len();
        while let Ok((stream, _)) = listener.accept() {
            stream.set_nonblocking(true)?;
            let _ = stream.set_nodelay(true);
            self.clients.push(Client {
                stream,
                waiting: Vec::new(),
            });
        }
        Ok(self.clients.len() - before)
    }

    fn connected(&self) -> bool {
        !self.clients.is_empty()
    }

    fn heard(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.heard)
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.clients.retain_mut(|client| client.send(bytes).is_ok());
        Ok(())
    }

    fn leave(&mut self) {
        self.clients.clear();
        self.listener = None;
    }

    fn come_back(&mut self) -> io::Result<()> {
        let listener = TcpListener::bind(&self.address)?;
        listener.set_nonblocking(true)?;
        // A free port stays the same when the device comes back.
        self.address = listener.local_addr()?.to_string();
        self.listener = Some(listener);
        Ok(())
    }
}

struct Datagrams {
    address: String,
    socket: UdpSocket,
    plugged: bool,
}

impl Datagrams {
    fn open(address: &str) -> io::Result<Self> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        socket.connect(address)?;
        socket.set_nonblocking(true)?;
        Ok(Self {
            address: address.into(),
            socket,
            plugged: true,
        })
    }
}

impl Outlet for Datagrams {
    fn name(&self) -> String {
        format!("udp:{}", self.address)
    }

    fn connections(&mut self) -> io::Result<usize> {
        Ok(0)
    }

    fn connected(&self) -> bool {
        self.plugged
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        // Nobody may listen: that is no matter of the sender.
        let _ = self.socket.send(bytes);
        Ok(())
    }

    fn leave(&mut self) {
        self.plugged = false;
    }

    fn come_back(&mut self) -> io::Result<()> {
        self.plugged = true;
        Ok(())
    }
}

struct StandardOutput;

impl Outlet for StandardOutput {
    fn name(&self) -> String {
        "-".into()
    }

    fn connections(&mut self) -> io::Result<usize> {
        Ok(0)
    }

    fn connected(&self) -> bool {
        true
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut output = io::stdout().lock();
        output.write_all(bytes).and_then(|()| output.flush())
    }

    fn leave(&mut self) {}

    fn come_back(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(unix)]
mod terminal {
    use std::fs;
    use std::os::fd::OwnedFd;
    use std::path::{Path, PathBuf};

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

    use super::{Outlet, io};

    /// The computer's end is a terminal with a name; this is the board's end.
    struct Pair {
        board: OwnedFd,
        name: String,
    }

    impl Pair {
        fn open() -> io::Result<Self> {
            let board = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
            grantpt(&board)?;
            unlockpt(&board)?;
            let name = ptsname(&board, Vec::new())?;
            let name = name.to_string_lossy().into_owned();
            // Opened and closed once: from now on the system tells whether it is open.
            let computer = fs::OpenOptions::new().read(true).write(true).open(&name)?;
            let mut settings = tcgetattr(&computer)?;
            settings.make_raw();
            tcsetattr(&computer, OptionalActions::Now, &settings)?;
            rustix::io::ioctl_fionbio(&board, true)?;
            Ok(Self { board, name })
        }

        fn is_open(&self) -> bool {
            let mut waiting = [PollFd::new(&self.board, PollFlags::OUT)];
            let now = Timespec {
                tv_sec: 0,
                tv_nsec: 0,
            };
            let polled = poll(&mut waiting, Some(&now));
            polled.is_ok() && !waiting[0].revents().contains(PollFlags::HUP)
        }
    }

    /// A pseudo terminal.
    pub(super) struct Terminal {
        pair: Option<Pair>,
        link: Option<PathBuf>,
        open: bool,
        waiting: Vec<u8>,
        heard: Vec<u8>,
    }

    impl Terminal {
        pub(super) fn open(link: Option<PathBuf>) -> io::Result<Self> {
            if let Some(link) = &link
                && fs::symlink_metadata(link).is_ok()
            {
                let message = format!("{} exists; name a new link", taxel::shown::path(link));
                return Err(io::Error::other(message));
            }
            let mut terminal = Self {
                pair: None,
                link,
                open: false,
                waiting: Vec::new(),
                heard: Vec::new(),
            };
            terminal.come_back()?;
            Ok(terminal)
        }
    }

    impl Outlet for Terminal {
        fn name(&self) -> String {
            let own = self.pair.as_ref().map_or("", |pair| &pair.name);
            let link = self.link.as_deref().map(taxel::shown::path);
            link.unwrap_or_else(|| own.to_owned())
        }

        fn connections(&mut self) -> io::Result<usize> {
            let Some(pair) = &self.pair else { return Ok(0) };
            let open = pair.is_open();
            let new = open && !self.open;
            self.open = open;
            if open {
                // What the computer says must not pile up.
                let mut said = [0; 256];
                while let Ok(bytes @ 1..) = rustix::io::read(&pair.board, &mut said) {
                    super::hear(&mut self.heard, &said[..bytes]);
                }
            }
            self.send(&[])?;
            Ok(new.into())
        }

        fn connected(&self) -> bool {
            self.open
        }

        fn heard(&mut self) -> Vec<u8> {
            std::mem::take(&mut self.heard)
        }

        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            let Some(pair) = self.pair.as_ref().filter(|_| self.open) else {
                self.waiting.clear();
                return Ok(());
            };
            self.waiting.extend_from_slice(bytes);
            let mut sent = 0;
            while sent < self.waiting.len() {
                match rustix::io::write(&pair.board, &self.waiting[sent..]) {
                    Ok(bytes) => sent += bytes,
                    Err(rustix::io::Errno::AGAIN | rustix::io::Errno::IO) => break,
                    Err(rustix::io::Errno::INTR) => {}
                    Err(error) => return Err(error.into()),
                }
            }
            self.waiting.drain(..sent);
            if self.waiting.len() > super::WAITING {
                // The computer does not read: what waits is lost, as with a real board.
                self.waiting.clear();
            }
            Ok(())
        }

        fn leave(&mut self) {
            self.remove_link();
            self.pair = None;
            self.open = false;
        }

        fn come_back(&mut self) -> io::Result<()> {
            let pair = Pair::open()?;
            if let Some(link) = &self.link {
                std::os::unix::fs::symlink(&pair.name, link)?;
            }
            self.pair = Some(pair);
            Ok(())
        }
    }

    impl Terminal {
        fn remove_link(&self) {
            let (Some(link), Some(pair)) = (&self.link, &self.pair) else {
                return;
            };
            // Only what is ours.
            if fs::read_link(link).is_ok_and(|target| target == Path::new(&pair.name)) {
                let _ = fs::remove_file(link);
            }
        }
    }

    impl Drop for Terminal {
        fn drop(&mut self) {
            self.remove_link();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read() {
        let parsed = |text: &str| DevicePlace::parse(text).unwrap();
        assert_eq!(parsed("-"), DevicePlace::StandardOutput);
        assert_eq!(
            parsed("tcp:7000"),
            DevicePlace::Tcp("127.0.0.1:7000".into())
        );
        assert_eq!(
            parsed("tcp:0.0.0.0:7000"),
            DevicePlace::Tcp("0.0.0.0:7000".into())
        );
        assert_eq!(
            parsed("udp:localhost:9"),
            DevicePlace::Udp("localhost:9".into())
        );
        for (text, expected) in [
            ("tcp:", "tcp:7000"),
            ("udp:9", "udp:localhost"),
            ("usb", "pty"),
        ] {
            let message = DevicePlace::parse(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
