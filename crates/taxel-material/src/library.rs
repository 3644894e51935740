//! Laws by the name of a product, each with its source.

use crate::law::Law;
use crate::material::{Material, Tested};

const OF_ONE_LAW: &str =
    "the interval is of this law alone: the choice among laws that fit as well is not in it";
const MARECHAL: &str = "fit to Marechal et al. 2020, doi 10.1089/soro.2019.0115: ASTM D412 pull, \
     450 mm/min, strain from the crosshead; one curve";
const TOOLKIT: &str =
    "as published: softroboticstoolkit.com, PneuNets modeling; no range given there";
const JOHNSTON: &str = "Johnston et al. 2014: E/3 of 1.32 to 2.97 MPa by curing at 25 to 200 C; mix, \
     cure and method move it (Varner and Cohen 2024)";

type Row = (&'static str, &'static str, [f64; 2], [f64; 2], &'static str);

/// Products whose interval is the union over all laws that fit as well, as `taxel material fit --strain-range 0..1`
/// prints it (`tests/public.rs`); the intervals of the others from that database are of their law alone.
const OF_ALL_LAWS: [&str; 3] = ["ecoflex-00-30", "dragon-skin-30", "rtv615"];

/// Name, law, interval in kPa, stretches, source.
const ENTRIES: &[Row] = &[
    (
        "ecoflex-00-10",
        "neo_hookean 8.596 kPa",
        [8.276, 8.916],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "ecoflex-00-30",
        "neo_hookean 17.117 kPa",
        [16.34, 18.15],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "ecoflex-00-35-fast",
        "neo_hookean 31.224 kPa",
        [30.42, 32.02],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "ecoflex-00-50",
        "neo_hookean 23.591 kPa",
        [22.9, 24.28],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "dragon-skin-fx-pro",
        "neo_hookean 34.546 kPa",
        [32.25, 36.84],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "dragon-skin-10-medium",
        "gent 48.861 kPa 6.2965",
        [47.29, 50.45],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "dragon-skin-20",
        "gent 131.81 kPa 5.5154",
        [107.0, 158.3],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "dragon-skin-30",
        "gent 191.33 kPa 6.9465",
        [179.1, 203.8],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "platsil-gel-10",
        "gent 60.005 kPa 5.6345",
        [56.51, 63.58],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "mold-star-16-fast",
        "gent 88.925 kPa 10.689",
        [87.34, 90.52],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "mold-star-20t",
        "gent 116.07 kPa 11.665",
        [114.3, 117.8],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "psycho-paint",
        "gent 126.09 kPa 14.11",
        [124.2, 127.9],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "rebound-25",
        "gent 104.47 kPa 8.111",
        [102.9, 106.0],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "sorta-clear-40",
        "gent 287.33 kPa 17.417",
        [283.3, 291.3],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "rtv615",
        "gent 345.03 kPa 7.6579",
        [342.9, 350.5],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "body-double-silk",
        "gent 121.55 kPa 9.1416",
        [95.5, 149.8],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "soloplast-150318",
        "gent 72.086 kPa 12.371",
        [70.98, 73.2],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "wagnersil-20-nf",
        "yeoh 54.317 10.447 -0.38453 kPa",
        [102.1, 115.2],
        [1.0, 2.0],
        MARECHAL,
    ),
    (
        "elastosil-m4601",
        "yeoh 110 20 0 kPa",
        [f64::NAN; 2],
        [f64::NAN; 2],
        TOOLKIT,
    ),
    (
        "sylgard-184",
        "neo_hookean 633 kPa",
        [440.0, 990.0],
        [1.0, 1.4],
        JOHNSTON,
    ),
];

const ECOFLEX: &str = "this fit 17.1 kPa; presets of Sorotoki 34 and 15.2 kPa; compression of phantoms \
     (Dawood) E/3 = 32.4 kPa: ecoflex-00-30 is not a material but a product; test your own pour";

/// The whole library.
pub fn all() -> impl Iterator<Item = Material> {
    // A test reads every law of the library.
    let read = |row: &Row| Law::parse(row.1).ok().map(|law| material(row, law));
    ENTRIES.iter().filter_map(read)
}

fn material(&(name, _, interval, stretch, source): &Row, law: Law) -> Material {
    Material {
        name: name.to_owned(),
        law,
        interval: interval[0]
            .is_finite()
            .then(|| interval.map(|kpa| kpa * 1e3)),
        basis: String::new(),
        stretch: stretch[0].is_finite().then_some(stretch),
        modes: vec![Tested::Uniaxial],
        source: source.to_owned(),
        note: match name {
            "ecoflex-00-30" => ECOFLEX,
            _ if source == MARECHAL && !OF_ALL_LAWS.contains(&name) => OF_ONE_LAW,
            _ => "",
        }
        .to_owned(),
        relaxation: Vec::new(),
        tests: Vec::new(),
    }
}

/// The material of a name; case, spaces and underscores do not matter.
pub fn named(name: &str) -> Option<Material> {
    let plain = plain(name);
    all().find(|entry| entry.name == plain)
}

fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace([' ', '_'], "-")
}

/// Names that share a word with `name`; all where none does.
pub fn near(name: &str) -> Vec<&'static str> {
    let plain = plain(name);
    let words: Vec<&str> = plain.split('-').filter(|word| word.len() > 2).collect();
    let shares = |name: &&str| words.iter().any(|word| name.contains(word));
    let names = || ENTRIES.iter().map(|(name, ..)| *name);
    let found: Vec<_> = names().filter(shares).collect();
    if found.is_empty() {
        names().collect()
    } else {
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::first_loss;

    #[test]
    fn every_law_is_stable_where_it_was_tested_and_within_its_interval() {
        let entries: Vec<_> = all().collect();
        assert_eq!(entries.len(), ENTRIES.len());
        for entry in entries {
            let largest = entry.stretch.map_or(1.5, |stretch| stretch[1]);
            assert_eq!(first_loss(&entry.law, 0.5, largest), None, "{}", entry.name);
            if let Some([low, high]) = entry.interval {
                let shear = entry.law.shear_modulus();
                assert!(low < shear && shear < high, "{}", entry.name);
            }
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_near_ones() {
        assert!(named("Ecoflex 00_30").is_some());
        assert!(named("ecoflex-00-31").is_none());
        assert_eq!(near("ecoflex-31").len(), 4);
        assert_eq!(near("xyz").len(), ENTRIES.len());
    }
}
