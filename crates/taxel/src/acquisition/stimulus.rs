//! Stimulus scripts: what touches the simulated twin, and what fails on it.

use std::f64::consts::{FRAC_PI_2, PI};

use schemars::JsonSchema;
use serde::Deserialize;

use super::slider::Slider;
use crate::InputError;
use crate::layout::Layout;
use crate::quantity::{
    self, AnyForce, AnyLength, Checked, NonNegativeCapacitance, NonNegativeTime, PositiveLength,
    PositiveTime,
};
use crate::schema;
use crate::sensor::CapacitorName;
use crate::toml_input;

/// Shipped stimulus scripts: name and text.
const SHIPPED: &[(&str, &str)] = &[
    ("finger", include_str!("../../sensors/stimuli/finger.toml")),
    ("press", include_str!("../../sensors/stimuli/press.toml")),
    (
        "piezo-press",
        include_str!("../../sensors/stimuli/piezo-press.toml"),
    ),
    (
        "piezo-shear",
        include_str!("../../sensors/stimuli/piezo-shear.toml"),
    ),
    (
        "piezo-slide",
        include_str!("../../sensors/stimuli/piezo-slide.toml"),
    ),
    (
        "piezo-tap",
        include_str!("../../sensors/stimuli/piezo-tap.toml"),
    ),
    (
        "two-fingers",
        include_str!("../../sensors/stimuli/two-fingers.toml"),
    ),
    (
        "mat-ghost",
        include_str!("../../sensors/stimuli/mat-ghost.toml"),
    ),
    ("push", include_str!("../../sensors/stimuli/push.toml")),
    ("pad-a", include_str!("../../sensors/stimuli/pad-a.toml")),
    ("pad-b", include_str!("../../sensors/stimuli/pad-b.toml")),
    ("pad-c", include_str!("../../sensors/stimuli/pad-c.toml")),
    ("pad-d", include_str!("../../sensors/stimuli/pad-d.toml")),
    ("pad-e", include_str!("../../sensors/stimuli/pad-e.toml")),
];

/// A script of loads and failures; it repeats after its duration.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stimulus {
    /// Version of this format: 1.
    #[schemars(extend("const" = 1))]
    pub schema: u32,
    /// Name of the script.
    pub name: String,
    /// Length of the script, s.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "Checked<PositiveTime>")]
    pub duration: f64,
    /// Fingers: round pressure patches.
    #[serde(default)]
    pub finger: Vec<Finger>,
    /// Probes: forces on single taxels.
    #[serde(default)]
    pub probe: Vec<Probe>,
    /// Wavy sliders: ridges that move along a line.
    #[serde(default)]
    pub slider: Vec<Slider>,
    /// Capacitors that fail.
    #[serde(default)]
    pub fault: Vec<Fault>,
    /// Times without a link: the frames of the device do not arrive.
    #[serde(default)]
    pub outage: Vec<Outage>,
    /// Frames that get lost or doubled on the way.
    #[serde(default)]
    pub link: Link,
}

/// A round patch of pressure p = p₀√(1 − r²/R²), as of a soft ball (Hertz).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Finger {
    /// Radius R of the patch, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub radius: f64,
    /// Points in time, joined by straight lines; before the first and after
    /// the last the finger is away.
    pub path: Vec<FingerPoint>,
}

/// One point of a finger's path.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FingerPoint {
    /// Time from the start of the script, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub time: f64,
    /// Centre on the developed surface [x, y], m.
    #[serde(deserialize_with = "quantity::list::<2, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 2]")]
    pub at: [f64; 2],
    /// Total force [x, y, pressing], N.
    #[serde(deserialize_with = "quantity::list::<3, AnyForce, _>")]
    #[schemars(with = "[Checked<AnyForce>; 3]")]
    pub force: [f64; 3],
}

/// A probe that loads the bump of one taxel.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Row and column of the taxel.
    pub taxel: [usize; 2],
    /// Points in time, joined by straight lines.
    pub path: Vec<ProbePoint>,
}

/// One point of a probe's ramp.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbePoint {
    /// Time from the start of the script, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub time: f64,
    /// Force [x, y, pressing] in the taxel's frame, N.
    #[serde(deserialize_with = "quantity::list::<3, AnyForce, _>")]
    #[schemars(with = "[Checked<AnyForce>; 3]")]
    pub force: [f64; 3],
}

