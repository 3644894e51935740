//! Where the taxels are, and the plates and frames of moulds around them.

use taxel::layout::Layout;

use crate::rectangle::{Rectangle, lines};
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

/// A frame of `height` round `inner`, open above and below.
pub(crate) fn frame(inner: &Rectangle, height: f64) -> Relief {
    let along = |axis: usize| {
        let (low, high) = (inner.low[axis], inner.high[axis]);
        vec![low - WALL, low, high, high + WALL]
    };
    let inside = |point: [f64; 2]| {
        (0..2).all(|axis| (inner.low[axis]..inner.high[axis]).contains(&point[axis]))
    };
    Relief::of_cells(
        along(0),
        along(1),
        |at| if inside(at) { 0.0 } else { height },
    )
}

/// A plate over `field` with level figures on it or in it: `height` of a point, m, constant
/// between the edges of `figures`.
pub(crate) fn plate(
    field: &Rectangle,
    figures: &[Rectangle],
    height: impl Fn([f64; 2]) -> f64,
) -> Relief {
    let along = |axis: usize| {
        let edges = figures.iter().chain([field]);
        lines(
            edges
                .flat_map(|figure| [figure.low[axis], figure.high[axis]])
                .collect(),
        )
    };
    Relief::of_cells(along(0), along(1), height)
}
