//! Loads on parts of a channel: the closed form beside solutions of the sheet in space
//! (lengths um, stresses kPa).
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use taxel::mechanics::{
    AlongChannel, CellGeometry, ClosingCurve, MicrochannelSection, PressureLaw, SolvedCell, Stretch,
};
use taxel::sensor::Sensor;
use taxel::summary::{Value, summary};
use taxel_bodies::Afresh;
use taxel_bodies::mechanics::microchannel_block::{BlockLoad, BlockStudy, Sides};
use taxel_bodies::mechanics::microchannel_cell::{Filling, WallContact};
use taxel_fem::mesh::{CrossingVoids, Footprint, FootprintShape, VoidBlock};

use crate::common::p4_law;
use crate::microchannel_block::{RUBBER, p4_voids};
use taxel_numerics::MonotoneCurve;

/// A sheet with crossing channels that goes on at all sides as its mirror image, and the closing
/// curve of its upper channels.
struct Sheet {
    voids: CrossingVoids,
    /// Lower channels in its length.
    crossings: usize,
    curve: ClosingCurve,
}

/// Two strips across the sheet: their length along the upper channels, the distance between
/// them, and their pressures.
struct Strips {
    length: f64,
    apart: f64,
    pressures: [f64; 2],
}

impl Sheet {
    fn new(voids: CrossingVoids, crossings: usize) -> Self {
        let um = 1e-6;
        let cell = CellGeometry {
            section: MicrochannelSection::rectangle(um * voids.width, um * voids.upper),
            roof: um * voids.cover,
            thickness: um * thickness(&voids),
            pitch: um * voids.pitch,
        };
        let cell = SolvedCell::of_cell(&cell, "sheet", &mut Afresh).unwrap();
        let curve = cell.curve(1e3 * RUBBER.law().shear_modulus()).unwrap();
        Self {
            voids,
            crossings,
            curve,
        }
    }

    fn length(&self) -> f64 {
        self.crossings as f64 * self.voids.pitch
    }

    /// The closing curve of the lower channels.
    fn lower(&self) -> ClosingCurve {
        let (voids, um) = (&self.voids, 1e-6);
        let cell = CellGeometry {
            section: MicrochannelSection::rectangle(um * voids.width, um * voids.lower),
            roof: um * (voids.cover + voids.upper + voids.between),
            thickness: um * thickness(voids),
            pitch: um * voids.pitch,
        };
        let cell = SolvedCell::of_cell(&cell, "lower", &mut Afresh).unwrap();
        cell.curve(1e3 * RUBBER.law().shear_modulus()).unwrap()
    }

    /// The closing curve of the upper channels on the path of the whole top pressed, up to a net
    /// pressure in Pa or as far as it is solved: what `taxel tabulate` keeps.
    fn path(&self, filling: &Filling, most: f64) -> Option<ClosingCurve> {
        let [upper, _] = self.paths(filling, most)?;
        Some(upper)
    }

    /// The same of both layers.
    fn paths(&self, filling: &Filling, most: f64) -> Option<[ClosingCurve; 2]> {
        let pitch = self.voids.pitch;
        let whole = Footprint {
            centre: [0.0; 2],
            size: [pitch; 2],
            shape: FootprintShape::Rectangle,
        };
        let block = VoidBlock {
            voids: self.voids,
            counts: [1; 2],
            size: [pitch; 2],
            footprints: vec![whole],
        };
        let mut study = posed(block, &[BlockLoad::Pressure], filling);
        let mut layers = [(); 2].map(|()| vec![[0.0, 1.0, 1.0, 1.0]]);
        while layers[0].last()?[0] < most {
            let before = study.state().ok()?.drives[0];
            let step = 1e-3 * most / 4.0;
            let Ok(state) = study.drive(&[before + step]) else {
                break;
            };
            for (layer, states) in layers.iter_mut().enumerate() {
                let void = state.voids[layer][0];
                states.push([
                    1e3 * (state.drives[0] - void.inside),
                    void.volume_ratio,
                    1.0 / void.resistance_ratio,
                    void.thinnest,
                ]);
            }
        }
        let [upper, lower] = layers.map(|states| {
            let curve = |column: usize| {
                let points = states.iter().map(|state| [state[0], state[column]]);
                MonotoneCurve::new(points.collect(), None).ok()
            };
            let along = AlongChannel {
                conductance: curve(2)?,
                thinnest: curve(3)?,
            };
            Some(ClosingCurve::of_path(curve(1)?, None, along))
        });
        Some([upper?, lower?])
    }