/// One capacitor (or whole taxel) that fails for a time.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Which one.
    pub channel: FailedChannel,
    /// Reading of the failed capacitor.
    pub reads: FaultReading,
    /// Start, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub from: f64,
    /// End, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub to: f64,
}

/// Which capacitor fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FailedChannel {
    /// Row and column of the taxel, from 0.
    pub taxel: [usize; 2],
    /// `"11"`, `"12"`, `"21"` or `"22"`; without it the whole taxel fails.
    pub capacitor: Option<CapacitorName>,
}

/// Reading of a failed capacitor.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultReading {
    /// Nothing: an open line, code zero.
    Dead,
    /// Always the same capacitance.
    Stuck(Stuck),
}

/// A capacitor that always reads the same.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stuck {
    /// Its capacitance, F.
    #[serde(deserialize_with = "quantity::one::<NonNegativeCapacitance, _>")]
    #[schemars(with = "Checked<NonNegativeCapacitance>")]
    pub at: f64,
}

/// A time without a link.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outage {
    /// Start, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub from: f64,
    /// End, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub to: f64,
}

/// Transmission of frames from the device: lost and doubled frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Every so many-th frame is lost; 0 (default) loses none.
    #[serde(default)]
    pub lose_every: u64,
    /// Every so many-th frame comes twice; 0 (default) doubles none.
    #[serde(default)]
    pub double_every: u64,
}

impl Stimulus {
    /// Reads a script; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake with its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let stimulus: Self = toml_input::parse(file, text)?;
        stimulus.check(file, text)?;
        Ok(stimulus)
    }

    /// Names of the shipped scripts.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Text of a shipped script.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        SHIPPED
            .iter()
            .find(|(shipped, _)| *shipped == name)
            .map(|(_, text)| *text)
    }

    /// The JSON schema of the script.
    pub fn json_schema() -> String {
        schema::json_schema::<Self>()
    }

    fn check(&self, file: &str, text: &str) -> Result<(), InputError> {
        let at = |path: &str, message: &str, help: &str| {
            toml_input::at_key(
                file,
                text,
                &path.split('.').collect::<Vec<_>>(),
                message,
                help,
            )
        };
        if self.schema != 1 {
            let message = format!(
                "schema {} is not known; this program reads schema 1",
                self.schema
            );
            return Err(at("schema", &message, "write schema = 1"));
        }
        let paths = self.finger.iter().enumerate().map(|(i, finger)| {
            (
                format!("finger.{i}.path"),
                finger.path.iter().map(|p| p.time).collect::<Vec<_>>(),
            )
        });
        let ramps = self.probe.iter().enumerate().map(|(i, probe)| {
            (
                format!("probe.{i}.path"),
                probe.path.iter().map(|p| p.time).collect(),
            )
        });
        for (path, times) in paths.chain(ramps) {
            if times.len() < 2 {
                return Err(at(
                    &path,
                    "a path needs at least two points",
                    "add points in time",
                ));
            }
            for (i, pair) in times.windows(2).enumerate() {
                if pair[1] <= pair[0] {
                    let message = format!("{} s does not come after {} s", pair[1], pair[0]);
                    let key = format!("{path}.{}.time", i + 1);
                    return Err(at(&key, &message, "order the points by time"));
                }
            }
            if let Some(last) = times.last().filter(|last| **last > self.duration) {
                let message = format!(
                    "{last} s is after the end of the script, {} s",
                    self.duration
                );
                let key = format!("{path}.{}.time", times.len() - 1);
                return Err(at(&key, &message, "make the duration longer"));
            }
        }
        for (i, slider) in self.slider.iter().enumerate() {
            if let Some((key, message, help)) = slider.mistake(self.duration) {
                return Err(at(&format!("slider.{i}.{key}"), &message, help));
            }
        }
        let spans = self
            .fault
            .iter()
            .enumerate()
            .map(|(i, fault)| (format!("fault.{i}"), fault.from, fault.to))
            .chain(
                self.outage
                    .iter()
                    .enumerate()
                    .map(|(i, outage)| (format!("outage.{i}"), outage.from, outage.to)),
            );
        for (path, from, to) in spans {
            if to <= from {
                let message = format!("it ends at {to} s, before it starts at {from} s");
                return Err(at(
                    &format!("{path}.to"),
                    &message,
                    "give an end after the start",
                ));
            }
        }
        Ok(())
    }

    /// Checks that the taxels named in the script exist in `layout`.
    ///
    /// # Errors
    /// The first taxel outside the array, as a sentence for people.
    pub fn fits(&self, layout: &Layout) -> Result<(), String> {
        let probes = self.probe.iter().map(|probe| ("probe", probe.taxel));
        let faults = self
            .fault
            .iter()
            .map(|fault| ("fault", fault.channel.taxel));
        for (what, [row, column]) in probes.chain(faults) {
            if row >= layout.rows || column >= layout.columns {
                return Err(format!(
                    "the {what} of script \"{}\" is on taxel [{row}, {column}]; the array has rows 0 to {} and \
                     columns 0 to {}",
                    self.name,
                    layout.rows - 1,
                    layout.columns - 1
                ));
            }
        }
        Ok(())
    }
}

