//! What is plugged in: serial ports, their USB names, who may open them and what holds them.

use std::fs;
use std::path::{Path, PathBuf};
use taxel::shown;

use serialport::{ErrorKind, SerialPortType};

/// USB names of a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbNames {
    /// Number of the vendor.
    pub vendor: u16,
    /// Number of the product.
    pub product: u16,
    /// Name of the vendor.
    pub vendor_name: Option<String>,
    /// Name of the product.
    pub product_name: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
}

/// A serial port of this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundPort {
    /// Name by the system, which can change from start to start.
    pub path: String,
    /// Name that stays with the board.
    pub by_id: Option<String>,
    /// Its USB names; `None` for a port that is not on USB.
    pub usb: Option<UsbNames>,
}

/// A program that has a port open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// Its process number.
    pub process: u32,
    /// Its name.
    pub name: String,
}

/// The serial ports of this machine, by name.
pub fn found_ports() -> Vec<FoundPort> {
    let mut ports: Vec<FoundPort> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| FoundPort {
            by_id: by_id_of(&port.port_name),
            usb: match port.port_type {
                SerialPortType::UsbPort(usb) => Some(UsbNames {
                    vendor: usb.vid,
                    product: usb.pid,
                    vendor_name: usb.manufacturer,
                    product_name: usb.product,
                    serial: usb.serial_number.filter(|serial| !serial.is_empty()),
                }),
                _ => None,
            },
            path: port.port_name,
        })
        .collect();
    ports.sort_by(|one, other| one.path.cmp(&other.path));
    ports
}

/// The port behind `path`, which may be a link to it.
pub(crate) fn found_port(path: &str) -> Option<FoundPort> {
    let file = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    found_ports()
        .into_iter()
        .find(|port| Path::new(&port.path) == file)
}

/// The name below `/dev/serial/by-id` that leads to the port.
pub(crate) fn by_id_of(path: &str) -> Option<String> {
    link_to(Path::new("/dev/serial/by-id"), path)
}

fn link_to(folder: &Path, path: &str) -> Option<String> {
    let file = fs::canonicalize(path).ok()?;
    let mut names: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|link| fs::canonicalize(link).is_ok_and(|target| target == file))
        .collect();
    names.sort();
    names.first().map(|name| shown::path(name))
}

/// File that sets how long an FTDI adapter holds bytes back.
pub(crate) fn latency_timer_file(path: &str) -> PathBuf {
    let file = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let name = file.file_name().unwrap_or_default().to_owned();
    Path::new("/sys/class/tty")
        .join(name)
        .join("device/latency_timer")
}

/// How long an FTDI adapter holds bytes back, ms.
pub(crate) fn latency_timer(path: &str) -> Option<u32> {
    let text = fs::read_to_string(latency_timer_file(path)).ok()?;
    text.trim().parse().ok()
}

/// Why a port could not be opened, and what to do.
pub(crate) fn why_not(path: &str, error: &serialport::Error) -> String {
    if !Path::new(path).exists() && cfg!(unix) {
        return "there is no such port; `taxel devices` lists what is plugged in".into();
    }
    if matches!(
        error.kind(),
        ErrorKind::Io(std::io::ErrorKind::PermissionDenied)
    ) {
        return refused(path);
    }
    let holders = holders(path);
    if !holders.is_empty() {
        let names: Vec<_> = holders
            .iter()
            .map(|holder| format!("{} (process {})", holder.name, holder.process))
            .collect();
        return format!("is open in {}; close it there", names.join(" and "));
    }
    error.to_string()
}

impl FoundPort {
    /// The group whose members may open the port, where it has one.
    pub fn group(&self) -> Option<String> {
        group_of(&self.path)
    }

    /// `None` if this user may open the port; otherwise what to do.
    pub fn not_permitted(&self) -> Option<String> {
        not_permitted(&self.path)
    }

    /// The programs that have the port open, as far as this user may see them.
    pub fn holders(&self) -> Vec<Holder> {
        holders(&self.path)
    }
}

fn refused(path: &str) -> String {
    not_permitted(path).unwrap_or_else(|| "the system does not permit to open it".into())
}