    /// Change of the resistance of an upper channel, solved.
    fn solved(&self, strips: &Strips, filling: &Filling) -> Option<f64> {
        let (footprints, pressures): (Vec<_>, Vec<_>) = [-0.5, 0.5]
            .into_iter()
            .zip(strips.pressures)
            .filter(|(_, pressure)| *pressure > 0.0)
            .map(|(side, pressure)| {
                let footprint = Footprint {
                    centre: [side * (strips.length + strips.apart), 0.0],
                    size: [strips.length, self.voids.pitch],
                    shape: FootprintShape::Rectangle,
                };
                (footprint, pressure)
            })
            .unzip();
        let loads = vec![BlockLoad::Pressure; pressures.len()];
        let block = VoidBlock {
            voids: self.voids,
            counts: [1, self.crossings],
            size: [self.length(), self.voids.pitch],
            footprints,
        };
        let state = posed(block, &loads, filling).drive(&pressures).ok()?;
        Some(state.voids[0][0].resistance_ratio - 1.0)
    }

    /// The same by a closing curve: parts with one liquid.
    fn by_parts(&self, curve: &ClosingCurve, strips: &Strips, law: &PressureLaw) -> f64 {
        let share = strips.length / self.length();
        let part = |share, pressure: f64| Stretch {
            share,
            pressure: 1e3 * pressure,
        };
        let [first, second] = strips.pressures;
        let parts = [
            part(share, first),
            part(share, second),
            part(1.0 - 2.0 * share, 0.0),
        ];
        let settled = curve.settle(law, &parts).unwrap();
        let resistances = parts
            .iter()
            .zip(&settled.sections)
            .map(|(part, section)| part.share / section.conductance);
        resistances.sum::<f64>() - 1.0
    }
}

fn posed(block: VoidBlock, loads: &[BlockLoad], filling: &Filling) -> BlockStudy {
    let contact = WallContact::default();
    let fillings = [filling; 2];
    BlockStudy::new(block, Sides::Mirrored, loads, RUBBER, fillings, contact).unwrap()
}

fn thickness(voids: &CrossingVoids) -> f64 {
    voids.base + voids.lower + voids.between + voids.upper + voids.cover
}

