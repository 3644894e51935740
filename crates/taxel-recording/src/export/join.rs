//! One table over time: a line for each frame.

use std::io::{Read, Result, Write};

use super::{ExportMeaning, axes, number, text};
use crate::mcap::{
    EventMessage, FrameMessage, MarkMessage, McapReader, Message, Topic, TouchMessage,
};

/// What has come since a frame.
#[derive(Debug, Default)]
struct Row {
    frame: FrameMessage,
    touch: Option<TouchMessage>,
    events: Vec<String>,
    marks: Vec<String>,
}

/// Writes one line for each frame: time, totals, the strongest contact, events and marks since
/// the frame before, then value, deviation and state of each taxel, and the readings. The
/// number of lines.
///
/// # Errors
/// Those of the reader and of `out`.
pub fn write_csv<R: Read>(
    mut reader: McapReader<R>,
    meaning: &ExportMeaning,
    mut out: impl Write,
) -> Result<u64> {
    let mut row: Option<Row> = None;
    // Marks before the first frame.
    let mut early = Vec::new();
    let mut shape: Option<(usize, u8)> = None;
    let mut waiting: Vec<Row> = Vec::new();
    let mut lines = 0;
    while let Some(entry) = reader.next()? {
        match entry.topic {
            Topic::Raw => {
                let Some(frame) = FrameMessage::decode(entry.bytes) else {
                    continue;
                };
                if let Some(row) = row.take() {
                    waiting.push(row);
                }
                row = Some(Row {
                    frame,
                    marks: std::mem::take(&mut early),
                    ..Row::default()
                });
                // Frames before the first touch wait for its shape.
                if shape.is_some() || waiting.len() >= MOST_WAITING {
                    let known = *shape.get_or_insert((0, 1));
                    lines += put_all(&mut waiting, known, lines == 0, meaning, &mut out)?;
                }
            }
            Topic::Touch => {
                let Some(touch) = TouchMessage::decode(entry.bytes) else {
                    continue;
                };
                shape.get_or_insert((touch.states.len(), touch.components));
                if let Some(row) = &mut row {
                    row.touch = Some(touch);
                }
            }
            Topic::Events => {
                if let (Some(row), Some(event)) = (&mut row, EventMessage::decode(entry.bytes)) {
                    row.events.push(match event.contact {
                        0 => event.kind,
                        contact => format!("{} {contact}", event.kind),
                    });
                }
            }
            Topic::Marks => {
                if let Some(mark) = MarkMessage::decode(entry.bytes) {
                    row.as_mut()
                        .map_or(&mut early, |row| &mut row.marks)
                        .push(mark.text);
                }
            }
            _ => {}
        }
    }
    waiting.extend(row);
    lines += put_all(
        &mut waiting,
        shape.unwrap_or((0, 1)),
        lines == 0,
        meaning,
        &mut out,
    )?;
    out.flush()?;
    Ok(lines)
}

/// Frames that wait for the first touch.
const MOST_WAITING: usize = 1000;

fn put_all(
    rows: &mut Vec<Row>,
    shape: (usize, u8),
    first: bool,
    meaning: &ExportMeaning,
    out: &mut impl Write,
) -> Result<u64> {
    if first && !rows.is_empty() {
        put_titles(shape, meaning, out)?;
    }
    let count = rows.len() as u64;
    for row in rows.drain(..) {
        put(&row, shape, meaning, out)?;
    }
    Ok(count)
}

fn put_titles(
    (taxels, components): (usize, u8),
    meaning: &ExportMeaning,
    out: &mut impl Write,
) -> Result<()> {
    let (force, _) = meaning.force_unit();
    let (length, _) = meaning.length_unit();
    write!(out, "sequence,time [ns],utc [ns]")?;
    for title in ["force", "force_deviation"] {
        for axis in ["x", "y", "z"] {
            write!(out, ",{title}_{axis} [{force}]")?;
        }
    }
    write!(
        out,
        ",contacts,contact_id,contact_x [{length}],contact_y [{length}],contact_force_z [{force}],contact_force_deviation_z [{force}],events,marks"
    )?;
    let (name, unit, _) = &meaning.value;
    for what in [name.clone(), format!("{name}_deviation")] {
        for taxel in 0..taxels {
            for axis in axes(components) {
                let title = format!("{} {what}_{axis} [{unit}]", meaning.taxel(taxel));
                write!(out, ",{}", text(&title))?;
            }
        }
    }
    for taxel in 0..taxels {
        write!(out, ",{} state", meaning.taxel(taxel))?;
    }
    for channel in &meaning.channels {
        write!(
            out,
            ",{}",
            text(&format!("{channel} [{}]", meaning.reading.symbol))
        )?;
    }
    writeln!(out)
}

fn put(
    row: &Row,
    (taxels, components): (usize, u8),
    meaning: &ExportMeaning,
    out: &mut impl Write,
) -> Result<()> {
    let frame = &row.frame.frame;
    write!(
        out,
        "{},{},{}",
        frame.sequence, frame.time_ns, row.frame.utc_ns
    )?;
    let touch = row.touch.as_ref();
    let (_, force) = meaning.force_unit();
    let (_, length) = meaning.length_unit();
    let totals = touch.map_or([[f64::NAN; 3]; 2], |touch| {
        [touch.force, touch.force_deviation]
    });
    for value in totals.into_iter().flatten() {
        write!(out, ",{}", number(value / force))?;
    }
    match touch {
        Some(touch) => write!(out, ",{}", touch.contacts.len())?,
        None => write!(out, ",")?,
    }
    match touch.and_then(|touch| touch.contacts.first()) {
        Some(contact) => {
            write!(out, ",{}", contact.id)?;
            for value in [
                contact.centre[0] / length,
                contact.centre[1] / length,
                contact.force[2] / force,
                contact.force_deviation[2] / force,
            ] {
                write!(out, ",{}", number(value))?;
            }
        }
        None => write!(out, ",,,,,")?,
    }
    write!(
        out,
        ",{},{}",
        text(&row.events.join("; ")),
        text(&row.marks.join("; "))
    )?;
    let wanted = taxels * axes(components).len();
    let (_, _, scale) = &meaning.value;
    let none = Vec::new();
    for values in [
        touch.map_or(&none, |touch| &touch.values),
        touch.map_or(&none, |touch| &touch.deviations),
    ] {
        for at in 0..wanted {
            let value = values.get(at).map_or(f64::NAN, |value| f64::from(*value));
            write!(out, ",{}", number(shortened(value / scale)))?;
        }
    }
    for taxel in 0..taxels {
        let state = touch.and_then(|touch| touch.states.get(taxel));
        write!(
            out,
            ",{}",
            state.map_or(String::new(), |code| meaning.state(*code))
        )?;
    }
    for channel in 0..meaning.channels.len() {
        let value = frame.values.get(channel).copied().unwrap_or(f64::NAN);
        write!(out, ",{}", number(meaning.reading(value)))?;
    }
    writeln!(out)
}

/// The digits that a number of single precision has.
pub(super) fn shortened(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}
