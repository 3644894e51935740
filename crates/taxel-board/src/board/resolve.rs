//! From the board file as it is written to places and conversions; rules between keys.

use super::description::{BoardFile, Carrier, Counted, Framing, Samples};
use super::field::{Field, Is, Type};
use super::layout::{PacketLayout, Role};
use super::placement::layout;
use super::rules::{Broken, broken, longest, shortened, value_of_board};
use super::{
    Board, Format, LONGEST_PACKET, MOST_LONGEST, SCHEMA_VERSION, SampleTimes, ValueOfBoard,
};
use super::{line, messages};
use crate::names;

pub(super) fn board(file: &BoardFile) -> Result<Board, Broken> {
    if file.schema != SCHEMA_VERSION {
        let message = format!("schema {} is not known", file.schema);
        let help = format!("this program reads schema = {SCHEMA_VERSION}");
        return Err(broken(&[&"schema"], message, help));
    }
    if file.name.trim().is_empty() || file.name.len() > 200 {
        let help = "give the name of the board";
        return Err(broken(&[&"name"], "the name has 1 to 200 characters", help));
    }
    check_serial(file)?;
    if !file.messages.is_empty() && matches!(file.framing, Framing::Lines(_)) {
        let message = "lines of several kinds are several templates";
        let help = "list them in framing.lines.template";
        return Err(broken(&[&"message"], message, help));
    }
    let samples = samples(file)?;
    let (format, values) = match (&file.framing, file.decoder) {
        (Framing::Lines(lines), None) => line::resolve(lines, &file.packet)?,
        (Framing::Lines(_) | Framing::Messages(_), Some(_)) => {
            let help = "leave out `decoder`, or describe framing.marked";
            let message = "the decoder reads packets, not lines or messages";
            return Err(broken(&[&"decoder"], message, help));
        }
        (_, Some(decoder)) => {
            if !file.packet.fields.is_empty() {
                let message = "a built-in decoder knows the fields itself";
                return Err(broken(&[&"packet", &"fields"], message, "leave them out"));
            }
            let values = crate::papillarray::values()
                .into_iter()
                .map(|(name, symbol)| value_of_board(name, Some(symbol)))
                .collect::<Result<_, String>>()
                .map_err(|message| broken(&[&"decoder"], message, ""))?;
            (Format::BuiltIn(decoder), values)
        }
        (Framing::Messages(messages), None) => {
            messages::resolve(messages, &file.messages, &file.packet)?
        }
        (framing, None) if !file.messages.is_empty() => {
            let (format, values) = messages::of_packets(framing, &file.messages, &file.packet)?;
            for layout in format.layouts() {
                check_framing(framing, layout)?;
            }
            (Format::Messages(format), values)
        }
        (framing, None) => {
            let (layout, values) = layout(framing, &file.packet)?;
            check_framing(framing, &layout)?;
            (Format::Packet(layout), values)
        }
    };
    if values.is_empty() {
        return Err(without_values(file));
    }
    let wired = places(&values, &file.wiring).map_err(|message| {
        let names: Vec<_> = values.iter().map(|value| value.name.as_str()).collect();
        let help = format!("the board has: {}", shortened(&names));
        broken(&[&"wiring"], message, help)
    })?;
    let grid = grid(
        file,
        if wired.is_empty() {
            values.len()
        } else {
            wired.len()
        },
    )?;
    let board = Board {
        name: file.name.clone(),
        rate: file.rate,
        link: file.link.clone(),
        framing: file.framing.clone(),
        format,
        values,
        wired,
        grid,
        step_limit: file.packet.step_limit,
        samples,
        pressed: file.pressed,
    };
    check_rate(&board)?;
    check_packets(file, &board)?;
    Ok(board)
}

/// Refuses a rate that the baud does not carry.
fn check_rate(board: &Board) -> Result<(), Broken> {
    if let (Some(rate), Some(serial)) = (board.rate, &board.link.serial)
        && !serial.native_usb
    {
        let carried = f64::from(serial.baud) / 10.0;
        if let Some(bytes) = board.bytes_per_frame()
            && bytes as f64 * rate > carried
        {
            let message = format!(
                "{rate} frames of {bytes} bytes are {:.0} bytes in a second; {} baud carry {carried:.0}",
                bytes as f64 * rate,
                serial.baud
            );
            let help = "raise link.serial.baud, lower the rate, or say native_usb = true where the port is USB itself";
            return Err(broken(&[&"rate"], message, help));
        }
    }
    Ok(())
}

