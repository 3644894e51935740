//! The bill of layers.

use taxel::table::{self, Cell, Column, Format};

/// One layer, or one kind of part in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// What it is.
    pub part: &'static str,
    /// Its material, as far as the file says.
    pub material: String,
    /// Thickness, m.
    pub thickness: f64,
    /// Standard deviation of the thickness, m, where the file states one.
    pub deviation: Option<f64>,
    /// Pieces.
    pub pieces: usize,
    /// Area of all pieces, m².
    pub area: f64,
    /// Volume of all pieces, m³.
    pub volume: f64,
    /// Keys of the element that it follows from.
    pub keys: &'static str,
}

impl Layer {
    /// Equal upright pieces: a volume of area times thickness.
    pub(crate) fn flat(
        part: &'static str,
        material: impl Into<String>,
        thickness: f64,
        (pieces, area): (usize, f64),
        keys: &'static str,
    ) -> Self {
        Self {
            part,
            material: material.into(),
            thickness,
            deviation: None,
            pieces,
            area,
            volume: area * thickness,
            keys,
        }
    }

    /// The same with the standard deviation that the file states of its thickness, m.
    pub(crate) fn made_within(self, deviation: f64) -> Self {
        Self {
            deviation: Some(deviation),
            ..self
        }
    }
}

/// The bill as a table (CSV), from the base up.
pub fn bill(layers: &[Layer]) -> String {
    let columns = [
        Column::plain("order"),
        Column::plain("part"),
        Column::plain("material"),
        Column::new("thickness", "um", 1e-6, "m", 4),
        Column::new("thickness_deviation", "um", 1e-6, "m", 4),
        Column::plain("pieces"),
        Column::new("area", "mm2", 1e-6, "m2", 6),
        Column::new("volume", "mm3", 1e-9, "m3", 6),
        Column::plain("from"),
    ];
    let row = |(number, layer): (usize, &Layer)| {
        vec![
            Cell::Whole(number as u64 + 1),
            layer.part.into(),
            layer.material.clone().into(),
            layer.thickness.into(),
            layer
                .deviation
                .map_or_else(|| Cell::from("not stated"), Cell::from),
            Cell::Whole(layer.pieces as u64),
            layer.area.into(),
            layer.volume.into(),
            layer.keys.into(),
        ]
    };
    let rows: Vec<_> = layers.iter().enumerate().map(row).collect();
    table::render(Format::Csv, &serde_json::Map::new(), &columns, &rows)
}
