//! Loads on a part of the top: what they say, and where they lie on the block.

use crate::mechanics::microchannel_block::{BlockState, BlockVoid};

use crate::mechanics::{LocalLoad, LocalLoads, MicrochannelBlock};
use taxel::device::MicrochannelArray;
use taxel::device::microchannel_loads::{
    AREA_COLUMN, CENTRE_X, CENTRE_Y, FORCE_Z, LOADED_SHARE, PATCH_X, PATCH_Y, PRESSURE, PUNCH,
    SECOND, is_double,
};
use taxel::predict::{Curve, Load, LoadRefused};
use taxel::sensor::micrometres;

/// The block of an array: all its taxels with one wall around them, its sides free.
#[derive(Debug, Clone)]
pub(super) struct ArrayBlock {
    pub(super) block: MicrochannelBlock,
    /// Channels of the row and of the column layer.
    pub(super) counts: [usize; 2],
    /// Which of the upper and the lower layer the rows are, which the columns.
    position: [usize; 2],
    /// Lengths along x and y, m.
    size: [f64; 2],
}

impl ArrayBlock {
    /// # Errors
    /// A sentence for a drawing that can't be solved.
    pub(super) fn new(array: &MicrochannelArray<'_>) -> Result<Self, String> {
        let stack = array.void_stack()?;
        let counts = array.counts();
        let wall = stack.pitch - stack.section.width;
        let [rows, columns] = counts.map(|count| count as f64 * stack.pitch + wall);
        let size = [columns, rows];
        let position = array.position();
        // A row is as long as the block along x, a column as it is along y.
        let channel = |layer: usize| {
            let drawn = &array.layers[layer];
            let share = size[layer] / drawn.conductor.length;
            (share.min(1.0), drawn.closing.clone())
        };
        // Where the rows are the columns would be: this also leads back from upper and lower.
        let at = position;
        Ok(Self {
            block: MicrochannelBlock {
                counts: at.map(|layer| counts[layer]),
                size: at.map(|layer| size[layer]),
                channels: at.map(channel),
                stack,
            },
            counts,
            position,
            size,
        })
    }

    /// Share of a channel of a layer (rows, columns) that lies in the block.
    pub(super) fn share(&self, layer: usize) -> f64 {
        self.block.channels[self.position[layer]].0
    }

