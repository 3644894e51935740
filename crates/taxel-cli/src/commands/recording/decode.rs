//! `taxel recording decode`: the bytes of the wire through the decoder of a board.

use std::io::{BufWriter, Read as _, Write};
use std::path::Path;
use taxel::shown;

use taxel_board::{Begin, Counts, Decoder};
use taxel_files::{COMMIT, VERSION};
use taxel_recording::ChannelWriter;
use taxel_recording::mcap::{
    Findings, LinkMessage, MAGIC, McapReader, Message as _, RECONNECTED, Topic, WireMessage,
};
use taxel_serve::begin;
use taxel_serve::link::LinkAddress;

use super::{check_new, known, open, reader, unreadable};
use crate::arguments::DecodeWire;
use crate::outputs::{self, cannot_write};
use crate::{Done, Stop, boards, hello};

/// Bytes of a capture that are decoded at a time.
const PIECE: usize = 1 << 16;

pub(super) fn run(arguments: &DecodeWire) -> Result<Done, Stop> {
    let DecodeWire { file, output, .. } = arguments;
    is_table(output)?;
    let named = boards::board(&arguments.board)?;
    let existing = arguments.overwrite.existing();
    check_new(file, output, existing)?;
    check_new(&arguments.board, output, existing)?;
    let mut magic = [0; MAGIC.len()];
    let recorded = open(file)?.read_exact(&mut magic).is_ok() && magic == MAGIC;
    let named = if recorded {
        let mut messages = reader(file)?;
        hello::in_pieces(named, &shown::path(file), || {
            next_bytes(file, &mut messages)
        })?
    } else {
        hello::recorded(named, file)?
    };
    let begin = if recorded {
        let mut messages = reader(file)?;
        // What is said of the run stands before its first message.
        messages.next().map_err(|error| unreadable(file, &error))?;
        begin_of(messages.findings())
    } else {
        Begin::Whole
    };
    let mut decoder = Decoder::new(&named.board, begin);
    let comments = [
        format!("taxel {VERSION} {COMMIT}"),
        format!("board {}", named.name),
        format!("wire {}", shown::path(file)),
    ];
    outputs::write_file(output, existing, |new| {
        let failed = |error: std::io::Error| cannot_write(output, &error);
        let out = BufWriter::with_capacity(PIECE, new);
        let stream = named.board.stream();
        let mut writer = ChannelWriter::new(out, &stream, &comments).map_err(failed)?;
        let mut give = |decoder: &mut Decoder| {
            while let Some(frame) = decoder.next() {
                writer.write(&frame).map_err(failed)?;
            }
            Ok::<(), Stop>(())
        };
        if recorded {
            of_recording(file, &mut decoder, begin, &mut give)?;
        } else {
            of_capture(file, &mut decoder, &mut give)?;
        }
        decoder.finish();
        give(&mut decoder)?;
        let mut out = writer.end().map_err(failed)?;
        out.flush().map_err(failed)
    })?;
    let counts = decoder.counts();
    outputs::print(&format!("{}: {}", shown::path(output), in_words(&counts)))?;
    if let Some(remark) = decoder.remark() {
        note!("note: {remark}");
    }
    if let Some(difference) = decoder.changed() {
        note!(
            "note: {}: the board has changed within it: {difference}; what came since is not read",
            shown::path(file)
        );
    }
    let whole = counts.is_clean() && decoder.changed().is_none();
    Ok(if whole && counts.delivered > 0 {
        Done::Complete
    } else {
        Done::WithLosses
    })
}

/// Refuses a name that promises another format than the table that is written.
fn is_table(output: &Path) -> Result<(), Stop> {
    let ending = output.extension().unwrap_or_default();
    if ending.eq_ignore_ascii_case("csv") || outputs::is_standard(output) {
        return Ok(());
    }
    Err(Stop::WrongInput(format!(
        "-o {}: must end in .csv: the frames are written as a table\n\
         help: a recording (.mcap) of them: taxel live SENSOR --source replay:FRAMES.csv --record NEW.mcap",
        shown::path(output)
    )))
}

/// The next bytes of the wire in a recording.
fn next_bytes<R: std::io::Read>(
    file: &Path,
    messages: &mut McapReader<R>,
) -> Result<Option<Vec<u8>>, Stop> {
    while let Some(entry) = messages.next().map_err(|error| unreadable(file, &error))? {
        if entry.topic == Topic::Wire
            && let Some(wire) = WireMessage::decode(entry.bytes)
        {
            return Ok(Some(wire.bytes));
        }
    }
    Ok(None)
}

/// How the bytes of the link began whose run is recorded.
fn begin_of(findings: &Findings) -> Begin {
    let mut pairs = findings.metadata.iter().flat_map(|about| &about.pairs);
    let source = pairs.find(|(key, _)| *key == "source");
    let address = source.and_then(|(_, source)| LinkAddress::parse(source).ok());
    address.map_or(Begin::Cut, |address| begin(&address))
}

/// The bytes as they arrived, with their time, over all connections.
fn of_recording(
    file: &Path,
    decoder: &mut Decoder,
    begin: Begin,
    give: &mut impl FnMut(&mut Decoder) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let mut messages = reader(file)?;
    let mut found = false;
    let mut connection = 0;
    while let Some(entry) = messages.next().map_err(|error| unreadable(file, &error))? {
        let link = (entry.topic == Topic::Link).then(|| LinkMessage::decode(entry.bytes));
        // The pump's own message stands in the place of the frames, not of the bytes.
        if let Some(link) = link.flatten()
            && link.state != RECONNECTED
            && link.segment > connection
        {
            connection = link.segment;
            decoder.reconnect(begin);
        }
        if entry.topic != Topic::Wire {
            continue;
        }
        if let Some(wire) = WireMessage::decode(entry.bytes) {
            found = true;
            decoder.push(&wire.bytes, Some(wire.host_ns));
            give(decoder)?;
        }
    }
    known(file, messages.findings())?;
    if found {
        return Ok(());
    }
    Err(Stop::WrongInput(format!(
        "{}: has no bytes of a wire: its frames did not come over a link\nhelp: play it with taxel live --source replay:{0}",
        shown::path(file)
    )))
}

/// A file of bytes as a board sent them.
fn of_capture(
    file: &Path,
    decoder: &mut Decoder,
    give: &mut impl FnMut(&mut Decoder) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let mut capture = open(file)?;
    let mut piece = vec![0; PIECE];
    loop {
        let read = capture.read(&mut piece);
        match read.map_err(|error| unreadable(file, &error))? {
            0 => return Ok(()),
            bytes => decoder.push(&piece[..bytes], None),
        }
        give(decoder)?;
    }
}

fn in_words(counts: &Counts) -> String {
    let lost = counts
        .lost
        .map_or("not known".to_owned(), |lost| lost.to_string());
    let mut text = format!("{} frames, lost {lost}", counts.delivered);
    for (count, name) in [
        (counts.damaged, "damaged"),
        (counts.passed_over, "bytes passed over"),
        (counts.other, "other packets or lines"),
        (counts.bad_status, "status not good"),
        (counts.wrong_number, "wrong number"),
        (counts.wrong_time, "wrong time"),
        (counts.unconfirmed, "step not confirmed"),
        (counts.incomplete, "incomplete"),
        (counts.late, "late"),
        (counts.duplicate, "duplicate"),
        (counts.ambiguous, "ambiguous gaps"),
        (counts.restarts, "restarts"),
    ] {
        if count > 0 {
            text.extend([", ", name, " ", &count.to_string()]);
        }
    }
    text.push('\n');
    text
}
