//! Serial ports.

use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::time::Duration;
use taxel::shown;

use serialport::{ClearBuffer, ErrorKind, SerialPort};

use super::address::SerialName;
use super::error::LinkError;
use super::port::{Link, Port, Received, received};
use super::ports::{self, FoundPort};

/// USB names by which a board is known; what is `None` is not compared.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UsbMatch {
    /// Number of the vendor.
    pub vendor: Option<u16>,
    /// Name of the vendor, or a part of it.
    pub vendor_name: Option<String>,
    /// Number of the product.
    pub product: Option<u16>,
    /// Name of the product, or a part of it.
    pub product_name: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
}

/// How a serial port is opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialSettings {
    /// Bits per second; 115 200 where the number means nothing.
    pub baud: u32,
    /// True if the number means nothing (native USB).
    pub native_usb: bool,
    /// USB names of the board; any of them.
    pub usb: Vec<UsbMatch>,
    /// Level of DTR after opening; `None` leaves it alone.
    pub dtr: Option<bool>,
    /// Level of RTS after opening; `None` leaves it alone.
    pub rts: Option<bool>,
    /// True if the board restarts when the port is opened.
    pub reset_on_open: bool,
}

impl Default for SerialSettings {
    fn default() -> Self {
        Self {
            baud: 115_200,
            native_usb: false,
            usb: Vec::new(),
            dtr: Some(true),
            rts: Some(true),
            reset_on_open: false,
        }
    }
}

impl UsbMatch {
    /// True if the USB names of `port` are these.
    pub fn fits(&self, port: &FoundPort) -> bool {
        let Some(usb) = &port.usb else { return false };
        let number = |wanted: Option<u16>, found: u16| wanted.is_none_or(|wanted| wanted == found);
        let name = |wanted: &Option<String>, found: &Option<String>| {
            let found = found
                .as_deref()
                .unwrap_or("")
                .replace('_', " ")
                .to_lowercase();
            let wanted = wanted
                .as_deref()
                .map(|name| name.replace('_', " ").to_lowercase());
            wanted.is_none_or(|wanted| found.contains(&wanted))
        };
        number(self.vendor, usb.vendor)
            && number(self.product, usb.product)
            && name(&self.vendor_name, &usb.vendor_name)
            && name(&self.product_name, &usb.product_name)
            && (self.serial.is_none() || self.serial == usb.serial)
    }
}

/// A serial port that is opened again when it comes back.
pub(crate) struct Serial {
    name: SerialName,
    settings: SerialSettings,
    /// Name and USB serial number of the port that was open before.
    before: Option<(String, Option<String>)>,
    was_there: bool,
    remarks: Vec<String>,
}

impl Serial {
    pub(crate) fn new(name: SerialName, settings: SerialSettings) -> Self {
        Self {
            name,
            settings,
            before: None,
            was_there: true,
            remarks: Vec::new(),
        }
    }

    /// Path of the port to open, and the USB serial number of it.
    fn find(&self) -> Result<(String, Option<String>), LinkError> {
        let refuse = |reason: String| LinkError::Open {
            name: self.name(),
            reason,
        };
        match &self.name {
            SerialName::Named(path) => {
                let found = ports::found_port(path);
                let serial = found.and_then(|port| port.usb).and_then(|usb| usb.serial);
                match &self.before {
                    Some((_, Some(known))) if serial.as_ref().is_some_and(|now| now != known) => {
                        let now = serial.unwrap_or_default();
                        Err(refuse(format!(
                            "another board is at this port now: USB serial number {now}, before it was {known}; plug the first one in again, or start anew"
                        )))
                    }
                    _ => Ok((path.clone(), serial)),
                }
            }
            SerialName::Auto => self.find_by_usb(),
        }
    }

    fn find_by_usb(&self) -> Result<(String, Option<String>), LinkError> {
        let never = |reason: String| LinkError::Never {
            name: self.name(),
            reason,
        };
        if self.settings.usb.is_empty() {
            return Err(never(
                "the board file has no USB names to look for ([link.serial] usb = [...]); name the port, `taxel devices` lists them".into(),
            ));
        }
        let known = self.before.as_ref().and_then(|(_, serial)| serial.as_ref());
        let mut fitting: Vec<_> = ports::found_ports()
            .into_iter()
            .filter(|port| self.settings.usb.iter().any(|usb| usb.fits(port)))
            .filter(|port| {
                let serial = port.usb.as_ref().and_then(|usb| usb.serial.as_ref());
                known.is_none() || serial == known
            })
            .collect();
        match (fitting.pop(), fitting.len()) {
            (None, _) => Err(LinkError::Open {
                name: self.name(),
                reason: "no port has the USB names of the board; `taxel devices` lists what is plugged in".into(),
            }),
            (Some(port), 0) => {
                let serial = port.usb.and_then(|usb| usb.serial);
                Ok((port.by_id.unwrap_or(port.path), serial))
            }
            (Some(last), _) => {
                fitting.push(last);
                let names: Vec<_> = fitting
                    .iter()
                    .map(|port| port.by_id.as_deref().unwrap_or(&port.path))
                    .collect();
                Err(never(format!(
                    "several ports have the USB names of the board: {}; name one: serial:{}",
                    names.join(", "),
                    names[0]
                )))
            }
        }
    }