/// The frames of one packet or message, where the file says that it holds several.
fn samples(file: &BoardFile) -> Result<Option<SampleTimes>, Broken> {
    let of_messages = file.messages.iter().enumerate();
    let mut of_messages =
        of_messages.filter_map(|(place, message)| Some((place, message.samples.as_ref()?)));
    let (path, samples): (Vec<String>, &Samples) = match (&file.packet.samples, of_messages.next())
    {
        (None, None) => return Ok(None),
        (Some(samples), _) => (vec!["packet".into(), "samples".into()], samples),
        (None, Some((place, samples))) => (
            vec!["message".into(), place.to_string(), "samples".into()],
            samples,
        ),
    };
    let at = |key: Option<&str>, message: &str, help: &str| {
        let path = path.iter().cloned().chain(key.map(str::to_owned));
        Err(Broken {
            path: path.collect(),
            within: None,
            message: message.into(),
            help: help.into(),
        })
    };
    let json =
        matches!(&file.framing, Framing::Messages(messages) if messages.carrier == Carrier::Json);
    let in_packet = file.packet.samples.is_some();
    let address = |field: &Field| field.is == Is::Address;
    match &file.framing {
        Framing::Messages(_) if in_packet || !json => {
            return at(
                None,
                "the list of a JSON message may hold several frames",
                "leave it out, or write message.samples",
            );
        }
        Framing::Lines(_) => {
            return at(
                None,
                "each line is a frame, or a part of one",
                "leave it out",
            );
        }
        _ if file.decoder.is_some() => return at(None, "the decoder knows it", "leave it out"),
        _ if file.messages.len() > 1 || file.packet.fields.iter().any(address) => {
            return at(
                None,
                "a frame of several packets is none of several in one",
                "leave it out",
            );
        }
        _ => {}
    }
    match (json, &samples.key, samples.count) {
        (true, None, _) => {
            return at(
                None,
                "where does the list stand in the message?",
                "add key, such as key = \"chunk\"",
            );
        }
        (false, Some(_), _) => {
            return at(Some("key"), "a packet of bytes has no keys", "leave it out");
        }
        (false, None, None) => {
            return at(
                None,
                "how many frames does a packet hold?",
                "add count, such as count = 10",
            );
        }
        (_, _, Some(count)) if !(1..=MOST_SAMPLES).contains(&count) => {
            return at(
                Some("count"),
                &format!("{count} is out of range: must be at least 1 and at most {MOST_SAMPLES}"),
                "",
            );
        }
        _ => {}
    }
    let every = samples.every.or(file.rate.map(f64::recip));
    let Some(every) = every else {
        return at(
            None,
            "how far apart are they?",
            "add every, such as every = \"1 ms\", or the rate of the frames",
        );
    };
    Ok(Some(SampleTimes {
        count: samples.count.unwrap_or(1),
        every_ns: 1e9 * every,
        stamp: samples.stamp,
    }))
}

/// Most frames of one packet.
const MOST_SAMPLES: usize = 1024;

/// Packets are counted where a frame has several.
fn check_packets(file: &BoardFile, board: &Board) -> Result<(), Broken> {
    let several = board.frame_rule().required.len() > 1;
    let counts = |field: &Field| field.counts.is_some();
    let in_packet = file.packet.fields.iter().position(counts);
    let mut in_messages = file
        .messages
        .iter()
        .enumerate()
        .filter_map(|(place, message)| {
            let field = message.fields.iter().position(counts)?;
            Some((place, field))
        });
    let message = "each frame is one packet";
    let help = "leave it out, or give the packets an address";
    match (in_packet, in_messages.next()) {
        (Some(field), _) if !several => {
            let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &field, &"counts"];
            Err(broken(&path, message, help))
        }
        (_, Some((place, field))) if !several => {
            let path: [&dyn std::fmt::Display; 5] =
                [&"message", &place, &"fields", &field, &"counts"];
            Err(broken(&path, message, help))
        }
        _ => Ok(()),
    }
}

/// No channel would come.
fn without_values(file: &BoardFile) -> Broken {
    let help = "add a field such as { is = \"value\", name = \"c{1..4}\", type = \"u16\" }";
    let path: &[&dyn std::fmt::Display] = match &file.framing {
        Framing::Messages(_) => &[&"message"],
        _ if file.packet.fields.is_empty() => &[&"framing"],
        _ => &[&"packet", &"fields"],
    };
    broken(path, "no field is a value", help)
}

