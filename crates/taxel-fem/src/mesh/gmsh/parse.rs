//! Text of the formats 2.2 and 4.1 to nodes and elements.

use std::collections::{BTreeMap, HashMap};

use super::error::GmshError;
use crate::mesh::CellShape;

/// A type of element.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Kind {
    code: i64,
    /// Number of dimensions.
    pub(super) dimension: usize,
    /// Number of corners.
    pub(super) corners: usize,
    /// Shape of the cell it becomes; none for points and lines.
    pub(super) shape: Option<CellShape>,
    /// For each node in VTK's order its place in Gmsh's.
    pub(super) order: &'static [usize],
}

/// Gmsh sorts the edges of tetrahedra and hexahedra, and the faces of hexahedra, its own
/// way (its manual, "Node ordering").
const ORDER: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
const TETRAHEDRON: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const HEXAHEDRON: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
    26,
];

const fn kind(
    code: i64,
    dimension: usize,
    corners: usize,
    shape: Option<CellShape>,
    order: &'static [usize],
) -> Kind {
    Kind {
        code,
        dimension,
        corners,
        shape,
        order,
    }
}

static KINDS: [Kind; 13] = [
    kind(15, 0, 1, None, ORDER.split_at(1).0),
    kind(1, 1, 2, None, ORDER.split_at(2).0),
    kind(8, 1, 2, None, ORDER.split_at(3).0),
    kind(2, 2, 3, Some(CellShape::Tri7), ORDER.split_at(3).0),
    kind(9, 2, 3, Some(CellShape::Tri7), ORDER.split_at(6).0),
    kind(3, 2, 4, Some(CellShape::Quad9), ORDER.split_at(4).0),
    kind(16, 2, 4, Some(CellShape::Quad9), ORDER.split_at(8).0),
    kind(10, 2, 4, Some(CellShape::Quad9), &ORDER),
    kind(4, 3, 4, Some(CellShape::Tet15), TETRAHEDRON.split_at(4).0),
    kind(11, 3, 4, Some(CellShape::Tet15), &TETRAHEDRON),
    kind(5, 3, 8, Some(CellShape::Hex27), HEXAHEDRON.split_at(8).0),
    kind(17, 3, 8, Some(CellShape::Hex27), HEXAHEDRON.split_at(20).0),
    kind(12, 3, 8, Some(CellShape::Hex27), &HEXAHEDRON),
];

/// One element with the tags of its physical groups and nodes.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) line: usize,
    pub(super) kind: &'static Kind,
    pub(super) groups: Vec<i64>,
    pub(super) nodes: Vec<i64>,
}

/// Contents of a file.
#[derive(Debug, Default)]
pub(super) struct Raw {
    /// Names of groups by dimension and tag.
    pub(super) names: BTreeMap<(usize, i64), String>,
    pub(super) points: Vec<[f64; 3]>,
    /// Number of the point of each tag.
    pub(super) nodes: HashMap<i64, usize>,
    pub(super) elements: Vec<Element>,
    /// Groups of each entity, by dimension and tag (format 4.1).
    entities: HashMap<(i64, i64), Vec<i64>>,
}

