//! Definitions of ROS messages (`ros2msg`, `ros1msg`), and the numbers of a message by them.

use std::collections::HashMap;

use crate::frame::{Quantity, SignalUnit};

/// Most numbers of a message: those of the largest frame.
const MOST_NUMBERS: usize = 4_000_000;
/// Deepest nesting of messages in messages.
const DEEPEST: usize = 32;

/// Definitions that ROS 2 itself has, for bags without texts of them.
const KNOWN: &str = include_str!("known.msg");

/// The type of a message, with those that it uses.
#[derive(Debug, Clone)]
pub(super) struct Definition {
    types: HashMap<String, Vec<Field>>,
    root: String,
}

#[derive(Debug, Clone)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Number(Number),
    Text,
    Time,
    Duration,
    Message(String),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Count {
    One,
    Fixed(usize),
    Counted,
}

/// A number as it stands in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Unsigned(usize),
    Signed(usize),
    Float(usize),
}

impl Number {
    /// Its bytes.
    pub(super) fn size(self) -> usize {
        let (Self::Unsigned(size) | Self::Signed(size) | Self::Float(size)) = self;
        size
    }

    /// Its value; whole numbers beyond 2⁵³ are rounded.
    pub(super) fn value(self, bytes: &[u8], big: bool) -> f64 {
        let mut whole = [0; 8];
        for (at, byte) in bytes.iter().take(8).enumerate() {
            let place = if big { bytes.len().min(8) - 1 - at } else { at };
            whole[place] = *byte;
        }
        let all = u64::from_le_bytes(whole);
        match self {
            Self::Unsigned(_) => all as f64,
            Self::Signed(size) => {
                let spare = 64 - 8 * size.clamp(1, 8) as u32;
                ((all << spare).cast_signed() >> spare) as f64
            }
            Self::Float(2) => half(all as u16),
            Self::Float(4) => f64::from(f32::from_bits(all as u32)),
            Self::Float(_) => f64::from_bits(all),
        }
    }
}