    /// Channels of a layer in a state of the block, rows from +y, columns from -x.
    pub(super) fn channels<'s>(
        &self,
        state: &'s BlockState,
        layer: usize,
    ) -> impl Iterator<Item = &'s BlockVoid> {
        let voids = &state.voids[self.position[layer]];
        (0..voids.len()).map(move |number| match layer {
            0 => &voids[voids.len() - 1 - number],
            _ => &voids[number],
        })
    }

    /// The loads at their places, and their size together.
    pub(super) fn read(&self, load: &Load<'_>) -> Result<(LocalLoads, f64), LoadRefused> {
        let second = is_double(
            &load
                .values()
                .map(|value| value.is_some())
                .collect::<Vec<_>>(),
        );
        let mut pressed = vec![self.read_one(load, 0)?];
        if second {
            pressed.push(self.read_one(load, SECOND)?);
            self.check_apart(load, &pressed)?;
        }
        let pressed = pressed.into_iter().map(|(load, value, _)| (load, value));
        Ok(LocalLoads::of(pressed.collect()))
    }

    /// Load of a patch, Pa, or of a punch, N, with its middle and lengths along x and y; its
    /// columns begin at `first`.
    fn read_one(
        &self,
        load: &Load<'_>,
        first: usize,
    ) -> Result<(LocalLoad, f64, [[f64; 2]; 2]), LoadRefused> {
        let number = |column: usize| load.number(first + column);
        let centre = [CENTRE_X, CENTRE_Y].map(|column| number(column).unwrap_or(0.0));
        let refused = |column: usize, message: &str, help: &str| LoadRefused {
            column: first + column,
            message: message.into(),
            help: help.into(),
        };
        let (pressed, extent, value) = if let Some(diameter) = number(PUNCH) {
            let force = number(FORCE_Z)
                .ok_or_else(|| refused(FORCE_Z, "the punch has no force", "give its force_z"))?;
            let centre = self.turned(centre);
            (LocalLoad::Punch { centre, diameter }, [diameter; 2], force)
        } else {
            let (Some(x), Some(y)) = (number(PATCH_X), number(PATCH_Y)) else {
                let message = "the patch has no size";
                return Err(refused(PATCH_X, message, "give patch_x and patch_y"));
            };
            let force = number(FORCE_Z).map(|force| force / (x * y));
            let value = number(PRESSURE).or(force).ok_or_else(|| {
                refused(
                    PRESSURE,
                    "nothing presses on the patch",
                    "give a pressure or a force_z",
                )
            })?;
            let size = self.turned([x, y]);
            let centre = self.turned(centre);
            (LocalLoad::Patch { centre, size }, [x, y], value)
        };
        let punch = matches!(pressed, LocalLoad::Punch { .. });
        self.check(centre, extent, punch).map_err(|mut refused| {
            refused.column += first;
            refused
        })?;
        Ok((pressed, value, [centre, extent]))
    }

    /// Two loads must not lie on one place, and a punch of two must press.
    fn check_apart(
        &self,
        load: &Load<'_>,
        pressed: &[(LocalLoad, f64, [[f64; 2]; 2])],
    ) -> Result<(), LoadRefused> {
        for (number, (one, value, _)) in pressed.iter().enumerate() {
            let first = number * SECOND;
            let others = pressed.iter().any(|(_, other, _)| other != value);
            if matches!(one, LocalLoad::Punch { .. }) && *value == 0.0 && others {
                return Err(LoadRefused {
                    column: first + FORCE_Z,
                    message: String::from("a punch without a force does not touch the sheet"),
                    help: String::from("leave it out, or give its force"),
                });
            }
        }
        let ends = |[centre, extent]: [[f64; 2]; 2], axis: usize| {
            [-0.5, 0.5].map(|side: f64| centre[axis] + side * extent[axis])
        };
        let [(.., one), (.., other)] = pressed else {
            return Ok(());
        };
        let common = [0, 1].map(|axis| {
            let (one, other) = (ends(*one, axis), ends(*other, axis));
            [one[0].max(other[0]), one[1].min(other[1])]
        });
        // A billionth is forgiven: lengths are often sums of others.
        let near = 1e-9 * self.size[0].max(self.size[1]);
        if common.iter().all(|[from, to]| to - from > near) {
            let [x, y] =
                common.map(|[from, to]| format!("{} to {}", micrometres(from), micrometres(to)));
            let column = [CENTRE_X, CENTRE_Y]
                .into_iter()
                .map(|column| SECOND + column)
                .find(|column| load.number(*column).is_some());
            return Err(LoadRefused {
                column: column.unwrap_or(SECOND + PATCH_X),
                message: format!(
                    "the two loads lie over each other: from {x} along x and {y} along y"
                ),
                help: String::from(
                    "move them apart; where two pressures lie on one place, give patches side by side with their sum \
                     between",
                ),
            });
        }
        Ok(())
    }

    /// Values along x and y as those along the upper and the lower channels.
    fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        if self.position == [0, 1] {
            [x, y]
        } else {
            [y, x]
        }
    }

    fn check(&self, centre: [f64; 2], extent: [f64; 2], punch: bool) -> Result<(), LoadRefused> {
        let columns = if punch {
            [PUNCH; 2]
        } else {
            [PATCH_X, PATCH_Y]
        };
        let what = if punch { "punch" } else { "patch" };
        let least = self.block.stack.section.height;
        for axis in 0..2 {
            let name = ["x", "y"][axis];
            let (length, side) = (extent[axis], self.size[axis]);
            if length < least {
                return Err(LoadRefused {
                    column: columns[axis],
                    message: format!(
                        "a {what} of {} is smaller than the height of a channel, {}",
                        micrometres(length),
                        micrometres(least)
                    ),
                    help: String::from(
                        "give a larger one; the response of the microchannels would not become smaller",
                    ),
                });
            }
            // A billionth is forgiven: lengths are often sums of others.
            if centre[axis].abs() + length / 2.0 > side / 2.0 * (1.0 + 1e-9) {
                let end = side / 2.0;
                return Err(LoadRefused {
                    column: if length > side {
                        columns[axis]
                    } else {
                        [CENTRE_X, CENTRE_Y][axis]
                    },
                    message: format!(
                        "a {what} of {} along {name} with its middle at {} reaches over the block of taxels, which \
                         goes from -{} to {} along {name}",
                        micrometres(length),
                        micrometres(centre[axis]),
                        micrometres(end),
                        micrometres(end)
                    ),
                    help: String::from(
                        "keep it on the block; for a load on the whole top give only the pressure",
                    ),
                });
            }
        }
        Ok(())
    }
}