    fn remark(&mut self, path: &str) {
        self.remarks.clear();
        if let Some(milliseconds) = ports::latency_timer(path).filter(|ms| *ms > 2) {
            let file = ports::latency_timer_file(path);
            self.remarks.push(format!(
                "{path}: the USB adapter holds bytes back for up to {milliseconds} ms; for less: echo 1 | sudo tee {}",
                shown::path(&file)
            ));
        }
        if let (SerialName::Named(name), Some(by_id)) = (&self.name, ports::by_id_of(path))
            && *name != by_id
        {
            self.remarks.push(format!(
                "{name} can be another port after the next start; serial:{by_id} stays the same"
            ));
        }
        if self.settings.reset_on_open {
            self.remarks.push(format!(
                "{path}: the board restarts when its port is opened"
            ));
        }
    }
}

impl Link for Serial {
    fn name(&self) -> String {
        match (&self.name, &self.before) {
            (SerialName::Named(path), _) | (SerialName::Auto, Some((path, _))) => path.clone(),
            (SerialName::Auto, None) => "serial:auto".into(),
        }
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        let (path, serial) = self.find()?;
        // Exclusive: another program would take part of the bytes.
        let builder = serialport::new(&path, self.settings.baud)
            .timeout(Duration::from_millis(50))
            .exclusive(true);
        let builder = match self.settings.dtr {
            Some(level) => builder.dtr_on_open(level),
            None => builder.preserve_dtr_on_open(),
        };
        let mut port = builder.open().map_err(|error| {
            self.was_there = !is_absent(&error) && Path::new(&path).exists();
            LinkError::Open {
                name: path.clone(),
                reason: ports::why_not(&path, &error),
            }
        })?;
        if let Some(level) = self.settings.rts {
            // Pseudo terminals have no such line.
            let _ = port.write_request_to_send(level);
        }
        // What waited in the port is of no known age.
        let _ = port.clear(ClearBuffer::Input);
        self.remark(&path);
        self.before = Some((path, serial));
        self.was_there = true;
        Ok(Box::new(OpenSerial(port)))
    }

    /// A port that has come back is opened at once; looking for its file costs little.
    fn appeared(&mut self) -> bool {
        let path = match (&self.name, &self.before) {
            (SerialName::Named(path), _) | (SerialName::Auto, Some((path, _))) => path,
            (SerialName::Auto, None) => return false,
        };
        let there = Path::new(path).exists();
        let appeared = there && !self.was_there;
        self.was_there = there;
        appeared
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

fn is_absent(error: &serialport::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::NoDevice | ErrorKind::Io(io::ErrorKind::NotFound)
    )
}

struct OpenSerial(Box<dyn SerialPort>);

impl Port for OpenSerial {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if self.0.timeout() != patience {
            self.0.set_timeout(patience)?;
        }
        received(self.0.read(buffer))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::ports::UsbNames;

    #[test]
    fn a_board_is_known_by_its_usb_names() {
        let port = FoundPort {
            path: "/dev/ttyACM0".into(),
            by_id: None,
            usb: Some(UsbNames {
                vendor: 0x04d8,
                product: 0x000a,
                vendor_name: Some("OptoForce_Ltd".into()),
                product_name: Some("OptoForce_DAQ".into()),
                serial: Some("0123".into()),
            }),
        };
        let of_product = |name: &str| UsbMatch {
            product_name: Some(name.into()),
            ..UsbMatch::default()
        };
        assert!(of_product("OptoForce DAQ").fits(&port));
        assert!(!of_product("Arduino").fits(&port));
        let of_number = |vendor, serial: &str| UsbMatch {
            vendor: Some(vendor),
            serial: Some(serial.into()),
            ..UsbMatch::default()
        };
        assert!(of_number(0x04d8, "0123").fits(&port));
        assert!(!of_number(0x04d8, "0124").fits(&port));
        assert!(!of_number(0x2341, "0123").fits(&port));
    }
}