fn laws() -> [(&'static str, Filling, PressureLaw); 2] {
    let gas = p4_law().expansion * p4_law().atmosphere * 1e-3;
    [
        ("vented", Filling::Vented, PressureLaw::Vented),
        ("Eq. 2", Filling::Gas(gas), PressureLaw::Paper(p4_law())),
    ]
}

/// Prints the table of "Two loads at once" in `docs/theory/microchannel.md`: errors of the change
/// of resistance by the plane-strain cell and by the path of the whole top pressed.
#[test]
#[ignore = "minutes: cargo test --release -p taxel-bodies --test all loaded_parts -- --ignored --nocapture"]
fn table_of_two_loads_on_the_published_sheet() {
    for smallest in [150.0, 70.0] {
        let sheet = Sheet::new(p4_voids(smallest), 8);
        for (name, filling, law) in laws() {
            let path = sheet.path(&filling, 3e3).unwrap();
            // The finer cells for the shortest parts alone.
            let lengths: &[f64] = if smallest < 100.0 {
                &[300.0]
            } else {
                &[300.0, 600.0, 1200.0]
            };
            for &length in lengths {
                for (apart, pressures) in
                    [(600.0, [0.0, 3.0]), (600.0, [1.0, 3.0]), (0.0, [1.0, 3.0])]
                {
                    let strips = Strips {
                        length,
                        apart,
                        pressures,
                    };
                    let solved = sheet.solved(&strips, &filling).unwrap();
                    let errors = [&sheet.curve, &path]
                        .map(|curve| 100.0 * (sheet.by_parts(curve, &strips, &law) / solved - 1.0));
                    println!(
                        "cells of {smallest}, {name}, {length} long, {apart} apart, {pressures:?} kPa: {errors:+.0?} % of \
                         {solved:.4}"
                    );
                }
            }
        }
    }
}

/// A sheet whose lengths are factors of those of P4.
fn random_voids(random: &mut ChaCha8Rng) -> CrossingVoids {
    let mut within = |least: f64, most: f64| least * (most / least).powf(random.random::<f64>());
    let width = 400.0;
    CrossingVoids {
        width,
        pitch: width * within(1.3, 2.0),
        base: width * within(0.15, 0.5),
        lower: width * within(0.04, 0.12),
        between: width * within(0.25, 0.6),
        upper: width * within(0.04, 0.12),
        cover: width * within(0.25, 0.6),
        ..p4_voids(150.0)
    }
}

/// Errors of the change of resistance, as shares: of two loads by the plane-strain cell and by the
/// path of the whole top pressed.
fn compare(seed: u64, count: usize) -> Vec<[f64; 2]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut errors = Vec::new();
    for number in 0..count {
        let sheet = Sheet::new(random_voids(&mut random), 6);
        let thick = thickness(&sheet.voids);
        let mut within = |least: f64, most: f64| least + (most - least) * random.random::<f64>();
        let longest = (0.35 * sheet.length()).min(4.0 * thick);
        let length = within(1.4 * thick, longest);
        let apart = within(0.0, 0.9) * (sheet.length() - 2.0 * length);
        // Up to half of its area by the plane-strain cell.
        let half = (1..100)
            .map(|step| f64::from(step) / 100.0 * sheet.curve.end()[0])
            .take_while(|net| sheet.curve.at(*net).area_ratio > 0.5);
        let greater = 1e-3 * half.last().unwrap() * within(0.05, 1.0);
        let pressures = [greater * within(0.1, 1.0), greater];
        let strips = Strips {
            length,
            apart,
            pressures,
        };
        for (name, filling, law) in laws() {
            let Some(solved) = sheet.solved(&strips, &filling) else {
                println!("{number} {name}: not solved");
                continue;
            };
            let Some(path) = sheet.path(&filling, 1e3 * greater) else {
                println!("{number} {name}: no path");
                continue;
            };
            let by = [&sheet.curve, &path].map(|curve| {
                let form = sheet.by_parts(curve, &strips, &law);
                form / solved - 1.0
            });
            println!(
                "{number} {name}: {by:+.3?} of {solved:.4}; length {:.2}, apart {:.2} thicknesses; path to {:.3}",
                length / thick,
                apart / thick,
                path.end()[1]
            );
            errors.push(by);
        }
    }
    errors
}

/// What `taxel check` states of plane-strain cells, and of a table of the path
/// (`path_table::a_table_states_the_error_of_loaded_parts`).
fn stated() -> [f64; 2] {
    let facts = summary(&Sensor::shipped("liquid-metal-2x4").unwrap()).unwrap();
    let fact = facts
        .iter()
        .find(|fact| fact.name == "column_loaded_part_error");
    match fact.unwrap().value {
        Value::Number { si, .. } => [si, 0.6],
        Value::Text(_) => panic!("no number"),
    }
}

fn assert_stated(errors: &[[f64; 2]]) {
    let worst = [0, 1].map(|which| {
        let sizes = errors.iter().map(|by| by[which].abs());
        sizes.fold(0.0, f64::max)
    });
    println!("{} comparisons, error {worst:.3?} at most", errors.len());
    for (worst, stated) in worst.into_iter().zip(stated()) {
        assert!(worst <= stated, "{worst} {stated}");
    }
}

