//! Bags of ROS 2 in SQLite: the rows of tables, read from their trees of pages. Nothing is
//! written, no index and no query is needed: a whole library of a megabyte would be.

use std::collections::HashMap;

use super::Fault;
use super::bytes::Bytes;
use super::messages::{Message, Messages, Topic};

/// Deepest tree of pages: SQLite's own limit.
const DEEPEST: usize = 20;

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Null,
    Whole(i64),
    Bytes(Vec<u8>),
}

impl Value {
    fn text(&self) -> String {
        match self {
            Self::Bytes(bytes) => String::from_utf8_lossy(bytes).into_owned(),
            Self::Whole(number) => number.to_string(),
            Self::Null => String::new(),
        }
    }

    fn whole(&self) -> Option<i64> {
        match self {
            Self::Whole(number) => Some(*number),
            _ => None,
        }
    }
}

/// A database of pages.
#[derive(Debug)]
struct Database {
    bytes: Bytes,
    page: u64,
    /// Bytes of a page that are used.
    usable: u64,
}

/// A place in a table: pages from the root on, with the next cell of each.
#[derive(Debug, Clone)]
struct Cursor {
    stack: Vec<(u64, usize)>,
    /// Pages that were entered: none of a whole table is entered twice.
    entered: u64,
}

impl Cursor {
    fn at(root: u64) -> Self {
        Self {
            stack: vec![(root, 0)],
            entered: 0,
        }
    }
}

/// A number of 1 to 9 bytes, and what follows.
fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut value = 0_u64;
    for (at, byte) in bytes.iter().enumerate().take(9) {
        if at == 8 {
            return Some((value << 8 | u64::from(*byte), &bytes[9..]));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((value, &bytes[at + 1..]));
        }
    }
    None
}

fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    Some(usize::from(u16::from_be_bytes(
        bytes.get(at..at + 2)?.try_into().ok()?,
    )))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from(u32::from_be_bytes(
        bytes.get(at..at + 4)?.try_into().ok()?,
    )))
}

impl Database {
    fn open(mut bytes: Bytes) -> Result<Self, Fault> {
        let cut = || Fault::Cut("it ends inside its head".to_owned());
        let head = bytes.array::<100>(0)?.ok_or_else(cut)?;
        let page = match u16_at(&head, 16) {
            Some(1) => 65_536,
            Some(size) => size as u64,
            None => 0,
        };
        let usable = page.saturating_sub(u64::from(head[20]));
        if !page.is_power_of_two() || page < 512 || usable < 480 || head[56..60] > [0, 0, 0, 1][..]
        {
            return Err(Fault::Wrong(
                "its head is damaged, or its text is not UTF-8".into(),
            ));
        }
        Ok(Self {
            bytes,
            page,
            usable,
        })
    }

    fn page(&mut self, number: u64) -> Result<&[u8], Fault> {
        let (size, at) = (
            self.page,
            number.checked_sub(1).map(|before| before * self.page),
        );
        let page = match at {
            Some(at) => self.bytes.get(at, size)?,
            None => None,
        };
        page.ok_or_else(|| Fault::Cut(format!("page {number} is missing: the file was cut")))
    }

