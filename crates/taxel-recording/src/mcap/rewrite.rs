//! Writes a recording anew from what is whole in a file: all of it, or a stretch of time.

use std::io::{Read, Result, Seek, SeekFrom};
use std::ops::RangeInclusive;

use super::chunk_list::TOPICS;
use super::reader::{ChunkAt, Findings, McapReader};
use super::record::{Fields, code};
use super::scanner::CHUNK_HEAD;
use super::storage::Storage;
use super::writer::{McapWriter, RecordingHead, Stamp};
use super::{Message, RestMessage, Topic};

/// What [`rewrite`] did.
#[derive(Debug, Clone)]
pub struct Rewritten {
    /// What was found in the file.
    pub findings: Findings,
    /// Messages that were written.
    pub messages: u64,
}

/// Writes the whole chunks of `file` in the order of their times, with index and summary, as a
/// new recording into `storage`: the messages whose time of this computer, ns of UTC, lies in
/// `times`. The rest values in force at the beginning are kept.
///
/// # Errors
/// Those of `file` and of `storage`.
pub fn rewrite<R: Read + Seek, S: Storage>(
    mut file: R,
    times: &RangeInclusive<u64>,
    library: &str,
    storage: S,
) -> Result<Rewritten> {
    let begin = file.stream_position()?;
    let mut reader = McapReader::new(&mut file);
    let mut chunks: Vec<ChunkAt> = Vec::new();
    while let Some(chunk) = reader.next_chunk()? {
        chunks.push(chunk);
    }
    let findings = reader.into_findings();
    chunks.sort_by_key(|chunk| chunk.begin);
    let head = RecordingHead {
        library: library.to_owned(),
        utc_ns: findings.times.map_or(0, |[first, _]| first),
        description: findings.description.clone().unwrap_or_default(),
        attachments: findings.attachments.clone(),
        metadata: findings.metadata.clone(),
    };
    let mut writer = McapWriter::new(storage, &head)?;
    let mut messages = 0;
    let mut records = Vec::new();
    // The last rest values before the stretch.
    let mut rest: Option<(Stamp, Vec<u8>)> = None;
    let mut numbers = Numbers::default();
    for chunk in chunks {
        file.seek(SeekFrom::Start(begin + chunk.offset + CHUNK_HEAD as u64))?;
        // Its length was seen in the file.
        records.resize(chunk.records as usize, 0);
        file.read_exact(&mut records)?;
        let mut rest_of = Fields(&records);
        while let Some((code, body)) = rest_of.record() {
            let Some((mut stamp, bytes)) = (code == code::MESSAGE).then(|| parts(body)).flatten()
            else {
                continue;
            };
            if times.contains(&stamp.log_time) {
                if let Some((mut stamp_of_rest, rest)) = rest.take() {
                    stamp_of_rest.log_time = stamp.log_time;
                    numbers.count(&mut stamp_of_rest);
                    writer.encoded(stamp_of_rest, &rest)?;
                    messages += 1;
                }
                numbers.count(&mut stamp);
                writer.encoded(stamp, bytes)?;
                messages += 1;
            } else if stamp.log_time < *times.start() {
                numbers.anew = true;
                if stamp.topic != Topic::Rest {
                    continue;
                }
                let Some(mut change) = RestMessage::decode(bytes) else {
                    continue;
                };
                change.kind = super::RestKind::Begun;
                change.message = "rest values in force where the recording was cut".into();
                let mut bytes = Vec::new();
                change.encode(&mut bytes);
                rest = Some((stamp, bytes));
            }
        }
    }
    writer.finish()?;
    Ok(Rewritten { findings, messages })
}

/// Running numbers of what is written: as they were, so that what is missing stays visible; from
/// 0 on in each channel where the beginning is cut off.
#[derive(Debug, Default)]
struct Numbers {
    anew: bool,
    first: [Option<u32>; TOPICS],
}

impl Numbers {
    fn count(&mut self, stamp: &mut Stamp) {
        if self.anew {
            let first = self.first[stamp.topic.place()].get_or_insert(stamp.sequence);
            stamp.sequence = stamp.sequence.wrapping_sub(*first);
        }
    }
}

fn parts(body: &[u8]) -> Option<(Stamp, &[u8])> {
    let mut fields = Fields(body);
    let stamp = Stamp {
        topic: Topic::of_number(fields.u16()?)?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
    };
    Some((stamp, fields.0))
}
