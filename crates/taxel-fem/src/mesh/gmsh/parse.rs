//! Bytes of the formats 2.2 and 4.1, as text or binary, to nodes and elements.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::error::{GmshError, Position};
use super::reader::{Reader, Words};
use crate::mesh::CellShape;

/// A type of element.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Kind {
    code: i64,
    /// Number of dimensions.
    pub(super) dimension: usize,
    /// Number of corners.
    pub(super) corners: usize,
    /// Shape of the cell it becomes; none for points and lines. A wedge of 6 corners becomes
    /// several.
    pub(super) shape: Option<CellShape>,
    /// For each node in VTK's order its place in Gmsh's.
    pub(super) order: &'static [usize],
}

/// Gmsh sorts the edges of tetrahedra and hexahedra, and the faces of hexahedra, its own
/// way (its manual, "Node ordering"). Wedges stay in its order until they are cut.
const ORDER: [usize; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17];
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

static KINDS: [Kind; 16] = [
    kind(15, 0, 1, None, ORDER.split_at(1).0),
    kind(1, 1, 2, None, ORDER.split_at(2).0),
    kind(8, 1, 2, None, ORDER.split_at(3).0),
    kind(2, 2, 3, Some(CellShape::Tri7), ORDER.split_at(3).0),
    kind(9, 2, 3, Some(CellShape::Tri7), ORDER.split_at(6).0),
    kind(3, 2, 4, Some(CellShape::Quad9), ORDER.split_at(4).0),
    kind(16, 2, 4, Some(CellShape::Quad9), ORDER.split_at(8).0),
    kind(10, 2, 4, Some(CellShape::Quad9), ORDER.split_at(9).0),
    kind(4, 3, 4, Some(CellShape::Tet15), TETRAHEDRON.split_at(4).0),
    kind(11, 3, 4, Some(CellShape::Tet15), &TETRAHEDRON),
    kind(5, 3, 8, Some(CellShape::Hex27), HEXAHEDRON.split_at(8).0),
    kind(17, 3, 8, Some(CellShape::Hex27), HEXAHEDRON.split_at(20).0),
    kind(12, 3, 8, Some(CellShape::Hex27), &HEXAHEDRON),
    kind(6, 3, 6, Some(CellShape::Tet15), ORDER.split_at(6).0),
    kind(18, 3, 6, Some(CellShape::Tet15), ORDER.split_at(15).0),
    kind(13, 3, 6, Some(CellShape::Tet15), &ORDER),
];

/// Nodes of the types that are not read, so that they can be counted in a binary file.
const OTHERS: [(i64, usize); 19] = [
    (7, 5),
    (14, 14),
    (19, 13),
    (20, 9),
    (21, 10),
    (22, 12),
    (23, 15),
    (24, 15),
    (25, 21),
    (26, 4),
    (27, 5),
    (28, 6),
    (29, 20),
    (30, 35),
    (31, 56),
    (36, 16),
    (37, 25),
    (92, 64),
    (93, 125),
];

impl Kind {
    fn of(code: i64) -> Option<&'static Self> {
        KINDS.iter().find(|kind| kind.code == code)
    }

    /// True for a wedge.
    pub(super) fn is_wedge(&self) -> bool {
        self.corners == 6
    }
}

/// One element with the tags of its physical groups and nodes.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) line: Position,
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
    /// Elements that are not read: type, place of the first, number.
    others: Vec<(i64, Position, usize)>,
}

/// Reads all sections.
pub(super) fn parse(bytes: &[u8]) -> Result<Raw, GmshError> {
    let mut reader = Reader::new(bytes);
    if reader.line() != Ok("$MeshFormat") {
        return Err(GmshError::Format {
            line: reader.first_line(),
        });
    }
    let new = reader.format()?;
    let mut raw = Raw::default();
    while let Some(section) = reader.section()? {
        match (section.as_str(), new) {
            ("$PhysicalNames", _) => raw.names(&mut reader)?,
            ("$Entities", true) => raw.entities(&mut reader)?,
            ("$PartitionedEntities", true) => raw.partitioned_entities(&mut reader)?,
            ("$Nodes" | "$ParametricNodes", false) => raw.old_nodes(&mut reader)?,
            ("$Nodes" | "$ParametricNodes", true) => raw.new_nodes(&mut reader)?,
            ("$Elements", false) => raw.old_elements(&mut reader)?,
            ("$Elements", true) => raw.new_elements(&mut reader)?,
            _ => {
                // Sections of no interest, such as $Periodic or $NodeData.
                reader.skip()?;
                continue;
            }
        }
        reader.end()?;
    }
    if let Some(&(code, line, count)) = raw.others.first() {
        return Err(GmshError::UnknownType { line, code, count });
    }
    raw.name_numbers();
    Ok(raw)
}

