//! A table for each kind of message.

use std::io::{Read, Result, Write};

use super::join::shortened;
use super::{ExportMeaning, axes, number, text};
use crate::mcap::{
    ClockMessage, EventMessage, FrameMessage, HealthMessage, LinkMessage, MarkMessage, McapReader,
    Message, NO_TIME, RestMessage, Topic, TouchMessage, WireMessage,
};

/// Where the tables go.
type Sinks<'a> = [Option<Box<dyn Write + 'a>>; TABLES.len()];

/// Names of the tables, and of the file with the bytes of the wire.
const TABLES: [&str; 10] = [
    "wire.bin",
    "raw.csv",
    "touch.csv",
    "events.csv",
    "link.csv",
    "rest.csv",
    "clock.csv",
    "health.csv",
    "marks.csv",
    "contacts.csv",
];
const CONTACTS: usize = 9;

/// Writes a table for each kind of message that the recording has, into the files that `open`
/// makes by their names; the bytes of the wire as they came. Their names.
///
/// # Errors
/// Those of the reader, of `open` and of the files.
pub fn write_tables<'a, R: Read>(
    mut reader: McapReader<R>,
    meaning: &ExportMeaning,
    open: &mut dyn FnMut(&str) -> Result<Box<dyn Write + 'a>>,
) -> Result<Vec<&'static str>> {
    let mut sinks: Sinks<'a> = Default::default();
    while let Some(entry) = reader.next()? {
        let place = usize::from(entry.topic.number()) - 1;
        let new = sinks[place].is_none();
        if new {
            sinks[place] = Some(open(TABLES[place])?);
        }
        let contacts = entry.topic == Topic::Touch && sinks[CONTACTS].is_none();
        if contacts {
            let mut out = open(TABLES[CONTACTS])?;
            put_contact_titles(meaning, &mut out)?;
            sinks[CONTACTS] = Some(out);
        }
        let (front, back) = sinks.split_at_mut(CONTACTS);
        let Some(out) = &mut front[place] else {
            continue;
        };
        put(
            entry.topic,
            entry.bytes,
            new,
            meaning,
            out,
            back[0].as_mut(),
        )?;
    }
    let mut written = Vec::new();
    for (sink, name) in sinks.iter_mut().zip(TABLES) {
        if let Some(sink) = sink {
            sink.flush()?;
            written.push(name);
        }
    }
    Ok(written)
}

/// Writes one message; its titles before, if it is the first.
fn put(
    channel: Topic,
    bytes: &[u8],
    new: bool,
    meaning: &ExportMeaning,
    out: &mut dyn Write,
    contacts: Option<&mut Box<dyn Write + '_>>,
) -> Result<()> {
    let titles = |titles: &str, out: &mut dyn Write| {
        if new {
            return writeln!(out, "{titles}");
        }
        Ok(())
    };
    match channel {
        Topic::Wire => match WireMessage::decode(bytes) {
            Some(wire) => out.write_all(&wire.bytes),
            None => Ok(()),
        },
        Topic::Raw => match FrameMessage::decode(bytes) {
            Some(message) => put_frame(&message, new, meaning, out),
            None => Ok(()),
        },
        Topic::Touch => match TouchMessage::decode(bytes) {
            Some(touch) => {
                put_touch(&touch, new, meaning, out)?;
                contacts.map_or(Ok(()), |out| put_contacts(&touch, meaning, out))
            }
            None => Ok(()),
        },
        Topic::Events => {
            titles(
                "index,time [ns],contact,event,value,deviation,certainty,unit,parent,into,rise_time [s],symmetry,direction_x,direction_y,score",
                out,
            )?;
            EventMessage::decode(bytes).map_or(Ok(()), |event| put_event(&event, out))
        }
        Topic::Link => {
            titles("utc [ns],host [ns],segment,state,reason", out)?;
            LinkMessage::decode(bytes).map_or(Ok(()), |link| {
                let LinkMessage {
                    utc_ns,
                    host_ns,
                    segment,
                    ..
                } = link;
                let (state, reason) = (text(&link.state), text(&link.reason));
                writeln!(out, "{utc_ns},{host_ns},{segment},{state},{reason}")
            })
        }
        Topic::Rest => match RestMessage::decode(bytes) {
            Some(rest) => put_rest(&rest, new, meaning, out),
            None => Ok(()),
        },
        Topic::Clock => {
            titles(
                "utc [ns],host [ns],segment,device_time [ns],offset [ns],rate,lower [ns],upper [ns]",
                out,
            )?;
            ClockMessage::decode(bytes).map_or(Ok(()), |clock| {
                write!(
                    out,
                    "{},{},{},{}",
                    clock.utc_ns,
                    clock.host_ns,
                    clock.segment,
                    time(clock.device_time_ns)
                )?;
                for value in [clock.offset_ns, clock.rate, clock.lower_ns, clock.upper_ns] {
                    write!(out, ",{}", number(value))?;
                }
                writeln!(out)
            })
        }
        Topic::Health => {
            titles(
                "utc [ns],time [ns],accepted,lost,late,duplicate,repeated,restarts,clipped,rate [Hz],wrong,reasons",
                out,
            )?;
            HealthMessage::decode(bytes).map_or(Ok(()), |health| put_health(&health, out))
        }
        Topic::Marks => {
            titles("utc [ns],time [ns],text,by", out)?;
            MarkMessage::decode(bytes).map_or(Ok(()), |mark| {
                let (at, words, by) = (time(mark.device_time_ns), text(&mark.text), text(&mark.by));
                writeln!(out, "{},{at},{words},{by}", mark.utc_ns)
            })
        }
    }
}

