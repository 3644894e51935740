//! Text: lines of numbers and words, JSON objects, CAN messages.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::Value;
use taxel_ground::shown;

use super::{Found, LEAST, Proposal};

/// Share of the bytes that are text in what is text.
const PRINTABLE: f64 = 0.97;
/// Share of the lines that the shapes of a proposal must cover together.
const COVERED: f64 = 0.9;
/// Most shapes of lines that make a frame.
const SHAPES: usize = 8;
/// Share of the steps that must be right: the others are losses.
const RIGHT: f64 = 0.95;

pub(super) fn proposals(bytes: &[u8]) -> Vec<Proposal> {
    let is_text =
        |byte: &u8| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n' | 0x1b) || *byte >= 0x80;
    let printable = bytes.iter().filter(|byte| is_text(byte)).count();
    if (printable as f64) < PRINTABLE * bytes.len() as f64 {
        return Vec::new();
    }
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text
        .split(['\n', '\r'])
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    // The first may have begun before, the last may go on.
    let Some(lines) = lines.get(1..lines.len().saturating_sub(1)) else {
        return Vec::new();
    };
    if lines.len() < LEAST {
        return Vec::new();
    }
    let found = [json(lines), can(lines)]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>();
    if found.is_empty() {
        rows(&text).or_else(|| shapes(lines)).into_iter().collect()
    } else {
        found
    }
}

/// Rows of numbers that follow each other, with a blank line between two frames.
fn rows(text: &str) -> Option<Proposal> {
    let text = text.replace("\r\n", "\n");
    let mut frames: Vec<Vec<usize>> = vec![Vec::new()];
    for line in text.split('\n') {
        let found = pieces(line.trim());
        let plain = |piece: &Piece<'_>| match piece {
            Piece::Words(words) => words.chars().all(|c| c.is_whitespace() || ",;".contains(c)),
            Piece::Number(_) => true,
        };
        if !found.iter().all(plain) {
            return None;
        }
        let numbers = found
            .iter()
            .filter(|piece| matches!(piece, Piece::Number(_)));
        match (numbers.count(), frames.last_mut()) {
            (0, Some(frame)) if frame.is_empty() => {}
            (0, _) => frames.push(Vec::new()),
            (numbers, Some(frame)) => frame.push(numbers),
            (_, None) => {}
        }
    }
    // The first may have begun before, the last may go on.
    let frames = frames.get(1..frames.len().saturating_sub(2))?;
    let first = frames.first()?;
    let [rows, columns] = [first.len(), *first.first()?];
    let alike = |frame: &&Vec<usize>| {
        frame.len() == rows && frame.iter().all(|numbers| *numbers == columns)
    };
    let count = frames.iter().filter(alike).count();
    if rows < 2 || count < LEAST || (count as f64) < RIGHT * frames.len() as f64 {
        return None;
    }
    Some(Proposal {
        body: format!(
            "\n[framing.lines]\nrows = {rows}\n\n[packet]\nfields = [{{ is = \"value\", name = \"c{{0..{}}}\" }}]\n",
            columns - 1
        ),
        evidence: vec![
            format!(
                "text: {count} of {} stretches between blank lines are {rows} rows of {columns} numbers",
                frames.len()
            ),
            "lines have no check: damage of a digit is not seen".into(),
        ],
        found: Found::default(),
        cyclic: false,
    })
}

