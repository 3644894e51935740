//! Bags of ROS: topics of messages, in one file or in several.

use super::definition::{Decoded, Definition, Encoding};
use super::{Channel, Container, Fault, Part, Rows, Series, Times};

/// A topic as a file describes it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Topic {
    pub(super) name: String,
    /// Name of the type of its messages.
    pub(super) type_name: String,
    /// How its messages are encoded: `cdr`, `ros1`, or another word.
    pub(super) encoding: String,
    /// Definition of its type.
    pub(super) definition: String,
}

/// A message: its topic among those of the file, its time in ns, and its bytes.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) topic: usize,
    pub(super) time: u64,
    pub(super) bytes: Vec<u8>,
}

/// One file of a bag.
pub(super) trait Messages: std::fmt::Debug + Send {
    /// The next message; `None` at the end. Topics are known before their first message.
    fn next(&mut self) -> Result<Option<Message>, Fault>;
    /// The topics so far.
    fn topics(&self) -> &[Topic];
    /// Begins anew.
    fn rewind(&mut self);
    /// What of the file is not whole.
    fn cut(&self) -> Option<String>;
}

/// The files of a bag, and what they hold.
#[derive(Debug)]
pub(super) struct Bags {
    files: Vec<Box<dyn Messages>>,
    topics: Vec<Topic>,
    parts: Vec<Part>,
    cut: Option<String>,
}

impl Bags {
    pub(super) fn of(mut files: Vec<Box<dyn Messages>>) -> Result<Box<dyn Container>, Fault> {
        let (mut topics, mut parts): (Vec<Topic>, Vec<Part>) = (Vec::new(), Vec::new());
        let mut spans: Vec<[u64; 2]> = Vec::new();
        let mut cut = None;
        for file in &mut files {
            let mut counts: Vec<(u64, [u64; 2])> = Vec::new();
            let end = loop {
                match file.next() {
                    Ok(Some(message)) => {
                        if counts.len() <= message.topic {
                            counts.resize(message.topic + 1, (0, [u64::MAX, 0]));
                        }
                        let (count, [first, last]) = &mut counts[message.topic];
                        *count += 1;
                        (*first, *last) = ((*first).min(message.time), (*last).max(message.time));
                    }
                    Ok(None) => break Ok(()),
                    Err(fault) => break Err(fault),
                }
            };
            match end {
                // What is whole before is read.
                Err(Fault::Cut(message) | Fault::Wrong(message))
                    if counts.iter().any(|(count, _)| *count > 0) =>
                {
                    cut.get_or_insert(message);
                }
                end => end?,
            }
            cut = cut.or_else(|| file.cut());
            counts.resize(file.topics().len(), (0, [u64::MAX, 0]));
            for (topic, (count, span)) in file.topics().iter().zip(counts) {
                let at = topics.iter().position(|known| known.name == topic.name);
                let at = at.unwrap_or_else(|| {
                    topics.push(topic.clone());
                    spans.push([u64::MAX, 0]);
                    parts.push(Part {
                        name: topic.name.clone(),
                        kind: topic.type_name.clone(),
                        unread: unread(topic),
                        ..Part::default()
                    });
                    topics.len() - 1
                });
                parts[at].count += count;
                spans[at] = [spans[at][0].min(span[0]), spans[at][1].max(span[1])];
                parts[at].rate = Part::rate_of(parts[at].count, spans[at]);
            }
            file.rewind();
        }
        Ok(Box::new(Self {
            files,
            topics,
            parts,
            cut,
        }))
    }
}

/// The encoding that is read.
fn encoding(topic: &Topic) -> Option<Encoding> {
    match &*topic.encoding {
        "cdr" => Some(Encoding::Cdr),
        "ros1" => Some(Encoding::Ros1),
        _ => None,
    }
}

fn unread(topic: &Topic) -> Option<String> {
    if encoding(topic).is_none() {
        return Some(format!(
            "its messages are encoded as {:?}, which is not read; ROS messages are",
            topic.encoding
        ));
    }
    match Definition::of(&topic.type_name, &topic.definition) {
        None => Some(format!(
            "the file has no definition of {}, and taxel knows none",
            topic.type_name
        )),
        Some(definition) if !definition.has_numbers() => {
            Some("its messages have no numbers".into())
        }
        Some(_) => None,
    }
}

impl Container for Bags {
    fn parts(&self) -> &[Part] {
        &self.parts
    }

    fn cut(&self) -> Option<String> {
        self.cut.clone()
    }

    fn open(self: Box<Self>, at: usize) -> Result<Series, Fault> {
        let topic = self.topics[at].clone();
        let unknown = || Fault::Wrong("its type is not known".into());
        let definition = Definition::of(&topic.type_name, &topic.definition).ok_or_else(unknown)?;
        let encoding = encoding(&topic).ok_or_else(unknown)?;
        let mut files = self.files;
        files.reverse();
        let mut rows = MessageRows {
            files,
            topic: topic.name,
            definition,
            encoding,
            decoded: Decoded::with_names(),
            first: false,
            number: 0,
            stamped: false,
        };
        // The first message has the names and the number of all.
        let mut nothing = Vec::new();
        if rows.next(&mut nothing)?.is_none() {
            return Err(Fault::Wrong("it has no message".into()));
        }
        rows.first = true;
        let names = std::mem::take(&mut rows.decoded.names);
        let channels = names.into_iter().map(|name| Channel {
            unit: rows.definition.unit(&name),
            name,
        });
        let channels: Vec<_> = channels.collect();
        rows.stamped = rows.decoded.stamp.is_some_and(|stamp| stamp > 0);
        let clock = if rows.stamped {
            "the stamp in the head of each message"
        } else {
            "when each message was recorded: it has no stamp of its own"
        };
        Ok(Series {
            shape: rows.decoded.shape,
            channels,
            rows: Box::new(rows),
            times: Times::Own(clock.to_owned()),
        })
    }
}

/// The messages of a topic as rows.
#[derive(Debug)]
struct MessageRows {
    /// Files still to be read, the next one last.
    files: Vec<Box<dyn Messages>>,
    topic: String,
    definition: Definition,
    encoding: Encoding,
    decoded: Decoded,
    /// True while the first message, which was read for its names, is still to be given.
    first: bool,
    number: u64,
    stamped: bool,
}

impl Rows for MessageRows {
    fn next(&mut self, values: &mut Vec<f64>) -> Result<Option<i128>, Fault> {
        if std::mem::take(&mut self.first) {
            // Read again: names are not needed any more.
            for file in &mut self.files {
                file.rewind();
            }
            self.decoded = Decoded::default();
            self.number = 0;
        }
        loop {
            let Some(file) = self.files.last_mut() else {
                return Ok(None);
            };
            let message = match file.next() {
                Ok(Some(message)) => message,
                // Why it ends is said at the end of all.
                Ok(None) | Err(Fault::Cut(_) | Fault::Wrong(_)) => {
                    self.files.pop();
                    continue;
                }
                Err(fault) => return Err(fault),
            };
            if file.topics()[message.topic].name != self.topic {
                continue;
            }
            self.number += 1;
            let decoded = self
                .definition
                .decode(&message.bytes, self.encoding, &mut self.decoded);
            if decoded.is_none() {
                let message = format!(
                    "message {} of {} is not one of its type",
                    self.number, self.topic
                );
                return Err(Fault::Wrong(message));
            }
            values.extend_from_slice(&self.decoded.values);
            let stamp = self.decoded.stamp.filter(|_| self.stamped);
            return Ok(Some(i128::from(stamp.unwrap_or(message.time))));
        }
    }
}