fn put_health(health: &HealthMessage, out: &mut dyn Write) -> Result<()> {
    write!(out, "{},{}", health.utc_ns, health.device_time_ns)?;
    for count in [
        health.accepted,
        health.lost,
        health.late,
        health.duplicate,
        health.repeated,
        health.restarts,
        health.clipped,
    ] {
        write!(out, ",{count}")?;
    }
    let (wrong, reasons) = (health.wrong.join("; "), health.reasons.join("; "));
    writeln!(
        out,
        ",{},{},{}",
        number(health.rate),
        text(&wrong),
        text(&reasons)
    )
}

fn time(time: Option<u64>) -> String {
    time.filter(|time| *time != NO_TIME)
        .map_or(String::new(), |time| time.to_string())
}

fn put_frame(
    message: &FrameMessage,
    new: bool,
    meaning: &ExportMeaning,
    out: &mut dyn Write,
) -> Result<()> {
    if new {
        write!(out, "sequence,time [ns],utc [ns],host [ns],flags")?;
        for channel in &meaning.channels {
            write!(
                out,
                ",{}",
                text(&format!("{channel} [{}]", meaning.reading.symbol))
            )?;
        }
        writeln!(out)?;
    }
    let frame = &message.frame;
    let (host, flags) = (time(frame.host_ns), frame.flags.bits());
    write!(
        out,
        "{},{},{},{host},{flags}",
        frame.sequence, frame.time_ns, message.utc_ns
    )?;
    for value in &frame.values {
        write!(out, ",{}", number(meaning.reading(*value)))?;
    }
    writeln!(out)
}

fn put_touch(
    touch: &TouchMessage,
    new: bool,
    meaning: &ExportMeaning,
    out: &mut dyn Write,
) -> Result<()> {
    let (force, force_si) = meaning.force_unit();
    let (length, length_si) = meaning.length_unit();
    let (name, unit, scale) = &meaning.value;
    let axes = axes(touch.components);
    if new {
        write!(out, "sequence,time [ns]")?;
        for (title, unit) in [
            ("force", force),
            ("force_deviation", force),
            ("moment", "N m"),
        ] {
            for axis in ["x", "y", "z"] {
                write!(out, ",{title}_{axis} [{unit}]")?;
            }
        }
        write!(
            out,
            ",centre_x [{length}],centre_y [{length}],contacts,left_out,clipped,total_certainty,total_reason,zero_known"
        )?;
        for what in [name.clone(), format!("{name}_deviation")] {
            for taxel in 0..touch.states.len() {
                for axis in axes {
                    let title = format!("{} {what}_{axis} [{unit}]", meaning.taxel(taxel));
                    write!(out, ",{}", text(&title))?;
                }
            }
        }
        for taxel in 0..touch.states.len() {
            write!(out, ",{} state", meaning.taxel(taxel))?;
        }
        writeln!(out)?;
    }
    write!(out, "{},{}", touch.sequence, touch.device_time_ns)?;
    let forces = touch.force.iter().chain(&touch.force_deviation);
    let forces = forces.map(|value| value / force_si).chain(touch.moment);
    for value in forces.chain(touch.centre_of_pressure.map(|value| value / length_si)) {
        write!(out, ",{}", number(value))?;
    }
    write!(
        out,
        ",{},{},{}",
        touch.contacts.len(),
        touch.left_out,
        touch.clipped
    )?;
    match &touch.certainty {
        Some(certainty) => write!(
            out,
            ",{},{},{}",
            certainty_name(certainty.total),
            certainty
                .reason
                .map_or(String::new(), |code| meaning.state(code)),
            certainty.zero_known
        )?,
        None => write!(out, ",,,")?,
    }
    for value in touch.values.iter().chain(&touch.deviations) {
        write!(out, ",{}", number(shortened(f64::from(*value) / scale)))?;
    }
    for code in &touch.states {
        write!(out, ",{}", meaning.state(*code))?;
    }
    writeln!(out)
}