impl Raw {
    fn names(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let count = reader.text_integers("entries", 1)?[0];
        for _ in 0..reader.size(count)? {
            let line = reader.line()?.to_owned();
            let mut words = line.splitn(3, char::is_whitespace);
            let mut number = || {
                let word = words.next().unwrap_or_default();
                let number: Result<i64, _> = word.parse();
                number.map_err(|_| reader.not_a_number(word, "a whole number"))
            };
            let (dimension, tag) = (number()?, number()?);
            let name = words.next().unwrap_or_default().trim().trim_matches('"');
            if !name.is_empty() {
                self.names
                    .insert((reader.size(dimension)?, tag.abs()), name.to_owned());
            }
        }
        Ok(())
    }

    /// Names the groups that have a number alone by it. Numbers of several dimensions are those of
    /// different groups: there the dimension is part of the name of all but the cells.
    fn name_numbers(&mut self) {
        let groups: BTreeSet<(usize, i64)> = self
            .elements
            .iter()
            .flat_map(|element| {
                element
                    .groups
                    .iter()
                    .map(|&tag| (element.kind.dimension, tag))
            })
            .filter(|group| !self.names.contains_key(group))
            .collect();
        let cells = self
            .elements
            .iter()
            .map(|element| element.kind.dimension)
            .max();
        for &(dimension, tag) in &groups {
            let known = self.names.values().any(|name| *name == tag.to_string());
            let twice = (0..4).any(|other| other != dimension && groups.contains(&(other, tag)));
            let name = if Some(dimension) != cells && (known || twice) {
                format!(
                    "{} {tag}",
                    ["point", "curve", "surface", "volume"][dimension.min(3)]
                )
            } else {
                tag.to_string()
            };
            self.names.insert((dimension, tag), name);
        }
    }

