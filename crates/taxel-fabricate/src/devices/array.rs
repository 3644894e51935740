//! Where the taxels are, and the plates and frames of moulds around them.

use taxel::layout::Layout;

use crate::rectangle::Rectangle;
use crate::relief::Relief;

/// Thickness of the plate under a relief: no sensor file says it, m.
pub(crate) const FLOOR: f64 = 2e-3;
/// Width of the wall round a tray or of a frame: no sensor file says it, m.
pub(crate) const WALL: f64 = 3e-3;

/// The note that goes with every mould.
pub(crate) fn own_choice() -> String {
    format!(
        "dimensions of the moulds themselves: floors of {} mm and walls of {} mm are chosen here, and no draft angle is drawn",
        FLOOR * 1e3,
        WALL * 1e3
    )
}

/// The array on the developed surface.
pub(crate) struct Array {
    pub(crate) layout: Layout,
}

impl Array {
    /// The array from edge to edge, half a pitch round the outer taxels.
    pub(crate) fn field(&self) -> Rectangle {
        let [x, y] = self.layout.pitch;
        Rectangle::centred(
            [0.0; 2],
            [x * self.layout.columns as f64, y * self.layout.rows as f64],
        )
    }

    pub(crate) fn taxels(&self) -> usize {
        self.layout.taxels()
    }

    /// A rectangle of each taxel about `offset` from its centre.
    pub(crate) fn each(&self, offset: [f64; 2], size: [f64; 2]) -> impl Iterator<Item = Rectangle> {
        (0..self.taxels()).map(move |taxel| {
            let [x, y] = self.layout.flat_position(taxel);
            Rectangle::centred([x + offset[0], y + offset[1]], size)
        })
    }

    /// Places of the rows along y and of the columns along x.
    pub(crate) fn places(&self) -> [Vec<f64>; 2] {
        let (rows, columns) = (self.layout.rows, self.layout.columns);
        let at = |taxel: usize| self.layout.flat_position(taxel);
        [
            (0..rows).map(|row| at(row * columns)[1]).collect(),
            (0..columns).map(|column| at(column)[0]).collect(),
        ]
    }
}

/// A rectangle with a wall round it.
pub(crate) fn walled(inner: &Rectangle) -> Rectangle {
    Rectangle {
        low: inner.low.map(|coordinate| coordinate - WALL),
        high: inner.high.map(|coordinate| coordinate + WALL),
    }
}

/// A frame of `height` round `inner`, open above and below.
pub(crate) fn frame(inner: &Rectangle, height: f64) -> Relief {
    Relief::level(&walled(inner), height, &[(&[*inner], 0.0)])
}
