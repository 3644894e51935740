//! `taxel devices`: what is plugged in.

use serde_json::{Value, json};
use taxel::table;
use taxel_board::Board;
use taxel_serve::link::{FoundPort, found_ports};
use taxel_serve::serial_settings;

use crate::arguments::{DeviceFormat, Devices};
use crate::{Done, Stop, outputs};

pub(crate) fn run(arguments: &Devices) -> Result<Done, Stop> {
    let ports = found_ports();
    let text = match arguments.format {
        DeviceFormat::Json => {
            let ports: Vec<Value> = ports.iter().map(object).collect();
            table::json(&json!({ "ports": ports }))
        }
        DeviceFormat::Table if ports.is_empty() => NONE.to_owned(),
        DeviceFormat::Table => ports.iter().map(paragraph).collect(),
    };
    outputs::print(&text)
}

const NONE: &str = "no serial port is plugged in\n\
    A board that is: try another cable (some only charge), and look whether the system sees it (lsusb, dmesg).\n\
    Without a board: taxel device three-axis-8x8 --board BOARD --on pty plays one.\n";

/// Shipped boards whose USB names are those of the port.
fn boards(port: &FoundPort) -> Vec<&'static str> {
    let fits = |name: &&'static str| {
        Board::shipped(name).is_some_and(|board| {
            let usb = serial_settings(&board).usb;
            usb.iter().any(|usb| usb.fits(port))
        })
    };
    Board::shipped_names().filter(fits).collect()
}

fn object(port: &FoundPort) -> Value {
    let usb = port.usb.as_ref().map(|usb| {
        json!({
            "vendor": format!("{:04x}", usb.vendor),
            "product": format!("{:04x}", usb.product),
            "vendor_name": usb.vendor_name,
            "product_name": usb.product_name,
            "serial": usb.serial,
        })
    });
    let holders: Vec<Value> = port
        .holders()
        .iter()
        .map(|holder| json!({ "process": holder.process, "name": holder.name }))
        .collect();
    json!({
        "path": port.path,
        "by_id": port.by_id,
        "usb": usb,
        "group": port.group(),
        "permitted": port.not_permitted().is_none(),
        "boards": boards(port),
        "held_by": holders,
    })
}

fn paragraph(port: &FoundPort) -> String {
    let mut lines = vec![format!("{}", port.path)];
    let mut line = |name: &str, text: String| lines.push(format!("  {name:<10} {text}"));
    if let Some(by_id) = &port.by_id {
        line("name", format!("serial:{by_id}"));
    }
    if let Some(usb) = &port.usb {
        let words = [&usb.vendor_name, &usb.product_name];
        let words: Vec<&str> = words.into_iter().flatten().map(String::as_str).collect();
        let serial = usb.serial.as_deref().unwrap_or("none");
        line(
            "USB",
            format!(
                "{:04x}:{:04x} {}, serial number {serial}",
                usb.vendor,
                usb.product,
                words.join(" ")
            ),
        );
    }
    let group = port.group().unwrap_or_else(|| "-".into());
    line(
        "access",
        port.not_permitted()
            .unwrap_or_else(|| format!("you may open it (group {group})")),
    );
    match boards(port).as_slice() {
        [] => {}
        boards => line("board", format!("--board {}", boards.join(" or --board "))),
    }
    for holder in port.holders() {
        line(
            "open in",
            format!("{} (process {})", holder.name, holder.process),
        );
    }
    lines.join("\n") + "\n"
}