/// A piece of a line: words, or a number.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Piece<'a> {
    Words(&'a str),
    Number(&'a str),
}

/// Cuts a line into numbers and what stands between them.
fn pieces(line: &str) -> Vec<Piece<'_>> {
    let mut found = Vec::new();
    let bytes = line.as_bytes();
    let (mut from, mut at) = (0, 0);
    while at < bytes.len() {
        let alone = at == 0 || !(bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
        let length = if alone { number(&line[at..]) } else { 0 };
        if length == 0 {
            at += line[at..].chars().next().map_or(1, char::len_utf8);
            continue;
        }
        if from < at {
            found.push(Piece::Words(&line[from..at]));
        }
        found.push(Piece::Number(&line[at..at + length]));
        at += length;
        from = at;
    }
    if from < line.len() {
        found.push(Piece::Words(&line[from..]));
    }
    found
}

/// Length of the number that a text begins with.
fn number(text: &str) -> usize {
    let sign = usize::from(text.starts_with(['+', '-']));
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(&text[sign..]);
    let mut end = sign + whole;
    let mut fraction = 0;
    if text[end..].starts_with('.') {
        fraction = digits(&text[end + 1..]);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return 0;
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        let power = digits(&text[end + 1 + sign..]);
        if power > 0 {
            end += 1 + sign + power;
        }
    }
    end
}

/// The words of a line with a sign for each number; a run of blanks is one.
fn shape(pieces: &[Piece<'_>]) -> String {
    let mut shape = String::new();
    for piece in pieces {
        match piece {
            Piece::Number(_) => shape.push('\u{1}'),
            Piece::Words(words) => {
                let mut blank = false;
                for c in words.chars() {
                    if !c.is_whitespace() {
                        shape.push(c);
                    } else if !blank {
                        shape.push(' ');
                    }
                    blank = c.is_whitespace();
                }
            }
        }
    }
    shape
}

/// Lines of a few shapes, each with its numbers.
fn shapes(lines: &[&str]) -> Option<Proposal> {
    let mut kinds: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
    let mut order: Vec<String> = Vec::new();
    for line in lines {
        let pieces = pieces(line);
        let shape = shape(&pieces);
        let numbers = pieces.iter().filter_map(|piece| match piece {
            Piece::Number(text) => text.parse().ok(),
            Piece::Words(_) => None,
        });
        if !kinds.contains_key(&shape) {
            order.push(shape.clone());
        }
        kinds.entry(shape).or_default().push(numbers.collect());
    }
    let most = kinds.values().map(Vec::len).max()?;
    // The lines of a frame come equally often.
    order.retain(|shape| shape.contains('\u{1}') && 2 * kinds[shape].len() > most);
    let covered: usize = order.iter().map(|shape| kinds[shape].len()).sum();
    if order.is_empty()
        || order.len() > SHAPES
        || (covered as f64) < COVERED * lines.len() as f64
        || kinds[&order[0]].len() < LEAST
    {
        return None;
    }
    let (mut names, mut counting) = (Names::default(), None);
    let mut evidence = vec![format!(
        "text: {covered} of {} lines have {}",
        lines.len(),
        if order.len() == 1 {
            "the same words between their numbers".to_owned()
        } else {
            format!("one of {} shapes", order.len())
        }
    )];
    let templates: Vec<String> = order
        .iter()
        .map(|shape| {
            let rows = &kinds[shape];
            template(shape, rows, &mut names, &mut evidence, &mut counting)
        })
        .collect();
    let list = templates
        .iter()
        .map(|template| format!("  {},\n", shown::toml(template)));
    let mut body = format!(
        "\n[framing.lines]\ntemplate = [\n{}]\n",
        list.collect::<Vec<_>>().concat()
    );
    if order.len() > 1 {
        body.push_str("frame = \"last\"\n");
    }
    if let Some(counting) = counting {
        let _ = write!(
            body,
            "\n[packet]\nfields = [{{ is = \"sequence\"{counting} }}]\n"
        );
    }
    evidence.push("lines have no check: damage of a digit is not seen".into());
    Some(Proposal {
        body,
        evidence,
        found: Found::default(),
        cyclic: false,
    })
}

/// Names that are given to values, each once.
#[derive(Debug, Default)]
struct Names {
    used: Vec<String>,
    plain: usize,
}

impl Names {
    /// A name by the words before a number, or the next plain one.
    fn of(&mut self, words: &str) -> String {
        let trimmed = words.trim_end_matches(|c: char| !c.is_alphanumeric() && c != '_');
        let begin = trimmed
            .rfind(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .map_or(0, |at| {
                at + trimmed[at..].chars().next().map_or(1, char::len_utf8)
            });
        let word = &trimmed[begin..];
        let is_name = word.starts_with(|c: char| c.is_ascii_alphabetic());
        if is_name && !self.used.iter().any(|used| used == word) {
            self.used.push(word.to_owned());
            return word.to_owned();
        }
        loop {
            self.plain += 1;
            let name = format!("c{}", self.plain);
            if !self.used.contains(&name) {
                self.used.push(name.clone());
                return name;
            }
        }
    }
}

/// The template of lines of one shape, from their numbers.
fn template(
    shape: &str,
    rows: &[Vec<f64>],
    names: &mut Names,
    evidence: &mut Vec<String>,
    counting: &mut Option<String>,
) -> String {
    let mut template = String::new();
    let (mut words, mut column) = (String::new(), 0);
    for c in shape.chars() {
        if c != '\u{1}' {
            words.push(c);
            template.push(c);
            if matches!(c, '{' | '}') {
                template.push(c);
            }
            continue;
        }
        let values: Vec<f64> = rows
            .iter()
            .filter_map(|row| row.get(column).copied())
            .collect();
        let name = names.of(&words);
        // One sequence and one time to a board.
        let is_new = |kind: &str| !evidence.iter().any(|line| line.ends_with(kind));
        match what(&values) {
            What::Counter(modulus) if is_new("a counter") => {
                evidence.push(counts_up(&name, modulus));
                counting.clone_from(&modulus.map(modulus_key));
                template.push_str("{sequence}");
            }
            What::Clock(unit, step) if is_new("a time") => {
                evidence.push(format!(
                    "\"{name}\" grows by {step:.6} from line to line, taken for {unit}: a time"
                ));
                let _ = write!(template, "{{time {unit}}}");
            }
            _ => {
                let _ = write!(template, "{{value {name}}}");
            }
        }
        words.clear();
        column += 1;
    }
    template
}

/// The line of evidence of a counter.
fn counts_up(name: &str, modulus: Option<u64>) -> String {
    let until = modulus.map_or(String::new(), |modulus| {
        format!(" and begins again from 0 at {modulus}")
    });
    format!("\"{name}\" goes up by one{until}: a counter")
}

/// The key of a counter that begins again.
fn modulus_key(modulus: u64) -> String {
    format!(", modulus = {modulus}")
}

/// What a column of numbers is.
enum What {
    /// A counter, with the number at which it begins again from 0 where that was seen.
    Counter(Option<u64>),
    /// A time in this unit, with its usual step.
    Clock(&'static str, f64),
    Value,
}

fn what(values: &[f64]) -> What {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() + 1 < LEAST {
        return What::Value;
    }
    let share = |is: &dyn Fn(f64) -> bool| {
        steps.iter().filter(|step| is(**step)).count() as f64 / steps.len() as f64
    };
    let whole = values
        .iter()
        .all(|value| value.fract() == 0.0 && *value >= 0.0);
    if whole && share(&|step| step == 1.0 || step < 0.0) >= RIGHT {
        let mut begun = values.windows(2).filter(|pair| pair[1] < pair[0]);
        let most = values.iter().copied().fold(0.0, f64::max);
        let again = begun.clone().next().is_some();
        if begun.all(|pair| pair[1] == 0.0 && pair[0] == most) && share(&|step| step < 0.0) < 0.5 {
            return What::Counter(again.then_some(most as u64 + 1));
        }
        if share(&|step| step == 1.0) >= RIGHT {
            return What::Counter(None);
        }
    }
    let grows = share(&|step| step > 0.0);
    let (most, count) = (steps.clone(), steps.len());
    steps.sort_unstable_by(f64::total_cmp);
    let median = steps[count / 2];
    let steady = most
        .iter()
        .filter(|step| **step > median / 2.0 && **step < 2.0 * median)
        .count();
    if grows < RIGHT || (steady as f64) < RIGHT * count as f64 || median <= 0.0 {
        return What::Value;
    }
    super::unit_of_clock(median).map_or(What::Value, |unit| What::Clock(unit, median))
}

/// Objects of JSON, one a line.
fn json(lines: &[&str]) -> Option<Proposal> {
    let objects: Vec<Value> = lines
        .iter()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    let objects: Vec<&Value> = objects.iter().filter(|object| object.is_object()).collect();
    if (objects.len() as f64) < COVERED * lines.len() as f64 {
        return None;
    }
    let mut leaves: Vec<(String, Leaf)> = Vec::new();
    gather(objects[0], "", &mut leaves);
    let leaf = |object: &Value, path: &str| object.pointer(path).and_then(Leaf::of);
    let alike = |(path, first): &(String, Leaf)| {
        objects
            .iter()
            .all(|object| leaf(object, path) == Some(*first))
    };
    leaves.retain(alike);
    let mut names = Names::default();
    let mut evidence = vec![format!(
        "JSON: {} of {} lines are objects with these keys",
        objects.len(),
        lines.len()
    )];
    let mut fields = String::new();
    for (path, Leaf { count, bits }) in leaves {
        let key = &path[1..];
        let values: Vec<f64> = objects
            .iter()
            .filter_map(|object| object.pointer(&path)?.as_f64())
            .collect();
        let (counted, timed) = (
            evidence.iter().any(|line| line.ends_with("a counter")),
            evidence.iter().any(|line| line.ends_with("a time")),
        );
        let field = match what(&values) {
            What::Counter(modulus) if count == 1 && !counted => {
                evidence.push(counts_up(key, modulus));
                let counting = modulus.map_or(String::new(), modulus_key);
                format!("is = \"sequence\"{counting}")
            }
            What::Clock(unit, step) if count == 1 && !timed => {
                evidence.push(format!(
                    "\"{key}\" grows by {step:.6} from object to object, taken for {unit}: a time"
                ));
                format!("is = \"time\", unit = \"{unit}\"")
            }
            _ => {
                let name = names.of(&key.replace('/', "_"));
                let name = if count == 1 {
                    name
                } else {
                    format!("{name}{{1..{count}}}")
                };
                let hexadecimal = bits.map_or(String::new(), |bits| {
                    format!(", type = \"u{bits}\", digits = \"hexadecimal\"")
                });
                format!("is = \"value\", name = \"{name}\"{hexadecimal}")
            }
        };
        let _ = writeln!(fields, "  {{ {field}, key = {} }},", shown::toml(key));
    }
    Some(Proposal {
        body: format!(
            "\n[framing.messages]\ncarrier = \"json\"\n\n[[message]]\nfields = [\n{fields}]\n"
        ),
        evidence,
        found: Found::default(),
        cyclic: false,
    })
}

/// Numbers at one place of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Leaf {
    count: usize,
    /// Bits of each, where they are text of hexadecimal digits.
    bits: Option<usize>,
}

impl Leaf {
    /// The numbers of a value; `None` where it is anything else.
    fn of(value: &Value) -> Option<Self> {
        let decimal = |count| Self { count, bits: None };
        match value {
            Value::Number(_) => Some(decimal(1)),
            Value::Array(values) => {
                let leaves = values.iter().map(Self::of);
                let leaves: Vec<Self> = leaves.collect::<Option<_>>()?;
                let first = leaves.first()?;
                let alike = leaves.iter().all(|leaf| leaf.bits == first.bits);
                let count = leaves.iter().map(|leaf| leaf.count).sum();
                alike.then_some(Self { count, ..*first })
            }
            Value::String(text) => {
                let is_delimiter = |c: char| matches!(c, ',' | ';') || c.is_whitespace();
                let words = text.split(is_delimiter).filter(|word| !word.is_empty());
                let words: Vec<&str> = words.collect();
                let width = words.first()?.len();
                let is_hex = |word: &&str| {
                    word.len() == width && word.bytes().all(|digit| digit.is_ascii_hexdigit())
                };
                if matches!(width, 2 | 4 | 8) && words.iter().all(is_hex) {
                    return Some(Self {
                        count: words.len(),
                        bits: Some(4 * width),
                    });
                }
                let is_number = |word: &&str| number(word) == word.len();
                words.iter().all(is_number).then(|| decimal(words.len()))
            }
            _ => None,
        }
    }
}

/// Paths of the numbers of an object, and how many each holds.
fn gather(value: &Value, path: &str, found: &mut Vec<(String, Leaf)>) {
    if let Some(leaf) = Leaf::of(value) {
        found.push((path.to_owned(), leaf));
    } else if let Value::Object(keys) = value {
        for (key, value) in keys {
            let key = key.replace('~', "~0").replace('/', "~1");
            gather(value, &format!("{path}/{key}"), found);
        }
    }
}

/// CAN messages as SLCAN or `candump -L` writes them.
fn can(lines: &[&str]) -> Option<Proposal> {
    let mut ids: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    let mut messages = 0;
    for line in lines {
        if let Some((id, bytes)) = can_message(line) {
            messages += 1;
            ids.entry(id).or_default().push(bytes);
        }
    }
    if (messages as f64) < COVERED * lines.len() as f64 || messages < LEAST {
        return None;
    }
    let most = ids.values().map(Vec::len).max()?;
    let mut body = "\n[framing.messages]\ncarrier = \"can\"\n".to_owned();
    let mut named = Vec::new();
    for (id, lengths) in ids.iter().filter(|(_, lengths)| 2 * lengths.len() > most) {
        let bytes = lengths.iter().copied().min().unwrap_or(0);
        if bytes == 0 {
            continue;
        }
        named.push(format!("{id:#x}"));
        let _ = write!(
            body,
            "\n[[message]]\nid = {id:#x}\nfields = [{{ is = \"value\", name = \"m{id:x}.b{{1..{bytes}}}\", type = \"u8\" }}]\n"
        );
    }
    let evidence = vec![
        format!(
            "CAN as text: {messages} of {} lines; ids that come equally often: {}",
            lines.len(),
            named.join(", ")
        ),
        "what the bytes of a message mean is not looked at: each is a value".into(),
    ];
    (!named.is_empty()).then_some(Proposal {
        body,
        evidence,
        found: Found::default(),
        cyclic: false,
    })
}

/// Id and bytes of a message.
fn can_message(line: &str) -> Option<(u64, usize)> {
    let hex = |text: &str| u64::from_str_radix(text, 16).ok();
    if let Some((id, data)) = line
        .rsplit_once(' ')
        .unwrap_or(("", line))
        .1
        .split_once('#')
    {
        return Some((hex(id)?, data.len() / 2));
    }
    let digits = match line.as_bytes().first()? {
        b't' => 3,
        b'T' => 8,
        _ => return None,
    };
    let id = hex(line.get(1..=digits)?)?;
    let bytes: usize = line.get(digits + 1..digits + 2)?.parse().ok()?;
    (line.len() >= digits + 2 + 2 * bytes).then_some((id, bytes))
}