/// A number of 16 bits by IEEE 754.
fn half(bits: u16) -> f64 {
    let fraction = f64::from(bits & 0x3ff) / 1024.0;
    let size = match i32::from(bits >> 10 & 0x1f) {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        power => (1.0 + fraction) * 2_f64.powi(power - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

impl Definition {
    /// That of the type `root` by its text, or by those that are known where there is none.
    pub(super) fn of(root: &str, text: &str) -> Option<Self> {
        let root = plain(root);
        let mut types = HashMap::new();
        read(KNOWN, "", &mut types);
        read(text, &root, &mut types);
        types.contains_key(&root).then_some(Self { types, root })
    }
}

/// `std_msgs/msg/Header` as `std_msgs/Header`.
fn plain(name: &str) -> String {
    name.replace("/msg/", "/")
        .trim_start_matches('/')
        .to_owned()
}

/// Reads definitions: the first is that of `root`, each further one begins with `MSG: name`.
fn read(text: &str, root: &str, types: &mut HashMap<String, Vec<Field>>) {
    let mut name = root.to_owned();
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.trim();
        if let Some(next) = line.strip_prefix("MSG:") {
            let before = std::mem::replace(&mut name, plain(next.trim()));
            let fields = std::mem::take(&mut fields);
            if !before.is_empty() {
                types.insert(before, fields);
            }
        } else if let Some(field) = field(line, &name) {
            fields.push(field);
        }
    }
    if !name.is_empty() && !text.trim().is_empty() {
        types.insert(name, fields);
    }
}

/// A field such as `float64[3] forces`; `None` for a constant, a comment or a rule.
fn field(line: &str, within: &str) -> Option<Field> {
    let line = line.split('#').next()?.trim();
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim();
    let name = rest.split([' ', '\t', '=']).next()?;
    // A constant has an equal sign, a default value none.
    if rest[name.len()..].trim_start().starts_with('=') || line.starts_with('=') {
        return None;
    }
    let (kind, count) = match kind.split_once('[') {
        None => (kind, Count::One),
        Some((kind, inside)) => {
            let inside = inside.trim_end_matches(']');
            let count = inside.parse().map_or(Count::Counted, Count::Fixed);
            (kind, count)
        }
    };
    let kind = match kind.split("<=").next()? {
        "bool" | "byte" | "char" | "uint8" => Kind::Number(Number::Unsigned(1)),
        "int8" => Kind::Number(Number::Signed(1)),
        "uint16" => Kind::Number(Number::Unsigned(2)),
        "int16" => Kind::Number(Number::Signed(2)),
        "uint32" => Kind::Number(Number::Unsigned(4)),
        "int32" => Kind::Number(Number::Signed(4)),
        "uint64" => Kind::Number(Number::Unsigned(8)),
        "int64" => Kind::Number(Number::Signed(8)),
        "float32" => Kind::Number(Number::Float(4)),
        "float64" => Kind::Number(Number::Float(8)),
        "string" => Kind::Text,
        "time" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time" => Kind::Time,
        "duration" | "builtin_interfaces/Duration" | "builtin_interfaces/msg/Duration" => {
            Kind::Duration
        }
        "Header" => Kind::Message("std_msgs/Header".into()),
        other if other.contains('/') => Kind::Message(plain(other)),
        other => {
            let package = within.split('/').next().unwrap_or("");
            Kind::Message(format!("{package}/{other}"))
        }
    };
    Some(Field {
        name: name.to_owned(),
        kind,
        count,
    })
}

/// How the numbers of a message are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// ROS 2: at multiples of their size, with a head that says the order of their bytes.
    Cdr,
    /// ROS 1: without gaps.
    Ros1,
}

/// The numbers of a message.
#[derive(Debug, Default)]
pub(super) struct Decoded {
    pub(super) values: Vec<f64>,
    /// Stamp of its head, ns.
    pub(super) stamp: Option<u64>,
    /// Path of each, where they were asked for.
    pub(super) names: Vec<String>,
    /// Rows, columns and channels of a taxel, where the message says them.
    pub(super) shape: Option<[usize; 3]>,
    wants_names: bool,
    dimensions: Vec<usize>,
    labels: Vec<String>,
}

impl Decoded {
    pub(super) fn with_names() -> Self {
        Self {
            wants_names: true,
            ..Self::default()
        }
    }

    fn clear(&mut self) {
        self.values.clear();
        self.names.clear();
        self.dimensions.clear();
        self.labels.clear();
        (self.stamp, self.shape) = (None, None);
    }
}

impl Definition {
    /// Reads a message into `out`; `None` if it is not one of this type.
    pub(super) fn decode(&self, bytes: &[u8], encoding: Encoding, out: &mut Decoded) -> Option<()> {
        out.clear();
        let mut walk = Walk::new(self, bytes, encoding, out)?;
        if self.root == "sensor_msgs/Image" {
            return walk.image();
        }
        if self.root == "sensor_msgs/PointCloud2" {
            return walk.points();
        }
        walk.message(&self.root, &mut String::new(), 0, true)?;
        let labels = std::mem::take(&mut out.labels);
        if self.root == "sensor_msgs/JointState" {
            for name in &mut out.names {
                let part = name.split_once('[').and_then(|(part, at)| {
                    let label = labels.get(at.strip_suffix(']')?.parse::<usize>().ok()?)?;
                    Some(format!("{part}.{label}"))
                });
                if let Some(part) = part {
                    *name = part;
                }
            }
        }
        let all: usize = out
            .dimensions
            .iter()
            .try_fold(1_usize, |all, one| all.checked_mul(*one))?;
        out.shape = (all == out.values.len()).then_some(match *out.dimensions {
            [rows, columns] => [rows, columns, 1],
            [rows, columns, each @ (1 | 3 | 4)] => [rows, columns, each],
            _ => [1, all, 1],
        });
        Some(())
    }

    /// True if messages of this type have numbers that may be readings.
    pub(super) fn has_numbers(&self) -> bool {
        self.any_number(&self.root, 0)
    }

    fn any_number(&self, name: &str, depth: usize) -> bool {
        let fields = self
            .types
            .get(name)
            .filter(|_| depth < DEEPEST && !is_quiet(name));
        fields.is_some_and(|fields| {
            fields.iter().any(|field| match &field.kind {
                Kind::Number(_) | Kind::Duration => true,
                Kind::Message(name) => self.any_number(name, depth + 1),
                Kind::Text | Kind::Time => false,
            })
        })
    }

    /// The unit of a number of this message, where its type says it.
    pub(super) fn unit(&self, name: &str) -> Option<SignalUnit> {
        let symbol = match &*self.root {
            "geometry_msgs/Wrench" | "geometry_msgs/WrenchStamped" if name.contains("force.") => {
                "N"
            }
            "sensor_msgs/FluidPressure" if name == "fluid_pressure" => "Pa",
            _ => return None,
        };
        SignalUnit::named(symbol).filter(|unit| unit.quantity != Quantity::Raw)
    }
}

/// True for a type whose numbers are no readings.
fn is_quiet(name: &str) -> bool {
    ["std_msgs/Header", "std_msgs/MultiArrayLayout"].contains(&name)
}

struct Walk<'a> {
    definition: &'a Definition,
    bytes: &'a [u8],
    at: usize,
    /// Largest multiple at which numbers stand.
    align: usize,
    big: bool,
    /// A message without fields still has a byte.
    pads_empty: bool,
    /// Messages in messages so far: without fields they take no byte.
    entered: usize,
    out: &'a mut Decoded,
}