    /// The next row of a table: its number and its values.
    fn next(&mut self, cursor: &mut Cursor) -> Result<Option<(i64, Vec<Value>)>, Fault> {
        let broken = || Fault::Wrong("a page of it is damaged".to_owned());
        while let Some((number, cell)) = cursor.stack.last().copied() {
            let begin = if number == 1 { 100 } else { 0 };
            let usable = self.usable as usize;
            let page = self.page(number)?;
            let kind = page[begin];
            let cells = u16_at(page, begin + 3).ok_or_else(broken)?;
            let head = begin + if kind == 5 { 12 } else { 8 };
            let place = |cell: usize| u16_at(page, head + 2 * cell);
            match kind {
                5 if cell <= cells => {
                    let child = if cell == cells {
                        u32_at(page, begin + 8)
                    } else {
                        place(cell).and_then(|at| u32_at(page, at))
                    };
                    let child = child.ok_or_else(broken)?;
                    if let Some((_, next)) = cursor.stack.last_mut() {
                        *next += 1;
                    }
                    cursor.entered += 1;
                    let most = self.bytes.length() / self.page;
                    if cursor.stack.len() >= DEEPEST || cursor.entered > most {
                        return Err(broken());
                    }
                    cursor.stack.push((child, 0));
                }
                13 if cell < cells => {
                    let row = place(cell).and_then(|at| {
                        let (length, rest) = varint(page.get(at..usable)?)?;
                        let (row, rest) = varint(rest)?;
                        let local = local(length, usable as u64)?;
                        let (begun, rest) = rest.split_at_checked(local as usize)?;
                        let more = if local < length {
                            Some(u32_at(rest, 0)?)
                        } else {
                            None
                        };
                        Some((length, row.cast_signed(), begun.to_vec(), more))
                    });
                    let (length, row, mut payload, mut more) = row.ok_or_else(broken)?;
                    if length > self.bytes.length() {
                        return Err(broken());
                    }
                    while (payload.len() as u64) < length {
                        let page = self.page(more.unwrap_or(0))?;
                        let next = u32_at(page, 0).ok_or_else(broken)?;
                        let wanted = (length as usize - payload.len()).min(usable - 4);
                        payload.extend_from_slice(&page[4..4 + wanted]);
                        more = Some(next);
                    }
                    if let Some((_, next)) = cursor.stack.last_mut() {
                        *next += 1;
                    }
                    let values = values(&payload).ok_or_else(broken)?;
                    return Ok(Some((row, values)));
                }
                5 | 13 => {
                    cursor.stack.pop();
                }
                _ => return Err(broken()),
            }
        }
        Ok(None)
    }
}

/// Bytes of a row of `length` that stand in its own page.
fn local(length: u64, usable: u64) -> Option<u64> {
    let most = usable.checked_sub(35)?;
    if length <= most {
        return Some(length);
    }
    let least = (usable - 12) * 32 / 255 - 23;
    let fitting = least + (length - least) % (usable - 4);
    Some(if fitting <= most { fitting } else { least })
}

fn values(payload: &[u8]) -> Option<Vec<Value>> {
    let (head, after) = varint(payload)?;
    let mut body = payload.get(usize::try_from(head).ok()?..)?;
    let mut kinds = after.get(..(head as usize).checked_sub(payload.len() - after.len())?)?;
    let mut values = Vec::new();
    while !kinds.is_empty() {
        let (kind, rest) = varint(kinds)?;
        kinds = rest;
        let size = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => (kind - 12) / 2,
        };
        let (bytes, rest) = body.split_at_checked(usize::try_from(size).ok()?)?;
        body = rest;
        values.push(match kind {
            0 | 7 => Value::Null,
            8 | 9 => Value::Whole(i64::from(kind == 9)),
            1..=6 => {
                let negative = bytes[0] >> 7 == 1;
                let begin = if negative { -1 } else { 0 };
                Value::Whole(
                    bytes
                        .iter()
                        .fold(begin, |sum: i64, byte| sum << 8 | i64::from(*byte)),
                )
            }
            _ => Value::Bytes(bytes.to_vec()),
        });
    }
    Some(values)
}

/// Names of the columns of `CREATE TABLE name(a INTEGER, b TEXT)`.
fn columns(sql: &str) -> Vec<String> {
    let inside = sql.split_once('(').map_or("", |(_, rest)| rest);
    let mut depth = 0;
    let parts = inside.split(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == ',' && depth == 0
    });
    let name = |part: &str| {
        let word = part.split_whitespace().next().unwrap_or("");
        word.trim_matches(['"', '`', '[', ']', '\'']).to_lowercase()
    };
    parts.map(name).collect()
}