/// Lines of a file that are not empty, with their numbers.
struct Lines<'a> {
    rest: std::iter::Enumerate<std::str::Lines<'a>>,
    number: usize,
    section: &'a str,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a str, GmshError> {
        for (index, line) in self.rest.by_ref() {
            self.number = index + 1;
            let line = line.trim();
            if !line.is_empty() {
                return Ok(line);
            }
        }
        Err(GmshError::EndOfFile {
            line: self.number,
            section: self.section.to_owned(),
        })
    }

    fn not_a_number(&self, word: &str, expected: &'static str) -> GmshError {
        GmshError::NotANumber {
            line: self.number,
            word: word.to_owned(),
            expected,
        }
    }

    /// A whole line of integers, at least so many.
    fn integers(&mut self, what: &'static str, least: usize) -> Result<Vec<i64>, GmshError> {
        let line = self.next()?;
        let parse = |word: &str| {
            let number = word.parse();
            number.map_err(|_| self.not_a_number(word, "a whole number"))
        };
        let numbers: Vec<i64> = line
            .split_whitespace()
            .map(parse)
            .collect::<Result<_, _>>()?;
        self.count(what, numbers.len(), least)?;
        Ok(numbers)
    }

    fn reals(&self, words: &[&str]) -> Result<[f64; 3], GmshError> {
        self.count("coordinates", words.len(), 3)?;
        let mut point = [0.0; 3];
        for (value, word) in point.iter_mut().zip(words) {
            let number = word.parse().ok().filter(|x: &f64| x.is_finite());
            *value = number.ok_or_else(|| self.not_a_number(word, "a coordinate"))?;
        }
        Ok(point)
    }

    /// Refuses fewer entries than needed.
    fn count(&self, what: &'static str, found: usize, expected: usize) -> Result<(), GmshError> {
        if found < expected {
            return Err(GmshError::Count {
                line: self.number,
                what,
                found,
                expected,
            });
        }
        Ok(())
    }

    /// A count or a tag that is not negative.
    fn size(&self, number: i64) -> Result<usize, GmshError> {
        usize::try_from(number)
            .map_err(|_| self.not_a_number(&number.to_string(), "a number of entries"))
    }

    /// Reads the line that ends the section.
    fn end(&mut self) -> Result<(), GmshError> {
        let line = self.next()?;
        let found = line.strip_prefix("$End");
        if found == self.section.strip_prefix('$') {
            return Ok(());
        }
        Err(GmshError::Count {
            line: self.number,
            what: "lines after the last one announced",
            found: 1,
            expected: 0,
        })
    }
}

/// Reads all sections.
pub(super) fn parse(text: &str) -> Result<Raw, GmshError> {
    let mut lines = Lines {
        rest: text.lines().enumerate(),
        number: 0,
        section: "$MeshFormat",
    };
    if lines.next() != Ok("$MeshFormat") {
        return Err(GmshError::Format {
            line: lines.number.max(1),
        });
    }
    let new = format(&mut lines)?;
    let mut raw = Raw::default();
    while let Ok(section) = lines.next() {
        if !section.starts_with('$') {
            return Err(GmshError::Count {
                line: lines.number,
                what: "lines outside a section",
                found: 1,
                expected: 0,
            });
        }
        lines.section = section;
        match (section, new) {
            ("$PhysicalNames", _) => raw.names(&mut lines)?,
            ("$Entities", true) => raw.entities(&mut lines)?,
            ("$Nodes", false) => raw.old_nodes(&mut lines)?,
            ("$Nodes", true) => raw.new_nodes(&mut lines)?,
            ("$Elements", false) => raw.old_elements(&mut lines)?,
            ("$Elements", true) => raw.new_elements(&mut lines)?,
            _ => {
                // Sections of no interest, such as $Periodic or $NodeData.
                while lines.next()?.strip_prefix("$End") != section.strip_prefix('$') {}
                continue;
            }
        }
        lines.end()?;
    }
    Ok(raw)
}

/// True if the format is the new one, 4.1.
fn format(lines: &mut Lines<'_>) -> Result<bool, GmshError> {
    let words: Vec<&str> = lines.next()?.split_whitespace().collect();
    lines.count("entries of the format", words.len(), 3)?;
    let new = match words[0] {
        "2.2" | "2" => false,
        "4.1" => true,
        version => {
            return Err(GmshError::Version {
                line: lines.number,
                version: version.to_owned(),
            });
        }
    };
    if words[1] != "0" {
        return Err(GmshError::Binary { line: lines.number });
    }
    lines.end()?;
    Ok(new)
}

impl Raw {
    fn names(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let count = lines.integers("entries", 1)?[0];
        for _ in 0..lines.size(count)? {
            let line = lines.next()?;
            let mut words = line.splitn(3, char::is_whitespace);
            let mut number = || {
                let word = words.next().unwrap_or_default();
                let number: Result<i64, _> = word.parse();
                number.map_err(|_| lines.not_a_number(word, "a whole number"))
            };
            let (dimension, tag) = (number()?, number()?);
            let name = words.next().unwrap_or_default().trim().trim_matches('"');
            self.names
                .insert((lines.size(dimension)?, tag), name.to_owned());
        }
        Ok(())
    }