/// Checks that the given columns make one patch or one punch, or two of them.
pub(super) fn combination(given: &[bool]) -> Result<(), String> {
    one_place(&given[..SECOND.min(given.len())])?;
    match given.get(SECOND..) {
        Some(second) if is_double(given) => one_place(second).map_err(|problem| {
            format!("of the second load (columns that end in _2, words in 2): {problem}")
        }),
        _ => Ok(()),
    }
}

fn one_place(given: &[bool]) -> Result<(), String> {
    let has = |column: usize| given.get(column) == Some(&true);
    let problem = if has(LOADED_SHARE) {
        "a position on the block and a loaded_share are given; the position says what share is loaded: leave loaded_share out"
    } else if has(AREA_COLUMN) {
        "an area and a position on the block are given; the area is that of the patch or the punch: leave area out"
    } else if has(PUNCH) && (has(PATCH_X) || has(PATCH_Y)) {
        "a punch and a patch are given; name one of them"
    } else if has(PUNCH) && (has(PRESSURE) || !has(FORCE_Z)) {
        "a punch is pushed by a force: give it as \"fz=3 mN, punch=0.5 mm\", without a pressure"
    } else if has(PUNCH) {
        return Ok(());
    } else if !(has(PATCH_X) && has(PATCH_Y)) {
        "a position on the block needs what presses there: give patch_x and patch_y, or punch_diameter"
    } else if has(PRESSURE) == has(FORCE_Z) {
        "a patch is pressed by a pressure or by a force: give one of p and fz, such as \"p=10 kPa, px=1 mm, py=1 mm\""
    } else {
        return Ok(());
    };
    Err(problem.into())
}

/// A drawing that can't be solved, as a load that can't be answered.
pub(super) fn refused(message: &str) -> LoadRefused {
    LoadRefused {
        column: PATCH_X,
        message: message.into(),
        help: String::from("give a load on the whole top"),
    }
}