/// The messages of a bag.
#[derive(Debug)]
pub(super) struct BagDatabase {
    database: Database,
    topics: Vec<Topic>,
    /// Place among the topics of each number of a topic.
    numbers: HashMap<i64, usize>,
    root: u64,
    cursor: Cursor,
    /// Places of the topic, the time and the bytes in a row.
    places: [usize; 3],
}

impl BagDatabase {
    pub(super) fn open(bytes: Bytes) -> Result<Self, Fault> {
        let mut database = Database::open(bytes)?;
        let mut tables = HashMap::new();
        let mut cursor = Cursor::at(1);
        while let Some((_, row)) = database.next(&mut cursor)? {
            if let [kind, name, _, Value::Whole(root), sql, ..] = &row[..]
                && kind.text() == "table"
            {
                tables.insert(name.text(), (*root as u64, columns(&sql.text())));
            }
        }
        let missing =
            |what: &str| Fault::Wrong(format!("it is a database, but no bag of ROS 2: {what}"));
        let mut rows = |name: &str, wanted: &[&str]| -> Result<Vec<Vec<Value>>, Fault> {
            let no_table = || missing(&format!("it has no table `{name}`"));
            let (root, columns) = tables.get(name).ok_or_else(no_table)?;
            let mut all = Vec::new();
            let mut cursor = Cursor::at(*root);
            while let Some((number, row)) = database.next(&mut cursor)? {
                let value = |wanted: &&str| {
                    let at = columns.iter().position(|column| column == wanted);
                    match at.and_then(|at| row.get(at)) {
                        // The number of a row stands outside of it.
                        Some(Value::Null) | None if *wanted == "id" => Value::Whole(number),
                        found => found.cloned().unwrap_or(Value::Null),
                    }
                };
                all.push(wanted.iter().map(value).collect());
            }
            Ok(all)
        };
        let mut topics = Vec::new();
        let mut numbers = HashMap::new();
        for row in rows("topics", &["id", "name", "type", "serialization_format"])? {
            numbers.insert(row[0].whole().unwrap_or(0), topics.len());
            topics.push(Topic {
                name: row[1].text(),
                type_name: row[2].text(),
                encoding: row[3].text(),
                definition: String::new(),
            });
        }
        // Bags before ROS 2 Iron have no texts of definitions.
        let texts = rows(
            "message_definitions",
            &["topic_type", "encoding", "encoded_message_definition"],
        );
        for row in texts.unwrap_or_default() {
            for topic in &mut topics {
                if topic.type_name == row[0].text() && row[1].text() == "ros2msg" {
                    topic.definition = row[2].text();
                }
            }
        }
        let no_messages =
            || missing("it has no table `messages` with topic_id, timestamp and data");
        let (root, columns) = tables.get("messages").ok_or_else(no_messages)?;
        let mut places = [0; 3];
        for (place, wanted) in places.iter_mut().zip(["topic_id", "timestamp", "data"]) {
            *place = columns
                .iter()
                .position(|column| column == wanted)
                .ok_or_else(no_messages)?;
        }
        Ok(Self {
            cursor: Cursor::at(*root),
            root: *root,
            database,
            topics,
            numbers,
            places,
        })
    }
}

impl Messages for BagDatabase {
    fn next(&mut self) -> Result<Option<Message>, Fault> {
        loop {
            let Some((_, mut row)) = self.database.next(&mut self.cursor)? else {
                return Ok(None);
            };
            let [topic, time, data] = self.places;
            let known = row.get(topic).and_then(Value::whole);
            let known = known.and_then(|number| self.numbers.get(&number).copied());
            let time = row.get(time).and_then(Value::whole);
            let bytes = row
                .get_mut(data)
                .map(|data| std::mem::replace(data, Value::Null));
            if let (Some(topic), Some(time), Some(Value::Bytes(bytes))) = (known, time, bytes) {
                let time = u64::try_from(time).unwrap_or(0);
                return Ok(Some(Message { topic, time, bytes }));
            }
        }
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn rewind(&mut self) {
        self.cursor = Cursor::at(self.root);
    }

    fn cut(&self) -> Option<String> {
        None
    }
}