#[cfg(unix)]
fn not_permitted(path: &str) -> Option<String> {
    use std::os::unix::fs::MetadataExt as _;
    let about = fs::metadata(path).ok()?;
    let both = 0o6;
    let (user, groups) = own_ids();
    let may = user == 0
        || about.mode() & both == both
        || (about.uid() == user && about.mode() >> 6 & both == both)
        || (groups.contains(&about.gid()) && about.mode() >> 3 & both == both);
    if may {
        return None;
    }
    Some(match group_of(path) {
        Some(group) if about.mode() >> 3 & both == both => format!(
            "permission denied: the port belongs to the group {group}; to join it: sudo usermod -aG {group} $USER, then log in again"
        ),
        _ => "permission denied: the port belongs to root alone; see docs/book/hardware.md for the udev rule that gives it to a group".into(),
    })
}

#[cfg(not(unix))]
fn not_permitted(_: &str) -> Option<String> {
    None
}

/// Effective user and all groups of this process.
#[cfg(unix)]
fn own_ids() -> (u32, Vec<u32>) {
    let mut groups: Vec<u32> = rustix::process::getgroups()
        .unwrap_or_default()
        .into_iter()
        .map(rustix::process::Gid::as_raw)
        .collect();
    groups.push(rustix::process::getegid().as_raw());
    (rustix::process::geteuid().as_raw(), groups)
}

#[cfg(unix)]
fn group_of(path: &str) -> Option<String> {
    use std::os::unix::fs::MetadataExt as _;
    let number = fs::metadata(path).ok()?.gid();
    let known = fs::read_to_string("/etc/group").unwrap_or_default();
    let name = group_named(&known, number);
    Some(name.unwrap_or_else(|| number.to_string()))
}

#[cfg(not(unix))]
fn group_of(_: &str) -> Option<String> {
    None
}

/// Name of a group in the text of `/etc/group`.
fn group_named(groups: &str, number: u32) -> Option<String> {
    groups.lines().find_map(|line| {
        let mut parts = line.split(':');
        let name = parts.next()?;
        let found: u32 = parts.nth(1)?.parse().ok()?;
        (found == number).then(|| name.to_owned())
    })
}

/// Programs that have the file open; known on Linux.
fn holders(path: &str) -> Vec<Holder> {
    let Ok(file) = fs::canonicalize(path) else {
        return Vec::new();
    };
    let Ok(processes) = fs::read_dir("/proc") else {
        return Vec::new();
    };
    let numbers = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let holds = |process: &u32| {
        let open = fs::read_dir(format!("/proc/{process}/fd"));
        open.is_ok_and(|mut files| {
            files.any(|entry| {
                let target = entry.and_then(|entry| fs::read_link(entry.path()));
                target.is_ok_and(|target| target == file)
            })
        })
    };
    let mut found: Vec<Holder> = numbers
        .filter(|process: &u32| *process != std::process::id())
        .filter(holds)
        .map(|process| {
            let name = fs::read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
            Holder {
                process,
                name: name.trim().to_owned(),
            }
        })
        .collect();
    found.sort_by_key(|holder| holder.process);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_named() {
        let groups = "root:x:0:\ndialout:x:20:ann,ben\nbroken\n";
        assert_eq!(group_named(groups, 20).as_deref(), Some("dialout"));
        assert_eq!(group_named(groups, 21), None);
    }

    #[cfg(unix)]
    #[test]
    fn the_name_that_stays_is_found() {
        let folder = std::env::temp_dir().join(format!("taxel-by-id-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let port = folder.join("port");
        fs::write(&port, "").unwrap();
        let names = folder.join("by-id");
        fs::create_dir_all(&names).unwrap();
        std::os::unix::fs::symlink("../port", names.join("usb-Board_7-if00")).unwrap();
        let found = link_to(&names, &port.to_string_lossy());
        assert!(found.unwrap().ends_with("usb-Board_7-if00"));
        assert_eq!(link_to(&names, "/dev/null"), None);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_holds_a_file_is_named() {
        let path = std::env::temp_dir().join(format!("taxel-held-{}", std::process::id()));
        fs::write(&path, "").unwrap();
        let mut child = std::process::Command::new("sleep")
            .arg("30")
            .stdin(fs::File::open(&path).unwrap())
            .spawn()
            .unwrap();
        let found = holders(&path.to_string_lossy());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].process, child.id());
        fs::remove_file(&path).unwrap();
    }
}
