//! Unstructured grids of VTK, as ParaView reads them.

use std::fmt::Write as _;
use std::io;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as STANDARD;

use super::{OutputError, check_length, escape};
use crate::mesh::{CellShape, Mesh};

/// Encoding of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As text, for people.
    Ascii,
    /// As base64 after the description, exact and shorter.
    Base64,
}

/// A mesh at its reference position with fields on nodes and cells.
///
/// Cells are biquadratic quadrilaterals (28), triquadratic hexahedra (29), and quadratic
/// triangles (22) and tetrahedra (24), which every reader knows; nodes inside these and on
/// faces of tetrahedra carry data but no cell. The number of its region is the field `region` of each cell; the
/// names stand in comments at the beginning.
///
/// # Example
/// ```
/// use taxel_fem::mesh::{Axis, Grid2};
/// use taxel_fem::output::{Encoding, Vtu};
/// let axis = || Axis::uniform(0.0, 1.0, 1);
/// let mesh = Grid2::new([axis()?, axis()?], "solid").mesh()?;
/// let displacement = vec![0.0; 2 * mesh.points.len()];
/// let text = Vtu::new(&mesh)
///     .point_field("displacement", 2, &displacement)?
///     .cell_field("pressure", 1, &[3.0])?
///     .text(Encoding::Base64);
/// assert!(text.starts_with("<?xml"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Vtu<'a> {
    mesh: &'a Mesh,
    point_fields: Vec<Array>,
    cell_fields: Vec<Array>,
}

#[derive(Clone, Debug)]
struct Array {
    name: String,
    components: usize,
    values: Values,
}

#[derive(Clone, Debug)]
enum Values {
    Reals(Vec<f64>),
    Integers(Vec<i64>),
    Bytes(Vec<u8>),
}

impl<'a> Vtu<'a> {
    /// The mesh alone.
    pub fn new(mesh: &'a Mesh) -> Self {
        Self {
            mesh,
            point_fields: Vec::new(),
            cell_fields: Vec::new(),
        }
    }

    /// Adds a field of `components` numbers for each node, node by node. Plane vectors
    /// get a third component of zero, so that programs take them for vectors.
    ///
    /// # Errors
    /// [`OutputError::Length`].
    pub fn point_field(
        mut self,
        name: &str,
        components: usize,
        values: &[f64],
    ) -> Result<Self, OutputError> {
        let nodes = self.mesh.points.len();
        check_length(name, values.len(), components, nodes, "nodes")?;
        self.point_fields
            .push(Array::field(name, components, values));
        Ok(self)
    }