/// A stimulus on a layout, asked at device times: the script repeats.
#[derive(Debug, Clone, Copy)]
pub struct Script<'a> {
    stimulus: &'a Stimulus,
    layout: &'a Layout,
}

/// A finger at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Centre on the developed surface, m.
    pub centre: [f64; 2],
    /// Radius, m.
    pub radius: f64,
    /// Total force x, y, pressing, N.
    pub force: [f64; 3],
}

impl<'a> Script<'a> {
    /// `stimulus` on the taxels of `layout`.
    pub fn new(stimulus: &'a Stimulus, layout: &'a Layout) -> Self {
        Self { stimulus, layout }
    }

    /// The taxels.
    pub fn layout(&self) -> &'a Layout {
        self.layout
    }

    /// Device time to time of the script, s.
    fn script_time(&self, time: f64) -> f64 {
        time.rem_euclid(self.stimulus.duration)
    }

    /// The fingers and ridges that touch at device time `time`, s.
    pub fn patches(&self, time: f64) -> impl Iterator<Item = Patch> {
        let time = self.script_time(time);
        let sliders = self.stimulus.slider.iter();
        let ridges = sliders.flat_map(move |slider| slider.ridges(time));
        let fingers = self.stimulus.finger.iter().filter_map(move |finger| {
            let (from, to, share) = around(&finger.path, time, |point| point.time)?;
            Some(Patch {
                centre: std::array::from_fn(|i| mix(from.at[i], to.at[i], share)),
                radius: finger.radius,
                force: std::array::from_fn(|axis| mix(from.force[axis], to.force[axis], share)),
            })
        });
        fingers.chain(ridges)
    }

    /// Force of the probes on taxel `taxel` at device time `time`, s: x, y,
    /// pressing, N.
    pub fn probe_force(&self, taxel: usize, time: f64) -> [f64; 3] {
        let time = self.script_time(time);
        let here = [taxel / self.layout.columns, taxel % self.layout.columns];
        let mut total = [0.0; 3];
        let probes = &self.stimulus.probe;
        for probe in probes.iter().filter(|probe| probe.taxel == here) {
            if let Some((from, to, share)) = around(&probe.path, time, |point| point.time) {
                for (axis, sum) in total.iter_mut().enumerate() {
                    *sum += mix(from.force[axis], to.force[axis], share);
                }
            }
        }
        total
    }

    /// Force x, y, pressing on the cell of taxel `taxel` at device time
    /// `time`, s, N: probes, and the share of each finger on the cell.
    pub fn force(&self, taxel: usize, time: f64) -> [f64; 3] {
        let mut total = self.probe_force(taxel, time);
        let centre = self.layout.flat_position(taxel);
        for patch in self.patches(time) {
            let part = patch_share(centre, self.layout.pitch, patch.centre, patch.radius);
            for (sum, force) in total.iter_mut().zip(patch.force) {
                *sum += part * force;
            }
        }
        total
    }

    /// Reading of channel `capacitor` of taxel `taxel` if it fails at device time `time`,
    /// s.
    pub fn fault(&self, taxel: usize, capacitor: usize, time: f64) -> Option<FaultReading> {
        let time = self.script_time(time);
        let here = [taxel / self.layout.columns, taxel % self.layout.columns];
        let faults = &self.stimulus.fault;
        let failed = faults.iter().find(|fault| {
            let channel = fault.channel.capacitor;
            fault.channel.taxel == here
                && channel.is_none_or(|name| name as usize == capacitor)
                && (fault.from..fault.to).contains(&time)
        });
        failed.map(|fault| fault.reads)
    }

    /// True if the link is down at device time `time`, s.
    pub(super) fn silent(&self, time: f64) -> bool {
        let time = self.script_time(time);
        let outages = &self.stimulus.outage;
        outages
            .iter()
            .any(|outage| (outage.from..outage.to).contains(&time))
    }
}