#[test]
fn two_loads_on_random_sheets_are_within_the_stated_error() {
    let errors = compare(1, 2);
    assert_eq!(errors.len(), 4);
    assert_stated(&errors);
}

#[test]
#[ignore = "long: cargo test --release -p taxel-bodies --test all loaded_parts -- --ignored --nocapture hundred"]
fn two_loads_on_a_hundred_random_sheets_are_within_the_stated_error() {
    let errors = compare(2, 100);
    assert!(errors.len() >= 180, "{} of 200 were compared", errors.len());
    assert_stated(&errors);
}

/// Errors of the change of resistance of the upper and the lower channels by plane-strain cells, as
/// shares, with the whole top pressed: beside the path of both layers.
fn compare_whole_tops(seed: u64, count: usize) -> [f64; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut worst = [0.0_f64; 2];
    for number in 0..count {
        let sheet = Sheet::new(random_voids(&mut random), 6);
        let cells = [sheet.curve.clone(), sheet.lower()];
        let half = (1..100)
            .map(|step| f64::from(step) / 100.0 * sheet.curve.end()[0])
            .take_while(|net| sheet.curve.at(*net).area_ratio > 0.5);
        let net = half.last().unwrap() * (0.05 + 0.95 * random.random::<f64>());
        for (worst, (name, filling, law)) in worst.iter_mut().zip(laws()) {
            let Some(paths) = sheet.paths(&filling, net) else {
                println!("{number} {name}: no path");
                continue;
            };
            // A pressure that both paths hold.
            let ends = paths.each_ref().map(|path| path.end()[0]);
            let pressure = net.min(ends[0]).min(ends[1]);
            let change = |curve: &ClosingCurve| {
                let whole = [Stretch {
                    share: 1.0,
                    pressure,
                }];
                1.0 / curve.settle(&law, &whole).unwrap().sections[0].conductance - 1.0
            };
            let by = [0, 1].map(|layer| change(&cells[layer]) / change(&paths[layer]) - 1.0);
            println!(
                "{number} {name}: upper and lower {by:+.3?} of {:.4}; {:?}",
                change(&paths[0]),
                sheet.voids
            );
            *worst = by.iter().fold(*worst, |most, by| most.max(by.abs()));
        }
    }
    println!("error {worst:.3?} at most");
    worst
}

/// What `taxel check` states of plane-strain cells with the whole top pressed, with a liquid that can
/// leave and with that of P4.
fn assert_whole_tops(worst: [f64; 2]) {
    let shipped = Sensor::shipped_text("liquid-metal-2x4").unwrap();
    let paper = "[element.microchannel.liquid.pressure.paper]\nexpansion = 0.2\natmosphere = \"101.325 kPa\"";
    let vented = shipped.replace(paper, "pressure = \"vented\"");
    assert!(vented != shipped);
    for (worst, text) in worst.into_iter().zip([vented.as_str(), shipped]) {
        let sensor = Sensor::parse("sheet.toml", text).unwrap();
        let facts = summary(&sensor).unwrap();
        let stated = facts.iter().find_map(|fact| match fact.value {
            Value::Number { si, .. } if fact.name == "column_whole_top_error" => Some(si),
            _ => None,
        });
        assert!(worst <= stated.unwrap(), "{worst} {stated:?}");
    }
}

#[test]
fn the_whole_top_of_a_random_sheet_is_within_the_stated_error() {
    assert_whole_tops(compare_whole_tops(4, 1));
}

#[test]
#[ignore = "long: cargo test --release -p taxel-bodies --test all loaded_parts -- --ignored --nocapture whole_tops"]
fn whole_tops_of_random_sheets_are_within_the_stated_error() {
    assert_whole_tops(compare_whole_tops(3, 60));
}