fn put_contact_titles(meaning: &ExportMeaning, out: &mut dyn Write) -> Result<()> {
    let (force, _) = meaning.force_unit();
    let (length, _) = meaning.length_unit();
    write!(
        out,
        "sequence,time [ns],contact,taxels,x [{length}],y [{length}]"
    )?;
    for title in ["force", "force_deviation"] {
        for axis in ["x", "y", "z"] {
            write!(out, ",{title}_{axis} [{force}]")?;
        }
    }
    writeln!(
        out,
        ",torsion [N m],peak [{force}],peak_taxel,bound,certainty,velocity_x [{length}/s],velocity_y [{length}/s]"
    )
}

fn put_contacts(touch: &TouchMessage, meaning: &ExportMeaning, out: &mut dyn Write) -> Result<()> {
    let (_, force) = meaning.force_unit();
    let (_, length) = meaning.length_unit();
    for (index, contact) in touch.contacts.iter().enumerate() {
        write!(
            out,
            "{},{},{},{}",
            touch.sequence, touch.device_time_ns, contact.id, contact.taxels
        )?;
        let forces = contact.force.iter().chain(&contact.force_deviation);
        let centre = contact.centre.map(|value| value / length);
        for value in centre.into_iter().chain(forces.map(|value| value / force)) {
            write!(out, ",{}", number(value))?;
        }
        write!(
            out,
            ",{},{}",
            number(contact.torsion),
            number(contact.peak / force)
        )?;
        let bound = contact
            .bound
            .map_or(String::new(), |code| meaning.state(code));
        write!(
            out,
            ",{},{bound},{}",
            meaning.taxel(contact.peak_taxel as usize),
            touch.certainty.as_ref().map_or("", |certainty| {
                certainty
                    .contacts
                    .get(index)
                    .map_or("", |code| certainty_name(*code))
            })
        )?;
        for value in contact.velocity {
            write!(out, ",{}", number(value / length))?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Name of a code of certainty; empty for one of a later version.
fn certainty_name(code: u8) -> &'static str {
    ["exact", "at_least", "unknown"]
        .get(usize::from(code))
        .copied()
        .unwrap_or_default()
}

fn put_event(event: &EventMessage, out: &mut dyn Write) -> Result<()> {
    let contact = |contact: Option<u64>| contact.map_or(String::new(), |id| id.to_string());
    let known = |value: Option<f64>| number(value.unwrap_or(f64::NAN));
    let fields = [
        event.index.to_string(),
        event.device_time_ns.to_string(),
        event.contact.to_string(),
        text(&event.kind),
        number(event.value),
        number(event.deviation),
        event.certainty.clone().unwrap_or_default(),
        text(&event.unit),
        contact(event.parent),
        contact(event.into),
        known(event.rise_time),
        known(event.symmetry),
        known(event.direction.map(|[x, _]| x)),
        known(event.direction.map(|[_, y]| y)),
        known(event.score),
    ];
    writeln!(out, "{}", fields.join(","))
}

fn put_rest(
    rest: &RestMessage,
    new: bool,
    meaning: &ExportMeaning,
    out: &mut dyn Write,
) -> Result<()> {
    if new {
        write!(out, "utc [ns],time [ns],kind,by,message,frames")?;
        for channel in &meaning.channels {
            write!(
                out,
                ",{}",
                text(&format!("{channel} [{}]", meaning.reading.symbol))
            )?;
        }
        writeln!(out)?;
    }
    let (at, by, message) = (
        time(rest.device_time_ns),
        text(&rest.by),
        text(&rest.message),
    );
    write!(
        out,
        "{},{at},{},{by},{message},{}",
        rest.utc_ns,
        rest.kind.name(),
        rest.frames
    )?;
    for value in &rest.values {
        write!(out, ",{}", number(meaning.reading(*value)))?;
    }
    writeln!(out)
}