/// The points of `path` before and after `time`, and how far between them.
fn around<P: Copy>(path: &[P], time: f64, time_of: impl Fn(&P) -> f64) -> Option<(P, P, f64)> {
    let after = path.iter().position(|point| time_of(point) > time)?;
    let (from, to) = (path[after.checked_sub(1)?], path[after]);
    Some((
        from,
        to,
        (time - time_of(&from)) / (time_of(&to) - time_of(&from)),
    ))
}

fn mix(from: f64, to: f64, share: f64) -> f64 {
    from + (to - from) * share
}

/// Abscissas and weights of the 8-point Gauss-Legendre rule on [-1, 1], the
/// positive half.
const GAUSS: [(f64, f64); 4] = [
    (0.183434642495650, 0.362683783378362),
    (0.525532409916329, 0.313706645877887),
    (0.796666477413627, 0.222381034453374),
    (0.960289856497536, 0.101228536290376),
];

/// Share of a Hertz patch at `centre` with radius `radius` that lies on the
/// cell of size `size` about `cell`.
///
/// The integral across y is exact, the one along x is by Gauss: good to about
/// 1e-3 of the whole where the edge of the patch crosses the cell.
pub(crate) fn patch_share(cell: [f64; 2], size: [f64; 2], centre: [f64; 2], radius: f64) -> f64 {
    let low: [f64; 2] = std::array::from_fn(|i| cell[i] - 0.5 * size[i] - centre[i]);
    let (from, to) = (low[0].max(-radius), (low[0] + size[0]).min(radius));
    if from >= to || low[1] >= radius || low[1] + size[1] <= -radius {
        return 0.0;
    }
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let strip = |x: f64| {
        let chord = (radius * radius - x * x).max(0.0).sqrt();
        half_ellipse(low[1] + size[1], chord) - half_ellipse(low[1], chord)
    };
    let sum: f64 = GAUSS
        .iter()
        .map(|(node, weight)| weight * (strip(middle - half * node) + strip(middle + half * node)))
        .sum();
    half * sum / (2.0 / 3.0 * PI * radius * radius * radius)
}

/// ∫ √(c² − y²) dy from -c to `y`, clamped to the chord.
fn half_ellipse(y: f64, chord: f64) -> f64 {
    if chord <= 0.0 {
        return 0.0;
    }
    let s = (y / chord).clamp(-1.0, 1.0);
    0.5 * chord * chord * (s * (1.0 - s * s).sqrt() + s.asin() + FRAC_PI_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_is_shared_out_completely() {
        for (x, y, radius) in [
            (0.0, 0.0, 4e-3),
            (0.3e-3, -0.9e-3, 2.5e-3),
            (1e-3, 1e-3, 0.4e-3),
        ] {
            let cells = (-10..=10).flat_map(|i| (-10..=10).map(move |j| (i, j)));
            let total: f64 = cells
                .map(|(i, j)| {
                    let cell = [f64::from(i) * 2e-3, f64::from(j) * 2e-3];
                    patch_share(cell, [2e-3; 2], [x, y], radius)
                })
                .sum();
            // Gauss across the edge of the patch: 1e-3, see `patch_share`.
            assert!((total - 1.0).abs() < 1e-3, "{x} {y} {radius}: {total}");
        }
    }

    #[test]
    fn mistakes_in_a_script_are_shown_at_their_key() {
        let script = |path: &str| {
            let text = format!(
                "schema = 1\nname = \"s\"\nduration = \"2 s\"\n[[probe]]\ntaxel = [0, 0]\npath = [{path}]\n"
            );
            Stimulus::parse("s.toml", &text)
        };
        let point =
            |time: &str| format!("{{ time = \"{time}\", force = [\"0 N\", \"0 N\", \"1 mN\"] }}");
        assert!(script(&[point("0 s"), point("1 s")].join(", ")).is_ok());
        let error = script(&[point("1 s"), point("1 s")].join(", ")).unwrap_err();
        assert_eq!(error.key, "probe.0.path.1.time");
        let error = script(&[point("1 s"), point("3 s")].join(", ")).unwrap_err();
        assert!(error.message.contains("after the end"), "{error}");
        let error = script(&[point("1 s"), point("3 m")].join(", ")).unwrap_err();
        assert!(error.message.contains("a unit of length"), "{error}");
    }
}
