//! Where the taxels of an array are and how they are turned.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, AnyLength, Checked, OneOrList, PositiveLength};

/// Most rows or columns of an array.
pub const MOST_LINES: usize = 256;

/// The array as a sensor file gives it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArrayDescription {
    /// Rows of taxels, 1 to 256; row 0 is at +y.
    #[schemars(range(min = 1, max = 256))]
    pub rows: usize,
    /// Columns of taxels, 1 to 256; column 0 is at -x.
    #[schemars(range(min = 1, max = 256))]
    pub columns: usize,
    /// Distance between neighbouring taxels along x and y, m: one for both, or
    /// a list [x, y].
    #[serde(deserialize_with = "quantity::one_or_list::<2, PositiveLength, _>")]
    #[schemars(with = "OneOrList<2, PositiveLength>")]
    pub pitch: [f64; 2],
    /// The surface that carries the array.
    pub mount: Mount,
}

/// The surface that carries an array.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Mount {
    /// A plane.
    Flat,
    /// The outside of a cylinder whose axis is parallel to y.
    Cylinder(Cylinder),
}

/// A cylinder that carries an array.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Radius of the surface that the taxels lie on, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub radius: f64,
    /// Height of the plane that bending does not stretch, above the lower face
    /// of the upper electrodes of a three-axis array, m; negative below. It
    /// decides how bending changes the air gap; without the key the gap stays.
    #[serde(default, deserialize_with = "quantity::optional::<AnyLength, _>")]
    #[schemars(with = "Option<Checked<AnyLength>>")]
    pub unstretched_plane: Option<f64>,
}

/// Position and directions of one taxel in the sensor's frame.
///
/// The sensor's frame is right-handed: x along the columns, y from the last
/// row to row 0, z outwards, origin at the centre of the array on its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelFrame {
    /// Centre, m.
    pub position: [f64; 3],
    /// Unit vector of the taxel's x.
    pub along_x: [f64; 3],
    /// Unit vector of the taxel's y.
    pub along_y: [f64; 3],
    /// Outward normal; a pressing force acts against it.
    pub normal: [f64; 3],
}

/// Force and moment on the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force, N: x and y of the sensor's frame, and pressing (against z).
    pub force: [f64; 3],
    /// Moment about the origin, N m, right-handed about x, y, z.
    pub moment: [f64; 3],
}

/// All taxels of an array, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels.
    pub columns: usize,
    /// Distance between taxels along x and y, m.
    pub pitch: [f64; 2],
    /// The surface.
    pub mount: Mount,
    /// One frame per taxel; index = row x columns + column.
    pub frames: Vec<TaxelFrame>,
}

impl Layout {
    /// The layout that a description states.
    pub fn new(array: &ArrayDescription) -> Self {
        let (rows, columns) = (array.rows, array.columns);
        let flat = |index| flat_position(rows, columns, array.pitch, index);
        let frames = (0..rows * columns)
            .map(|index| frame_at(array.mount, flat(index)))
            .collect();
        Self {
            rows,
            columns,
            pitch: array.pitch,
            mount: array.mount,
            frames,
        }
    }

    /// Number of taxels.
    pub fn taxels(&self) -> usize {
        self.frames.len()
    }

    /// Centre of taxel `index` on the developed (unrolled) surface, m.
    pub fn flat_position(&self, index: usize) -> [f64; 2] {
        flat_position(self.rows, self.columns, self.pitch, index)
    }

    /// Force and moment of a force (x, y, pressing) in the frame of taxel
    /// `index`, seen in the sensor's frame.
    pub fn wrench(&self, index: usize, force: [f64; 3]) -> Wrench {
        let frame = &self.frames[index];
        let vector: [f64; 3] = std::array::from_fn(|i| {
            force[0] * frame.along_x[i] + force[1] * frame.along_y[i] - force[2] * frame.normal[i]
        });
        let [x, y, z] = frame.position;
        let moment = [
            y * vector[2] - z * vector[1],
            z * vector[0] - x * vector[2],
            x * vector[1] - y * vector[0],
        ];
        Wrench {
            force: [vector[0], vector[1], -vector[2]],
            moment,
        }
    }