impl<'a> Walk<'a> {
    fn new(
        definition: &'a Definition,
        bytes: &'a [u8],
        encoding: Encoding,
        out: &'a mut Decoded,
    ) -> Option<Self> {
        let (bytes, align, big) = match encoding {
            Encoding::Ros1 => (bytes, 1, false),
            Encoding::Cdr => {
                let (head, rest) = bytes.split_at_checked(4)?;
                let align = match head[1] {
                    0 | 1 => 8,
                    // The second version of CDR aligns to 4.
                    6 | 7 => 4,
                    _ => return None,
                };
                (rest, align, head[1] & 1 == 0)
            }
        };
        Some(Self {
            definition,
            bytes,
            at: 0,
            align,
            big,
            pads_empty: encoding == Encoding::Cdr,
            entered: 0,
            out,
        })
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(length)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    fn number(&mut self, number: Number) -> Option<f64> {
        self.at = self
            .at
            .checked_next_multiple_of(number.size().min(self.align))?;
        Some(number.value(self.take(number.size())?, self.big))
    }

    fn u32(&mut self) -> Option<u32> {
        self.number(Number::Unsigned(4)).map(|value| value as u32)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let text = self.take(length)?;
        str::from_utf8(text.strip_suffix(&[0]).unwrap_or(text)).ok()
    }

    fn time(&mut self) -> Option<u64> {
        let (seconds, rest) = (self.u32()?, self.u32()?);
        Some(u64::from(seconds) * 1_000_000_000 + u64::from(rest))
    }

    /// `shown` is false inside of what is no reading: heads and layouts.
    fn message(&mut self, name: &str, path: &mut String, depth: usize, shown: bool) -> Option<()> {
        let definition = self.definition;
        let fields = definition.types.get(name)?;
        self.entered += 1;
        if depth >= DEEPEST || self.entered > MOST_NUMBERS {
            return None;
        }
        if fields.is_empty() && self.pads_empty {
            self.take(1)?;
        }
        let begin = path.len();
        for field in fields {
            if begin > 0 {
                path.push('.');
            }
            path.push_str(&field.name);
            self.field(field, path, depth, shown)?;
            path.truncate(begin);
        }
        Some(())
    }

    fn field(&mut self, field: &Field, path: &mut String, depth: usize, shown: bool) -> Option<()> {
        let count = match field.count {
            Count::One => return self.one(&field.kind, path, depth, shown),
            Count::Fixed(count) => count,
            Count::Counted => self.u32()? as usize,
        };
        // Each member takes a byte at least, so that a wrong count ends here.
        if count > self.bytes.len().saturating_sub(self.at) {
            return None;
        }
        let begin = path.len();
        for at in 0..count {
            if self.out.wants_names {
                use std::fmt::Write as _;
                let _ = write!(path, "[{at}]");
            }
            self.one(&field.kind, path, depth, shown)?;
            path.truncate(begin);
        }
        Some(())
    }

    fn one(&mut self, kind: &Kind, path: &mut String, depth: usize, shown: bool) -> Option<()> {
        match kind {
            Kind::Number(number) => {
                let value = self.number(*number)?;
                if shown {
                    self.put(value, path)?;
                } else if path.starts_with("layout.dim") && path.rsplit('.').next() == Some("size")
                {
                    self.out.dimensions.push(value as usize);
                }
            }
            Kind::Text => {
                let text = self.text()?;
                if self.out.wants_names && path.starts_with("name[") {
                    self.out.labels.push(text.to_owned());
                }
            }
            Kind::Time => {
                let time = self.time()?;
                self.out.stamp.get_or_insert(time);
            }
            Kind::Duration => {
                let seconds = self.number(Number::Signed(4))? + f64::from(self.u32()?) * 1e-9;
                if shown {
                    self.put(seconds, path)?;
                }
            }
            Kind::Message(name) => {
                self.message(name, path, depth + 1, shown && !is_quiet(name))?;
            }
        }
        Some(())
    }

    fn put(&mut self, value: f64, path: &str) -> Option<()> {
        if self.out.values.len() >= MOST_NUMBERS {
            return None;
        }
        self.out.values.push(value);
        if self.out.wants_names {
            self.out.names.push(path.to_owned());
        }
        Some(())
    }

    /// The fields of points, each as a map of the points: `x.r0c0`.
    fn points(&mut self) -> Option<()> {
        self.message("std_msgs/Header", &mut "header".to_owned(), 0, false)?;
        let (height, width) = (self.u32()? as usize, self.u32()? as usize);
        let mut fields = Vec::new();
        for _ in 0..self.u32()? {
            let name = self.text()?.to_owned();
            let offset = self.u32()? as usize;
            let number = match self.take(1)?[0] {
                1 => Number::Signed(1),
                2 => Number::Unsigned(1),
                3 => Number::Signed(2),
                4 => Number::Unsigned(2),
                5 => Number::Signed(4),
                6 => Number::Unsigned(4),
                7 => Number::Float(4),
                8 => Number::Float(8),
                _ => return None,
            };
            let count = self.u32()? as usize;
            for member in 0..count.min(MOST_NUMBERS) {
                let name = match count {
                    1 => name.clone(),
                    _ => format!("{name}[{member}]"),
                };
                fields.push((name, offset.checked_add(member * number.size())?, number));
            }
        }
        let big = self.take(1)?[0] != 0;
        let (step, row_step) = (self.u32()? as usize, self.u32()? as usize);
        let length = self.u32()? as usize;
        let data = self.take(length)?;
        for (name, offset, number) in &fields {
            for (row, column) in (0..height).flat_map(|row| (0..width).map(move |at| (row, at))) {
                let at = row.checked_mul(row_step)?;
                let at = at.checked_add(column.checked_mul(step)?)?;
                let at = at.checked_add(*offset)?;
                let bytes = data.get(at..at.checked_add(number.size())?)?;
                let name = if self.out.wants_names {
                    format!("{name}.r{row}c{column}")
                } else {
                    String::new()
                };
                self.put(number.value(bytes, big), &name)?;
            }
        }
        self.out.shape = (fields.len() == 1).then_some([height, width, 1]);
        Some(())
    }

    /// The pixels of an image as a map.
    fn image(&mut self) -> Option<()> {
        self.message("std_msgs/Header", &mut "header".to_owned(), 0, false)?;
        let (height, width) = (self.u32()? as usize, self.u32()? as usize);
        let encoding = self.text()?;
        let big = self.take(1)?[0] != 0;
        let step = self.u32()? as usize;
        let length = self.u32()? as usize;
        let data = self.take(length)?;
        let (number, each) = pixel(encoding)?;
        let bytes = each * number.size();
        if height == 0 || width == 0 {
            return None;
        }
        if width.checked_mul(bytes)? > step || step.checked_mul(height)? > data.len() {
            return None;
        }
        for row in 0..height {
            let row_bytes = &data[row * step..][..width * bytes];
            for (at, bytes) in row_bytes.chunks_exact(number.size()).enumerate() {
                let name = if self.out.wants_names {
                    let plain = format!("r{row}c{}", at / each);
                    if each > 1 {
                        format!("{plain}[{}]", at % each)
                    } else {
                        plain
                    }
                } else {
                    String::new()
                };
                self.put(number.value(bytes, big), &name)?;
            }
        }
        self.out.shape = Some(match each {
            1 | 3 | 4 => [height, width, each],
            _ => [1, height * width * each, 1],
        });
        Some(())
    }
}

/// The numbers of a pixel.
fn pixel(encoding: &str) -> Option<(Number, usize)> {
    let byte = Number::Unsigned(1);
    Some(match encoding {
        "mono8" => (byte, 1),
        "rgb8" | "bgr8" => (byte, 3),
        "rgba8" | "bgra8" => (byte, 4),
        "mono16" => (Number::Unsigned(2), 1),
        "rgb16" | "bgr16" => (Number::Unsigned(2), 3),
        _ => {
            // `32FC1`: bits, kind and channels.
            let at = encoding.find(|c: char| !c.is_ascii_digit())?;
            let size = encoding[..at].parse::<usize>().ok()? / 8;
            let (kind, each) = encoding[at..].split_once('C')?;
            let each = if each.is_empty() {
                1
            } else {
                each.parse().ok()?
            };
            let number = match kind {
                "U" => Number::Unsigned(size),
                "S" => Number::Signed(size),
                "F" => Number::Float(size),
                _ => return None,
            };
            ([1, 2, 4, 8].contains(&size) && (1..=512).contains(&each)).then_some((number, each))?
        }
    })
}