    /// Adds a field of `components` numbers for each cell, cell by cell.
    ///
    /// # Errors
    /// [`OutputError::Length`].
    pub fn cell_field(
        mut self,
        name: &str,
        components: usize,
        values: &[f64],
    ) -> Result<Self, OutputError> {
        let cells = self.mesh.cell_count();
        check_length(name, values.len(), components, cells, "cells")?;
        self.cell_fields
            .push(Array::field(name, components, values));
        Ok(self)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(&self, to: &mut dyn io::Write, encoding: Encoding) -> io::Result<()> {
        to.write_all(self.text(encoding).as_bytes())
    }

    /// The file as text.
    pub fn text(&self, encoding: Encoding) -> String {
        let mut file = File {
            text: String::from(
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
                 byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
            ),
            appended: String::new(),
            encoding,
        };
        file.region_names(&self.mesh.regions);
        let _ = writeln!(
            file.text,
            "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
            self.mesh.points.len(),
            self.mesh.cell_count()
        );
        file.group("PointData", &self.point_fields);
        let regions = (0..self.mesh.cell_count()).map(|cell| self.mesh.region_of(cell) as i64);
        let mut cell_fields = vec![Array::new("region", 1, Values::Integers(regions.collect()))];
        cell_fields.extend(self.cell_fields.iter().cloned());
        file.group("CellData", &cell_fields);
        let points = self.mesh.points.iter().flatten().copied().collect();
        file.group("Points", &[Array::new("Points", 3, Values::Reals(points))]);
        file.group("Cells", &self.cells());
        file.text.push_str("</Piece>\n</UnstructuredGrid>\n");
        if encoding == Encoding::Base64 {
            let _ = writeln!(
                file.text,
                "<AppendedData encoding=\"base64\">\n_{}\n</AppendedData>",
                file.appended
            );
        }
        file.text.push_str("</VTKFile>\n");
        file.text
    }

    fn cells(&self) -> [Array; 3] {
        let (mut nodes, mut ends, mut types) = (Vec::new(), Vec::new(), Vec::new());
        for cell in 0..self.mesh.cell_count() {
            let (code, count) = match self.mesh.shape(cell) {
                CellShape::Quad9 => (28, 9),
                CellShape::Tri7 => (22, 6),
                CellShape::Hex27 => (29, 27),
                CellShape::Tet15 => (24, 10),
            };
            nodes.extend(
                self.mesh.cell(cell)[..count]
                    .iter()
                    .map(|&node| i64::from(node)),
            );
            ends.push(nodes.len() as i64);
            types.push(code);
        }
        [
            Array::new("connectivity", 1, Values::Integers(nodes)),
            Array::new("offsets", 1, Values::Integers(ends)),
            Array::new("types", 1, Values::Bytes(types)),
        ]
    }
}

/// A collection of steps for ParaView: times and the names of their files.
pub fn pvd(steps: &[(f64, &str)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
         byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (time, file) in steps {
        let file = escape(file);
        let _ = writeln!(
            text,
            "<DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>"
        );
    }
    text.push_str("</Collection>\n</VTKFile>\n");
    text
}

impl Array {
    fn new(name: &str, components: usize, values: Values) -> Self {
        Self {
            name: name.to_owned(),
            components,
            values,
        }
    }

    fn field(name: &str, components: usize, values: &[f64]) -> Self {
        if components == 2 {
            let pairs = values.chunks_exact(2);
            let vectors = pairs.flat_map(|pair| [pair[0], pair[1], 0.0]).collect();
            return Self::new(name, 3, Values::Reals(vectors));
        }
        Self::new(name, components, Values::Reals(values.to_vec()))
    }
}

impl Values {
    fn kind(&self) -> &'static str {
        match self {
            Self::Reals(_) => "Float64",
            Self::Integers(_) => "Int64",
            Self::Bytes(_) => "UInt8",
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Reals(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::Integers(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::Bytes(values) => values.clone(),
        }
    }

    fn words(&self) -> Vec<String> {
        match self {
            Self::Reals(values) => values
                .iter()
                // The shortest digits that come back exactly.
                .map(|x| {
                    if x.is_nan() {
                        "nan".to_owned()
                    } else {
                        format!("{x:e}")
                    }
                })
                .collect(),
            Self::Integers(values) => values.iter().map(ToString::to_string).collect(),
            Self::Bytes(values) => values.iter().map(ToString::to_string).collect(),
        }
    }
}

/// A file in the making.
struct File {
    text: String,
    appended: String,
    encoding: Encoding,
}

impl File {
    /// Names in a comment: not every program reads fields of text.
    fn region_names(&mut self, names: &[String]) {
        for (number, name) in names.iter().enumerate() {
            // Two dashes would end the comment.
            let name = escape(name).replace('-', "\u{2010}");
            let _ = writeln!(self.text, "<!-- region {number}: {name} -->");
        }
    }

    fn group(&mut self, tag: &str, arrays: &[Array]) {
        let _ = writeln!(self.text, "<{tag}>");
        for array in arrays {
            self.array(array);
        }
        let _ = writeln!(self.text, "</{tag}>");
    }

    fn array(&mut self, array: &Array) {
        let _ = write!(
            self.text,
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" ",
            array.values.kind(),
            escape(&array.name),
            array.components
        );
        if self.encoding == Encoding::Base64 {
            let offset = self.appended.len();
            let _ = writeln!(self.text, "format=\"appended\" offset=\"{offset}\"/>");
            let values = array.values.bytes();
            // The number of bytes goes first, in one stream with them.
            let mut stream = (values.len() as u64).to_le_bytes().to_vec();
            stream.extend(values);
            STANDARD.encode_string(&stream, &mut self.appended);
            return;
        }
        self.text.push_str("format=\"ascii\">\n");
        for line in array.values.words().chunks(array.components.max(1) * 4) {
            let _ = writeln!(self.text, "{}", line.join(" "));
        }
        self.text.push_str("</DataArray>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Axis, Grid2, Grid3, LowerCell};

    fn plate() -> Mesh {
        let axis = |n| Axis::uniform(0.0, 1.0, n).unwrap();
        Grid2::new([axis(2), axis(1)], "solid & \"co\"")
            .mesh()
            .unwrap()
    }

    /// All tags of a text, each closed in order; their names and attributes.
    fn tags(text: &str) -> Vec<String> {
        let (mut all, mut open) = (Vec::new(), Vec::new());
        for piece in text.split('<').skip(1) {
            let tag = piece.split('>').next().unwrap().to_owned();
            let name = tag.split_whitespace().next().unwrap().to_owned();
            if let Some(name) = name.strip_prefix('/') {
                assert_eq!(open.pop().as_deref(), Some(name));
            } else if !tag.ends_with('/') && !tag.starts_with(['?', '!']) {
                open.push(name);
            }
            all.push(tag);
        }
        assert!(open.is_empty(), "{open:?}");
        all
    }

    fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
        let from = tag.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
        tag[from..].split('"').next().unwrap()
    }

    fn decode(text: &str) -> Vec<u8> {
        let value = |letter: u8| match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        let mut bytes = Vec::new();
        for four in text.as_bytes().chunks(4) {
            let bits = four
                .iter()
                .fold(0_u32, |bits, &l| bits << 6 | u32::from(value(l)));
            let letters = four.iter().position(|&letter| letter == b'=').unwrap_or(4);
            bytes.extend(&bits.to_be_bytes()[1..letters]);
        }
        bytes
    }

    /// The bytes of an appended array, found by its offset.
    fn appended(text: &str, name: &str) -> Vec<u8> {
        let tags = tags(text);
        let tag = tags
            .iter()
            .find(|tag| tag.contains(&format!("Name=\"{name}\"")))
            .unwrap();
        let data = &text[text.find("\n_").unwrap() + 2..];
        let data = &data[attribute(tag, "offset").parse::<usize>().unwrap()..];
        // Four letters hold three bytes: eight of the length need twelve letters.
        let length = u64::from_le_bytes(decode(&data[..12])[..8].try_into().unwrap()) as usize;
        decode(&data[..(8 + length).div_ceil(3) * 4])[8..].to_vec()
    }

    #[test]
    fn both_encodings_carry_the_same_numbers() {
        let mesh = plate();
        let field: Vec<f64> = (0..2 * mesh.points.len())
            .map(|k| (k as f64).sqrt() * 1e-7)
            .collect();
        let vtu = Vtu::new(&mesh)
            .point_field("displacement", 2, &field)
            .unwrap()
            .cell_field("pressure", 1, &[1.5, f64::NAN])
            .unwrap();
        let (text, coded) = (vtu.text(Encoding::Ascii), vtu.text(Encoding::Base64));
        for name in ["displacement", "Points", "pressure"] {
            let start = text.find(&format!("Name=\"{name}\"")).unwrap();
            let body = text[start..]
                .split('>')
                .nth(1)
                .unwrap()
                .split('<')
                .next()
                .unwrap();
            let written: Vec<f64> = body
                .split_whitespace()
                .map(|w| w.parse().unwrap())
                .collect();
            let bytes = appended(&coded, name);
            let read = bytes
                .chunks_exact(8)
                .map(|b| f64::from_le_bytes(b.try_into().unwrap()));
            let read: Vec<f64> = read.collect();
            assert_eq!(format!("{written:?}"), format!("{read:?}"), "{name}");
        }
        assert_eq!(appended(&coded, "types"), [28, 28]);
        let places = appended(&coded, "displacement").len() / 8;
        assert_eq!(places, 3 * mesh.points.len());
        let names = tags(&text)
            .into_iter()
            .filter(|tag| tag.starts_with("Piece"))
            .count();
        assert_eq!(names, 1);
        assert!(text.contains("<!-- region 0: solid &amp; &quot;co&quot; -->"));
    }

    #[test]
    fn cells_in_space_have_their_types_and_ends() {
        let axis = || Axis::uniform(0.0, 1.0, 1).unwrap();
        let brick = Grid3::new([axis(), axis(), axis()], "solid")
            .mesh()
            .unwrap();
        let coded = Vtu::new(&brick).text(Encoding::Base64);
        assert_eq!(appended(&coded, "types"), [29]);
        assert_eq!(appended(&coded, "offsets"), 27_i64.to_le_bytes());
        let shape = CellShape::Tet15;
        let points = (0..4).map(|n| shape.node_at(n)).collect();
        let cell = LowerCell {
            shape,
            region: 0,
            nodes: vec![0, 1, 2, 3],
        };
        let one = Mesh::from_lower_cells(points, &[cell], &["solid"]).unwrap();
        let coded = Vtu::new(&one).text(Encoding::Base64);
        assert_eq!(appended(&coded, "types"), [24]);
        assert_eq!(appended(&coded, "offsets"), 10_i64.to_le_bytes());
        assert_eq!(appended(&coded, "connectivity").len(), 80);
    }

    #[test]
    fn fields_of_the_wrong_length_are_refused() {
        let mesh = plate();
        let error = Vtu::new(&mesh).point_field("u", 2, &[0.0; 29]).unwrap_err();
        assert!(matches!(
            error,
            OutputError::Length {
                found: 29,
                expected: 30,
                ..
            }
        ));
        assert!(Vtu::new(&mesh).cell_field("p", 1, &[0.0; 3]).is_err());
    }

    #[test]
    fn a_collection_lists_its_steps() {
        let text = pvd(&[(0.0, "a.vtu"), (0.5, "b&c.vtu")]);
        let sets: Vec<String> = tags(&text)
            .into_iter()
            .filter(|t| t.starts_with("DataSet"))
            .collect();
        assert_eq!(attribute(&sets[1], "timestep"), "0.5");
        assert_eq!(attribute(&sets[1], "file"), "b&amp;c.vtu");
    }
}