/// The changes of the most pressed channels over the force.
pub(super) fn curves() -> Vec<Curve> {
    vec![Curve {
        title: String::from("Relative change of resistance against force"),
        x: "support_force",
        y: vec!["row_greatest_change", "column_greatest_change"],
        y_label: "R/R0 - 1",
    }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::device::microchannel_loads::{LOADS, is_local};
    use taxel::predict::Loads;
    use taxel::sensor::Sensor;

    fn block_of(edit: impl Fn(&str) -> String) -> ArrayBlock {
        let text = Sensor::shipped_text("liquid-metal-2x4").unwrap();
        let sensor = Sensor::parse("edited.toml", &edit(text)).unwrap();
        ArrayBlock::new(&sensor.microchannels().unwrap()).unwrap()
    }

    fn read(array_block: &ArrayBlock, load: &str) -> Result<(LocalLoads, f64), LoadRefused> {
        let loads = Loads::one(load, &LOADS).unwrap();
        assert!(is_local(&loads.given.columns));
        combination(&loads.given.columns).unwrap();
        array_block.read(&loads.load(0))
    }

    /// A state whose volume ratios are 0, 1, 2 … in the order of the block.
    fn numbered(array_block: &ArrayBlock) -> BlockState {
        let voids = |count: usize| {
            let void = |number| BlockVoid {
                volume_ratio: number as f64,
                ..BlockVoid::default()
            };
            (0..count).map(void).collect()
        };
        BlockState {
            drives: vec![0.0],
            force: 0.0,
            contact_radii: vec![0.0],
            stress: 0.0,
            voids: array_block.block.counts.map(voids),
        }
    }

    #[test]
    fn positions_are_turned_to_the_upper_channels_and_answers_back() {
        let shipped = block_of(str::to_owned);
        // Columns lie above and run along y: the block's first axis is y.
        assert_eq!(shipped.block.counts, [4, 2]);
        for (size, exact) in shipped.block.size.into_iter().zip([1.4e-3, 2.6e-3]) {
            assert!((size - exact).abs() < 1e-12);
        }
        let (load, pressure) = read(
            &shipped,
            "p=10 kPa, px=1 mm, py=0.5 mm, cx=0.3 mm, cy=-0.2 mm",
        )
        .unwrap();
        let expected = LocalLoad::Patch {
            centre: [-0.2e-3, 0.3e-3],
            size: [0.5e-3, 1e-3],
        };
        assert_eq!((load.parts, pressure), (vec![(expected, 1.0)], 10e3));
        let state = numbered(&shipped);
        let order = |layer| -> Vec<f64> {
            let channels = shipped.channels(&state, layer);
            channels.map(|void| void.volume_ratio).collect()
        };
        // Rows are counted from +y, columns from -x.
        assert_eq!(order(0), [1.0, 0.0]);
        assert_eq!(order(1), [0.0, 1.0, 2.0, 3.0]);
        // With the rows above nothing is turned.
        let other = block_of(|text| {
            text.replace("roof = \"140 um\"", "roof = \"X\"")
                .replace("roof = \"300 um\"", "roof = \"140 um\"")
                .replace("roof = \"X\"", "roof = \"300 um\"")
                .replace(
                    "closing.plane_strain_cell.thickness = \"500 um\"",
                    "closing.points = [{ net_pressure = \"5 kPa\", area_ratio = 0.5 }]",
                )
        });
        assert_eq!(other.block.counts, [2, 4]);
        let (load, force) = read(&other, "fz=3 mN, punch=0.5 mm, cx=0.3 mm").unwrap();
        let expected = LocalLoad::Punch {
            centre: [0.3e-3, 0.0],
            diameter: 0.5e-3,
        };
        assert_eq!((load.parts, force), (vec![(expected, 1.0)], 3e-3));
    }

    #[test]
    fn what_is_not_on_the_block_is_refused() {
        let array_block = block_of(str::to_owned);
        for (load, column) in [
            ("p=1 kPa, px=1 mm, py=1 mm, cx=0.9 mm", CENTRE_X),
            ("p=1 kPa, px=1 mm, py=1 mm, cy=-0.3 mm", CENTRE_Y),
            ("p=1 kPa, px=3 mm, py=1 mm", PATCH_X),
            ("fz=1 mN, punch=1.5 mm", PUNCH),
            ("fz=1 mN, punch=10 um", PUNCH),
            (
                "p=1 kPa, px=1 mm, py=1 mm, p2=1 kPa, px2=1 mm, py2=1 mm, cy2=-0.3 mm",
                SECOND + CENTRE_Y,
            ),
            (
                "p=1 kPa, px=1 mm, py=1 mm, p2=1 kPa, px2=1 mm, py2=1 mm, cx2=0.7 mm",
                SECOND + CENTRE_X,
            ),
            (
                "p=1 kPa, px=0.5 mm, py=1 mm, fz2=0 mN, punch2=0.5 mm, cx2=0.7 mm",
                SECOND + FORCE_Z,
            ),
        ] {
            assert_eq!(
                read(&array_block, load).unwrap_err().column,
                column,
                "{load}"
            );
        }
        // A patch as large as the block is on it.
        assert!(read(&array_block, "p=1 kPa, px=2.6 mm, py=1.4 mm").is_ok());
    }

    #[test]
    fn two_loads_press_in_the_proportion_of_their_pressures() {
        let array_block = block_of(str::to_owned);
        let (loads, size) = read(
            &array_block,
            "p=4 kPa, px=0.5 mm, py=0.5 mm, cx=-0.9 mm, p2=6 kPa, px2=0.5 mm, py2=0.5 mm, cx2=0.9 mm",
        )
        .unwrap();
        let patch = |along: f64| LocalLoad::Patch {
            centre: [0.0, along],
            size: [0.5e-3; 2],
        };
        assert_eq!(size, 4e3);
        assert_eq!(loads.parts, [(patch(-0.9e-3), 1.0), (patch(0.9e-3), 1.5)]);
        // Touching edges are beside each other.
        let touching =
            "p=4 kPa, px=1 mm, py=1 mm, cx=-0.5 mm, p2=6 kPa, px2=1 mm, py2=1 mm, cx2=0.5 mm";
        assert!(read(&array_block, touching).is_ok());
    }

    #[test]
    fn what_makes_no_patch_and_no_punch_is_refused() {
        for load in [
            "p=1 kPa, px=1 mm",
            "px=1 mm, py=1 mm",
            "p=1 kPa, fz=1 mN, px=1 mm, py=1 mm",
            "p=1 kPa, px=1 mm, py=1 mm, share=0.5",
            "fz=1 mN, area=1 mm2, px=1 mm, py=1 mm",
            "fz=1 mN, punch=0.5 mm, px=1 mm",
            "p=1 kPa, punch=0.5 mm",
            "p=1 kPa, cx=0.1 mm",
            "p=1 kPa, px=1 mm, py=1 mm, p2=1 kPa",
            "p=1 kPa, px2=1 mm, py2=1 mm",
        ] {
            let loads = Loads::one(load, &LOADS).unwrap();
            assert!(combination(&loads.given.columns).is_err(), "{load}");
        }
    }
}
