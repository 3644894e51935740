//! Extreme numbers in shipped files: refused with a message, or every number that
//! follows is finite; never a panic, never a long wait.
#![allow(clippy::unwrap_used)]

use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use taxel::acquisition::Stimulus;
use taxel::sensor::Sensor;
use taxel::summary::{Value, summary};

/// Put in the place of each number; its unit stays.
const EXTREMES: [&str; 14] = [
    "1e308", "-1e308", "5e-324", "-5e-324", "1e-15", "1e15", "1e-9", "1e9", "1e-6", "1e6", "1e3",
    "0", "-1", "1e-3",
];
/// A check takes milliseconds; the rest is for a slow and busy machine.
const LONGEST: Duration = Duration::from_secs(20);

/// Byte ranges of the numbers behind the equal signs, comments aside.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap();
        let mut at = code.find('=').map_or(code.len(), |equal| equal + 1);
        while let Some(length) = code[at..].find(|c: char| c.is_ascii_digit()) {
            let mut first = at + length;
            let end = code[first..].find(|c: char| !(c.is_ascii_digit() || ".e".contains(c)));
            at = end.map_or(code.len(), |end| first + end);
            if code[..first].ends_with('-') {
                first -= 1;
            }
            let inside_a_word = code[..first].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if !inside_a_word {
                found.push(start + first..start + at);
            }
        }
        start += line.len();
    }
    found
}

/// Every text with one number of `text` replaced by one extreme.
fn variants(text: &str) -> Vec<String> {
    let replaced = |range: Range<usize>| {
        EXTREMES.map(|extreme| {
            let mut variant = text.to_owned();
            variant.replace_range(range.clone(), extreme);
            variant
        })
    };
    numbers(text).into_iter().flat_map(replaced).collect()
}

/// The replaced line, for messages.
fn changed<'a>(text: &'a str, variant: &'a str) -> &'a str {
    let lines = text.lines().zip(variant.lines());
    lines
        .filter(|(old, new)| old != new)
        .map(|(_, new)| new)
        .next()
        .unwrap_or("")
}

/// What is wrong with the facts of a file, if anything.
fn trouble(name: &str, text: &str, variant: &str) -> Option<String> {
    let start = Instant::now();
    let place = || format!("{name}: {}", changed(text, variant));
    match Sensor::parse(name, variant) {
        Err(error) if error.message.is_empty() => return Some(place()),
        Err(_) => {}
        Ok(sensor) => {
            for fact in summary(&sensor).unwrap() {
                match fact.value {
                    Value::Number { si, scale, .. } if !(si / scale).is_finite() => {
                        return Some(format!("{}: {} = {si}", place(), fact.name));
                    }
                    _ => {}
                }
            }
        }
    }
    (start.elapsed() > LONGEST).then(|| format!("{}: {:?}", place(), start.elapsed()))
}

#[test]
fn extreme_values_are_refused_or_leave_all_facts_finite() {
    let mut wrong = Vec::new();
    for name in Sensor::shipped_names() {
        let text = Sensor::shipped_text(name).unwrap();
        let variants = variants(text);
        assert!(variants.len() > 40, "{name}: {}", variants.len());
        let found: Vec<_> = variants
            .par_iter()
            .filter_map(|variant| trouble(name, text, variant))
            .collect();
        wrong.extend(found);
    }
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn extreme_values_of_scripts_are_read_or_refused() {
    for name in Stimulus::shipped_names() {
        let text = Stimulus::shipped_text(name).unwrap();
        for variant in variants(text) {
            let _ = Stimulus::parse(name, &variant);
        }
        let forces = numbers(text).into_iter();
        for range in forces.filter(|range| text[range.end..].starts_with(" mN")) {
            let mut endless = text.to_owned();
            endless.replace_range(range, "1e308");
            let message = Stimulus::parse(name, &endless).unwrap_err().message;
            assert!(message.contains("at most"), "{name}: {message}");
        }
    }
}

/// A layer so thin that its profile took minutes is refused at once.
#[test]
fn silicone_that_spreads_nothing_is_refused() {
    let text = Sensor::shipped_text("piezo-1.5mm").unwrap();
    for thickness in ["5 um", "1e-9 mm", "100 um"] {
        let thin = text.replacen(
            "thickness = \"1.5 mm\"",
            &format!("thickness = \"{thickness}\""),
            1,
        );
        assert_ne!(thin, text);
        let start = Instant::now();
        let message = Sensor::parse("thin.toml", &thin).unwrap_err().to_string();
        assert!(start.elapsed() < Duration::from_secs(1));
        assert!(
            message.contains("cover.thickness") && message.contains("um"),
            "{message}"
        );
    }
}