    /// Points have a place, other entities a box; then their groups, which alone matter.
    fn entities(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let counts = lines.integers("numbers of entities", 4)?;
        for (dimension, &count) in counts[..4].iter().enumerate() {
            let skipped = if dimension == 0 { 3 } else { 6 };
            for _ in 0..lines.size(count)? {
                let words: Vec<&str> = lines.next()?.split_whitespace().collect();
                lines.count("entries of an entity", words.len(), skipped + 2)?;
                let integer = |word: &str| {
                    let number: Result<i64, _> = word.parse();
                    number.map_err(|_| lines.not_a_number(word, "a whole number"))
                };
                let tag = integer(words[0])?;
                let groups = lines.size(integer(words[skipped + 1])?)?;
                let given = &words[skipped + 2..];
                lines.count("groups of an entity", given.len(), groups)?;
                let groups = given[..groups].iter().map(|word| integer(word));
                let groups = groups.collect::<Result<_, _>>()?;
                self.entities.insert((dimension as i64, tag), groups);
            }
        }
        Ok(())
    }

    fn add_node(&mut self, line: usize, node: i64, point: [f64; 3]) -> Result<(), GmshError> {
        if self.nodes.insert(node, self.points.len()).is_some() {
            return Err(GmshError::RepeatedNode { line, node });
        }
        self.points.push(point);
        Ok(())
    }

    fn old_nodes(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let count = lines.integers("entries", 1)?[0];
        for _ in 0..lines.size(count)? {
            let words: Vec<&str> = lines.next()?.split_whitespace().collect();
            let node = words[0].parse();
            let node = node.map_err(|_| lines.not_a_number(words[0], "the tag of a node"))?;
            let point = lines.reals(&words[1..])?;
            self.add_node(lines.number, node, point)?;
        }
        Ok(())
    }

    fn new_nodes(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let head = lines.integers("entries", 2)?;
        let before = self.points.len();
        for _ in 0..lines.size(head[0])? {
            let block = lines.integers("entries of a block", 4)?;
            let mut tags = Vec::new();
            for _ in 0..lines.size(block[3])? {
                tags.push(lines.integers("entries", 1)?[0]);
            }
            for node in tags {
                let words: Vec<&str> = lines.next()?.split_whitespace().collect();
                let point = lines.reals(&words)?;
                self.add_node(lines.number, node, point)?;
            }
        }
        lines.total("nodes in the blocks", self.points.len() - before, head[1])
    }

    fn old_elements(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let count = lines.integers("entries", 1)?[0];
        for _ in 0..lines.size(count)? {
            let words = lines.integers("entries of an element", 3)?;
            let tags = lines.size(words[2])?;
            lines.count("tags of an element", words.len() - 3, tags)?;
            // The first tag is the group; zero is none.
            let group = words[3..3 + tags].first().copied();
            let groups = group.filter(|&group| group != 0).into_iter().collect();
            self.add_element(lines, words[1], groups, &words[3 + tags..])?;
        }
        Ok(())
    }

    fn new_elements(&mut self, lines: &mut Lines<'_>) -> Result<(), GmshError> {
        let head = lines.integers("entries", 2)?;
        let before = self.elements.len();
        for _ in 0..lines.size(head[0])? {
            let block = lines.integers("entries of a block", 4)?;
            let groups = self.entities.get(&(block[0], block[1]));
            let groups = groups.cloned().unwrap_or_default();
            for _ in 0..lines.size(block[3])? {
                let words = lines.integers("entries of an element", 1)?;
                self.add_element(lines, block[2], groups.clone(), &words[1..])?;
            }
        }
        lines.total(
            "elements in the blocks",
            self.elements.len() - before,
            head[1],
        )
    }

    fn add_element(
        &mut self,
        lines: &Lines<'_>,
        code: i64,
        groups: Vec<i64>,
        nodes: &[i64],
    ) -> Result<(), GmshError> {
        let line = lines.number;
        let kind = KINDS.iter().find(|kind| kind.code == code);
        let kind = kind.ok_or(GmshError::UnknownType { line, code })?;
        if nodes.len() != kind.order.len() {
            return Err(GmshError::Count {
                line,
                what: "nodes of an element",
                found: nodes.len(),
                expected: kind.order.len(),
            });
        }
        self.elements.push(Element {
            line,
            kind,
            groups,
            nodes: nodes.to_vec(),
        });
        Ok(())
    }
}

impl Lines<'_> {
    /// Refuses a sum that differs from the one announced.
    fn total(&self, what: &'static str, found: usize, announced: i64) -> Result<(), GmshError> {
        let expected = self.size(announced)?;
        if found == expected {
            return Ok(());
        }
        Err(GmshError::Count {
            line: self.number,
            what,
            found,
            expected,
        })
    }
}
