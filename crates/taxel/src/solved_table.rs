//! Tables of solved model problems that are part of the program, in `tables/`: each says in
//! its head what was solved, how, and with which error.

use taxel_numerics::table::interpolate;

/// A table of numbers and words with named columns.
#[derive(Debug, Clone, Default)]
pub(crate) struct SolvedTable {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// One row of a table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SolvedRow<'a> {
    columns: &'a [String],
    cells: &'a [String],
}

impl SolvedTable {
    /// Reads a table; lines that begin with `#` are its head. What cannot be read is left
    /// out, and a test reads every cell.
    pub(crate) fn parse(text: &str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let cells = |line: &str| line.split(',').map(|cell| cell.trim().to_owned()).collect();
        let columns = lines.next().map(cells).unwrap_or_default();
        Self {
            columns,
            rows: lines.map(cells).collect(),
        }
    }

    /// All rows, from the top.
    pub(crate) fn rows(&self) -> impl Iterator<Item = SolvedRow<'_>> {
        self.rows.iter().map(|cells| SolvedRow {
            columns: &self.columns,
            cells,
        })
    }

    /// The numbers of `value` at those of `place`, of the rows that are to be kept, from the
    /// top.
    pub(crate) fn curve(
        &self,
        place: &str,
        value: &str,
        keep: impl Fn(&SolvedRow<'_>) -> bool,
    ) -> Curve {
        let rows = self.rows().filter(|row| keep(row));
        let points = rows.map(|row| (row.number(place), row.number(value)));
        let (places, values) = points.unzip();
        Curve { places, values }
    }
}

/// Values of one column of a table at rising places of another.
#[derive(Debug, Clone, Default)]
pub(crate) struct Curve {
    places: Vec<f64>,
    values: Vec<f64>,
}

impl Curve {
    /// Straight lines between the points, the end values beyond them; not a number without
    /// points.
    pub(crate) fn at(&self, place: f64) -> f64 {
        if self.places.is_empty() {
            return f64::NAN;
        }
        interpolate(&self.places, &self.values, place)
    }

    /// The first place.
    pub(crate) fn start(&self) -> f64 {
        self.places.first().copied().unwrap_or(f64::NAN)
    }

    /// The last place.
    pub(crate) fn end(&self) -> f64 {
        self.places.last().copied().unwrap_or(f64::NAN)
    }
}

impl<'a> SolvedRow<'a> {
    /// The words in `column`; empty without such a column.
    pub(crate) fn text(&self, column: &str) -> &'a str {
        let place = self.columns.iter().position(|name| name == column);
        let cell = place.and_then(|place| self.cells.get(place));
        cell.map_or("", String::as_str)
    }

    /// The number in `column`; not a number without one.
    pub(crate) fn number(&self, column: &str) -> f64 {
        self.text(column).parse().unwrap_or(f64::NAN)
    }
}

/// The value at `x` on straight lines between points of rising x, and on the first and the
/// last line beyond them.
pub(crate) fn interpolated(points: &[[f64; 2]], x: f64) -> f64 {
    let at = points.partition_point(|[known, _]| *known < x);
    let first = at.saturating_sub(1).min(points.len().saturating_sub(2));
    match points.get(first..) {
        Some([[x0, y0], [x1, y1], ..]) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        Some([[_, y]]) => *y,
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_on_beyond_their_points() {
        let points = [[1.0, 2.0], [2.0, 4.0], [4.0, 4.0]];
        for (x, y) in [(0.0, 0.0), (1.5, 3.0), (2.0, 4.0), (3.0, 4.0), (9.0, 4.0)] {
            assert!((interpolated(&points, x) - y).abs() < 1e-15, "{x}");
        }
        assert!(interpolated(&[], 1.0).is_nan());
    }

    #[test]
    fn a_table_has_its_cells() {
        let table = SolvedTable::parse("# head\na,b\nx,2.5\ny,3\n");
        let rows: Vec<_> = table.rows().collect();
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].text("a"), rows[0].number("b")), ("x", 2.5));
        assert!(rows[1].number("c").is_nan());
        let curve = table.curve("b", "b", |row| row.text("a") != "z");
        assert_eq!((curve.at(2.75), curve.at(9.0)), (2.75, 3.0));
        assert_eq!((curve.start(), curve.end()), (2.5, 3.0));
        assert!(Curve::default().at(1.0).is_nan());
    }
}