    /// Covariance of the force of taxel `index` turned into the sensor's
    /// frame (x, y, pressing).
    pub fn turn_covariance(&self, index: usize, covariance: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let frame = &self.frames[index];
        let turn: [[f64; 3]; 3] = std::array::from_fn(|i| {
            let outward = [frame.along_x[i], frame.along_y[i], -frame.normal[i]];
            if i == 2 {
                outward.map(|value| -value)
            } else {
                outward
            }
        });
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..3)
                    .flat_map(|a| (0..3).map(move |b| (a, b)))
                    .map(|(a, b)| turn[i][a] * covariance[a][b] * turn[j][b])
                    .sum()
            })
        })
    }
}

impl Wrench {
    /// Adds another wrench about the same origin.
    pub fn add(&mut self, other: &Self) {
        for i in 0..3 {
            self.force[i] += other.force[i];
            self.moment[i] += other.moment[i];
        }
    }
}

fn flat_position(rows: usize, columns: usize, pitch: [f64; 2], index: usize) -> [f64; 2] {
    let (row, column) = (index / columns, index % columns);
    let x = (column as f64 - 0.5 * (columns as f64 - 1.0)) * pitch[0];
    let y = (0.5 * (rows as f64 - 1.0) - row as f64) * pitch[1];
    [x, y]
}

fn frame_at(mount: Mount, [x, y]: [f64; 2]) -> TaxelFrame {
    match mount {
        Mount::Flat => TaxelFrame {
            position: [x, y, 0.0],
            along_x: [1.0, 0.0, 0.0],
            along_y: [0.0, 1.0, 0.0],
            normal: [0.0, 0.0, 1.0],
        },
        Mount::Cylinder(Cylinder { radius, .. }) => {
            let (sin, cos) = (x / radius).sin_cos();
            TaxelFrame {
                position: [radius * sin, y, radius * (cos - 1.0)],
                along_x: [cos, 0.0, -sin],
                along_y: [0.0, 1.0, 0.0],
                normal: [sin, 0.0, cos],
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(mount: Mount) -> Layout {
        Layout::new(&ArrayDescription {
            rows: 8,
            columns: 8,
            pitch: [2e-3; 2],
            mount,
        })
    }

    #[test]
    fn row_0_is_at_plus_y_and_column_0_at_minus_x() {
        assert_eq!(layout(Mount::Flat).flat_position(0), [-7e-3, 7e-3]);
        assert_eq!(layout(Mount::Flat).flat_position(63), [7e-3, -7e-3]);
    }

    #[test]
    fn pressing_a_corner_of_a_plane_turns_it_about_both_axes() {
        let wrench = layout(Mount::Flat).wrench(0, [0.0, 0.0, 1.0]);
        assert_eq!(wrench.force, [0.0, 0.0, 1.0]);
        assert_eq!(wrench.moment, [-7e-3, -7e-3, 0.0]);
    }

    #[test]
    fn a_cylinder_of_large_radius_is_flat() {
        let (flat, round) = (
            layout(Mount::Flat),
            layout(Mount::Cylinder(Cylinder {
                radius: 1e4,
                unstretched_plane: None,
            })),
        );
        for index in 0..64 {
            let (a, b) = (
                flat.wrench(index, [1.0, 2.0, 3.0]),
                round.wrench(index, [1.0, 2.0, 3.0]),
            );
            for i in 0..3 {
                // Angles of 7e-7 rad times 3 N, and times 1 cm for the moment.
                assert!((a.force[i] - b.force[i]).abs() < 5e-6);
                assert!((a.moment[i] - b.moment[i]).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn equal_pressure_all_round_a_cylinder_cancels_along_x() {
        let round = layout(Mount::Cylinder(Cylinder {
            radius: 4e-3,
            unstretched_plane: None,
        }));
        let mut total = Wrench::default();
        (0..64).for_each(|index| total.add(&round.wrench(index, [0.0, 0.0, 1.0])));
        assert!(total.force[0].abs() < 1e-12 && total.force[1].abs() < 1e-12);
        // Rotation keeps the size of a covariance.
        let turned = round.turn_covariance(3, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        for (i, row) in turned.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                assert!((value - f64::from(u8::from(i == j))).abs() < 1e-15);
            }
        }
    }
}