    /// Points have a place, other entities a box; then their groups, which alone matter.
    fn entities(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let counts = reader.words()?.sizes(4)?;
        for (dimension, &count) in counts.iter().enumerate() {
            for _ in 0..reader.size(count)? {
                let mut words = reader.words()?;
                let tag = words.integer("entries of an entity")?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    words.real("entries of an entity")?;
                }
                self.entity(&mut words, dimension, tag)?;
            }
        }
        Ok(())
    }

    /// The rest of the entry of an entity: its groups, and what bounds it.
    fn entity(
        &mut self,
        words: &mut Words<'_, '_>,
        dimension: usize,
        tag: i64,
    ) -> Result<(), GmshError> {
        let groups = words.counted("groups of an entity")?;
        if dimension > 0 {
            words.counted("boundaries of an entity")?;
        }
        // A negative tag is that of a group which the entity belongs to with its sides exchanged.
        let groups = groups.into_iter().map(i64::abs).collect();
        self.entities.insert((dimension as i64, tag), groups);
        Ok(())
    }

    /// As [`Self::entities`]; each entity has its parent and its partitions first.
    fn partitioned_entities(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        reader.words()?.long("number of partitions")?;
        let ghosts = reader.words()?.long("number of ghosts")?;
        for _ in 0..reader.size(ghosts)? {
            let mut words = reader.words()?;
            words.integer("entries of a ghost")?;
            words.integer("entries of a ghost")?;
        }
        let counts = reader.words()?.sizes(4)?;
        for (dimension, &count) in counts.iter().enumerate() {
            for _ in 0..reader.size(count)? {
                let mut words = reader.words()?;
                let tag = words.integer("entries of an entity")?;
                words.integer("entries of an entity")?;
                words.integer("entries of an entity")?;
                words.counted("partitions of an entity")?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    words.real("entries of an entity")?;
                }
                self.entity(&mut words, dimension, tag)?;
            }
        }
        Ok(())
    }

    fn add_node(&mut self, line: Position, node: i64, point: [f64; 3]) -> Result<(), GmshError> {
        if self.nodes.insert(node, self.points.len()).is_some() {
            return Err(GmshError::RepeatedNode { line, node });
        }
        self.points.push(point);
        Ok(())
    }

    /// Nodes; parametric ones go on with their entity and their place on it.
    fn old_nodes(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let parametric = reader.section_name() == "$ParametricNodes";
        let count = reader.text_integers("entries", 1)?[0];
        for _ in 0..reader.size(count)? {
            let mut words = reader.words()?;
            let line = words.position();
            let node = words.integer("tag of a node")?;
            let point = words.point()?;
            if parametric {
                let dimension = words.integer("dimension of the entity of a node")?;
                words.integer("entity of a node")?;
                // A place in a volume is not repeated.
                words.skip_reals(if dimension == 3 { 0 } else { dimension })?;
            }
            self.add_node(line, node, point)?;
        }
        Ok(())
    }

    fn new_nodes(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let head = reader.head(2, 4)?;
        let before = self.points.len();
        for _ in 0..reader.size(head[0])? {
            let block = reader.block()?;
            let mut tags = Vec::new();
            for _ in 0..reader.size(block[3])? {
                let mut words = reader.words()?;
                tags.push(words.long("tag of a node")?);
            }
            // Places on their curve or surface follow where they are given.
            let further = if block[2] == 0 { 0 } else { block[0] };
            for node in tags {
                let mut words = reader.words()?;
                let line = words.position();
                let point = words.point()?;
                words.skip_reals(further)?;
                self.add_node(line, node, point)?;
            }
        }
        reader.total("nodes in the blocks", self.points.len() - before, head[1])
    }

    fn old_elements(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let count = reader.text_integers("entries", 1)?[0];
        let count = reader.size(count)?;
        if reader.is_binary() {
            return self.old_binary_elements(reader, count);
        }
        for _ in 0..count {
            let words = reader.text_integers("entries of an element", 3)?;
            let tags = reader.size(words[2])?;
            reader.count("tags of an element", words.len() - 3, tags)?;
            let groups = group(&words[3..3 + tags]);
            self.add_element(reader, words[1], groups, words[3 + tags..].to_vec())?;
        }
        Ok(())
    }

    /// Blocks of elements of one type.
    fn old_binary_elements(
        &mut self,
        reader: &mut Reader<'_>,
        count: usize,
    ) -> Result<(), GmshError> {
        let mut left = count;
        while left > 0 {
            let mut words = reader.words()?;
            let code = words.integer("entries of a block")?;
            let own = words.integer("entries of a block")?;
            let tags = words.integer("entries of a block")?;
            let (own, tags) = (reader.size(own)?, reader.size(tags)?);
            reader.count("elements of a block", own, 1)?;
            reader.at_most("elements of a block", own, left)?;
            let nodes = reader.nodes_of(code, node_count(code))?;
            for _ in 0..own {
                let mut words = reader.words()?;
                // As many as the file says, and no more than it has.
                let all = (0..=tags + nodes).map(|_| words.integer("entries of an element"));
                let all: Vec<i64> = all.collect::<Result<_, _>>()?;
                let groups = group(&all[1..=tags]);
                self.add_element(reader, code, groups, all[1 + tags..].to_vec())?;
            }
            left -= own;
        }
        Ok(())
    }

    fn new_elements(&mut self, reader: &mut Reader<'_>) -> Result<(), GmshError> {
        let head = reader.head(2, 4)?;
        let (mut found, binary) = (0, reader.is_binary());
        for _ in 0..reader.size(head[0])? {
            let block = reader.block()?;
            let groups = self.entities.get(&(block[0], block[1]));
            let groups = groups.cloned().unwrap_or_default();
            let nodes = if binary {
                reader.nodes_of(block[2], node_count(block[2]))?
            } else {
                0
            };
            for _ in 0..reader.size(block[3])? {
                let words = if binary {
                    let mut words = reader.words()?;
                    let all = (0..=nodes).map(|_| words.long("entries of an element"));
                    all.collect::<Result<Vec<_>, _>>()?
                } else {
                    reader.text_integers("entries of an element", 1)?
                };
                self.add_element(reader, block[2], groups.clone(), words[1..].to_vec())?;
                found += 1;
            }
        }
        reader.total("elements in the blocks", found, head[1])
    }

    fn add_element(
        &mut self,
        reader: &Reader<'_>,
        code: i64,
        groups: Vec<i64>,
        nodes: Vec<i64>,
    ) -> Result<(), GmshError> {
        let line = reader.position();
        let Some(kind) = Kind::of(code) else {
            match self.others.iter_mut().find(|other| other.0 == code) {
                Some(other) => other.2 += 1,
                None => self.others.push((code, line, 1)),
            }
            return Ok(());
        };
        reader.count("nodes of an element", nodes.len(), kind.order.len())?;
        reader.at_most("nodes of an element", nodes.len(), kind.order.len())?;
        self.elements.push(Element {
            line,
            kind,
            groups,
            nodes,
        });
        Ok(())
    }
}

/// The first tag of an old element is its group; zero is none, and a negative one is that of an element
/// whose sides are exchanged.
fn group(tags: &[i64]) -> Vec<i64> {
    let group = tags.first().map(|group| group.abs());
    group.filter(|&group| group != 0).into_iter().collect()
}

/// Nodes of a type, if it is known at all.
fn node_count(code: i64) -> Option<usize> {
    let other = || OTHERS.iter().find(|other| other.0 == code);
    Kind::of(code)
        .map(|kind| kind.order.len())
        .or_else(|| other().map(|other| other.1))
}

/// What a line or a record holds, in the order of the format.
impl Words<'_, '_> {
    fn sizes(&mut self, count: usize) -> Result<Vec<i64>, GmshError> {
        (0..count)
            .map(|_| self.long("numbers of entities"))
            .collect()
    }

    fn point(&mut self) -> Result<[f64; 3], GmshError> {
        let mut point = [0.0; 3];
        for x in &mut point {
            *x = self.real("coordinates")?;
        }
        Ok(point)
    }

    /// A count and as many tags.
    fn counted(&mut self, what: &'static str) -> Result<Vec<i64>, GmshError> {
        let count = self.long(what)?;
        let count = self.size(count)?;
        // A wrong count must not ask for all memory.
        let mut tags = Vec::new();
        for found in 0..count {
            tags.push(self.integer_of(what, found, count)?);
        }
        Ok(tags)
    }
}