/// Rows and columns of the channels, where the file states them.
fn grid(file: &BoardFile, channels: usize) -> Result<Option<[usize; 2]>, Broken> {
    let grid = file.layout.map(|grid| [grid.rows, grid.columns]);
    if let Some([rows, columns]) = grid
        && rows.checked_mul(columns) != Some(channels)
    {
        let message = format!("{rows} x {columns} is not the number of channels, {channels}");
        let help = "rows times columns must be the number of channels, such as layout = { rows = 12, columns = 32 }";
        return Err(broken(&[&"layout"], message, help));
    }
    Ok(grid)
}

fn check_serial(file: &BoardFile) -> Result<(), Broken> {
    let serial = file.link.serial.iter().flat_map(|serial| &serial.usb);
    for (place, usb) in serial.enumerate() {
        if usb.vendor.is_none() && usb.product.is_none() && usb.serial.is_none() {
            let message = "an entry without a key fits every device";
            let help = "give vendor, product or serial; `taxel devices` shows them";
            return Err(broken(&[&"link", &"serial", &"usb", &place], message, help));
        }
    }
    Ok(())
}

/// Places of the values of these names; none for none.
pub(super) fn places(values: &[ValueOfBoard], patterns: &[String]) -> Result<Vec<usize>, String> {
    let mut places = Vec::new();
    for pattern in patterns {
        for name in names::expanded(pattern)? {
            let place = values.iter().position(|value| value.name == name);
            let place = place.ok_or_else(|| format!("no value is called \"{name}\""))?;
            if places.contains(&place) {
                return Err(format!("\"{name}\" is named twice"));
            }
            places.push(place);
        }
    }
    Ok(places)
}

/// What a framing needs to be decided.
fn check_framing(framing: &Framing, layout: &PacketLayout) -> Result<(), Broken> {
    let too_long = |longest: usize, kind: &str| {
        if layout.length > longest {
            let message = format!(
                "the packet has {} bytes, more than {longest}",
                layout.length
            );
            Err(broken(
                &[&"framing", &kind, &"longest"],
                message,
                "raise it",
            ))
        } else {
            Ok(())
        }
    };
    match framing {
        Framing::Fixed(fixed) => {
            if fixed.length == 0 || fixed.length > MOST_LONGEST {
                let message = format!(
                    "{} is out of range: must be at least 1 and at most {MOST_LONGEST}",
                    fixed.length
                );
                return Err(broken(&[&"framing", &"fixed", &"length"], message, ""));
            }
            let marked = layout
                .fields
                .iter()
                .any(|field| matches!(field.role, Role::Mark(_)));
            if fixed.head.is_none() && fixed.tail.is_none() && layout.check.is_none() && !marked {
                let message = "where a packet begins cannot be decided without a mark and a check";
                let help = "add head, tail or packet.check; `taxel check` says what they show";
                return Err(broken(&[&"framing", &"fixed"], message, help));
            }
            Ok(())
        }
        Framing::Marked(marked) => {
            too_long(longest(marked.longest, LONGEST_PACKET, "marked")?, "marked")
        }
        Framing::Length(length) => {
            let whole = matches!(length.kind, Type::Unsigned(1..=4));
            if !whole {
                let message = format!("{} cannot be a length", length.kind);
                let help = "use u8, u16, u24 or u32";
                return Err(broken(&[&"framing", &"length", &"type"], message, help));
            }
            if length.at < length.head.len() || length.at > LONGEST_PACKET {
                let message = "the length stands behind the head".to_owned();
                return Err(broken(&[&"framing", &"length", &"at"], message, ""));
            }
            let counted = counted(length.counts, layout, length.at + length.kind.bits() / 8);
            let bits = length.kind.bits() as f64;
            if counted.is_none_or(|counted| counted as f64 >= bits.exp2()) {
                let message = "the fields end before the length, or are longer than it can say";
                return Err(broken(&[&"framing", &"length", &"counts"], message, ""));
            }
            too_long(longest(length.longest, LONGEST_PACKET, "length")?, "length")
        }
        Framing::Cobs(cobs) => too_long(longest(cobs.longest, cobs.longest(), "cobs")?, "cobs"),
        Framing::Slip(stuffed) => {
            too_long(longest(stuffed.longest, LONGEST_PACKET, "slip")?, "slip")
        }
        Framing::Lines(_) | Framing::Messages(_) => Ok(()),
    }
}

/// What the length of a packet of this layout says, where its first byte behind the length
/// is `behind`.
pub(crate) fn counted(counts: Counted, layout: &PacketLayout, behind: usize) -> Option<usize> {
    let check = layout.check.as_ref().map_or(0, |check| check.from_end);
    match counts {
        Counted::All => Some(layout.length),
        Counted::Rest => layout.length.checked_sub(behind),
        Counted::Payload => layout.length.checked_sub(behind + check),
    }
}
