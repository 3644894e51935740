//! Mistakes in a study file: each one message at the word.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;

use taxel_study::run::Runner;
use taxel_study::study::Status;
use taxel_study::sweep::{designs, reasons};

use common::{read, study_of};

const GAP: &str = "element.in_plane_capacitor.electrodes.gap";

/// The shipped study of P1 with one text replaced, and what its message marks and says.
#[track_caller]
fn wrong(from: &str, to: &str, marked: &str, says: &str) {
    wrong_of("p1-resolution", from, to, marked, says);
}

/// As [`wrong`], of any shipped study.
#[track_caller]
fn wrong_of(study: &str, from: &str, to: &str, marked: &str, says: &str) {
    let text = taxel_study::shipped_text(study).unwrap();
    assert!(text.contains(from), "{from}");
    let error = read(&text.replacen(from, to, 1)).map(|_| ()).unwrap_err();
    let place = error
        .place
        .clone()
        .unwrap_or_else(|| panic!("no place: {error}"));
    let word: String = place
        .text
        .chars()
        .skip(place.column - 1)
        .take(place.width)
        .collect();
    assert_eq!(word, marked, "{error}");
    assert!(error.to_string().contains(says), "{error}");
}

#[test]
fn every_mistake_of_what_is_varied_is_marked_under_the_word() {
    wrong(
        &format!("\"{GAP}\""),
        "\"element.in_plane_capacitor.electrode.gap\"",
        "\"element.in_plane_capacitor.electrode.gap\"",
        GAP,
    );
    wrong(
        &format!("\"{GAP}\""),
        "\"element.in_plane_capacitor.electrodes.gapp\"",
        "\"element.in_plane_capacitor.electrodes.gapp\"",
        "unknown field",
    );
    wrong(
        "[\"20 um\", \"100 um\"]",
        "[\"20 kPa\", \"100 kPa\"]",
        "[\"20 kPa\", \"100 kPa\"]",
        "a length is needed here",
    );
    wrong(
        "[\"20 um\", \"100 um\"]",
        "[\"20 um\", \"100 kPa\"]",
        "[\"20 um\", \"100 kPa\"]",
        "a length and a stress",
    );
    wrong(
        "[\"20 um\", \"100 um\"]",
        "[\"100 um\", \"20 um\"]",
        "[\"100 um\", \"20 um\"]",
        "the range is empty",
    );
    wrong(
        "thickness - 200 um",
        "thickness - 200 kPa",
        "200 kPa",
        "this is a stress; a length is needed here",
    );
    wrong(
        "thickness - 200 um",
        "thickness / (200 um)",
        "thickness / (200 um)",
        "the key takes a length",
    );
    wrong(
        "0.02 * gap",
        "0.02 * gab",
        "gab",
        "names here: gap, thickness",
    );
    wrong(
        "\"0.02 * gap\"",
        "\"0.02 * element.in_plane_capacitor.fabrication.gap_deviation\"",
        "\"0.02 * element.in_plane_capacitor.fabrication.gap_deviation\"",
        "in a circle",
    );
}

#[test]
fn every_mistake_of_what_is_asked_is_marked_under_the_word() {
    wrong(
        "range >= 100 N",
        "range >= 100 mm",
        "100 mm",
        "a force is compared with it",
    );
    wrong(
        "minimise = [\"resolution\"]",
        "minimise = [\"electrodes\"]\n[answers.electrodes]\nof = \"check\"\nquantity = \"electrodes_and_capacitance\"",
        "electrodes",
        "is a word",
    );
    wrong(
        "quantity = \"deviation\"",
        "quantity = \"deviations\"",
        "\"deviations\"",
        "use one of: deviation",
    );
    wrong(
        "quantity = \"force_z\"",
        "quantity = \"force\"",
        "\"force\"",
        "its columns are",
    );
    wrong(
        "quantity = \"rest_capacitance\"",
        "quantity = \"rest\"",
        "\"rest\"",
        "it prints",
    );
    wrong(
        "load = \"fz=5 N\"",
        "load = \"fz=5 um\"",
        "\"fz=5 um\"",
        "a force is needed here",
    );
    wrong(
        "noise = \"0.1 fF\"",
        "noise = \"0 fF\"",
        "\"0 fF\"",
        "not above zero",
    );
    wrong(
        "plan = \"grid\"",
        "plan = \"grit\"",
        "\"grit\"",
        "latin_hypercube",
    );
    wrong(
        "evaluations = 1200",
        "evaluations = 1",
        "1",
        "between 10 and",
    );
    wrong(
        "\"4 pF\"",
        "\"4 um\"",
        "\"4 um\"",
        "a capacitance is needed here",
    );
    wrong("scale = \"log\"", "scale = \"cubic\"", "\"cubic\"", "log");
    wrong(
        "scale = \"log\"",
        "each = \"taxel\"",
        "\"taxel\"",
        "no range or values",
    );
    wrong(
        "range = [\"20 um\", \"100 um\"]\nscale = \"log\"",
        "spread = { normal = \"1 um\" }\neach = \"taxel\"",
        "\"taxel\"",
        "one value for all taxels",
    );
}

#[test]
fn mistakes_of_spreads_and_limits_are_marked_under_the_word() {
    let mark = |from: &str, to: &str, marked: &str, says: &str| {
        wrong_of("p2-tolerance", from, to, marked, says);
    };
    let air = "\"element.three_axis_capacitor.plates.air_gap\"";
    let misspelt = air.replace("air_gap", "airgap");
    mark(air, &misspelt, &misspelt, "has no number at");
    mark(air, &misspelt, &misspelt, &air[1..air.len() - 1]);
    let stiffness = "\"element.three_axis_capacitor.suspension.stiffness[2]\"";
    let beyond = stiffness.replace("[2]", "[3]");
    mark(stiffness, &beyond, &beyond, "has 3 values");
    mark(stiffness, &beyond, &beyond, "give [0] to [2]");
    mark(
        "\"7 %\"",
        "\"7 kPa\"",
        "\"7 kPa\"",
        "a length or a percentage",
    );
    mark("\"7 %\"", "\"-7 %\"", "\"-7 %\"", "not above zero");
    mark("\"3 %\"", "\"3 um\"", "\"3 um\"", "or a percentage");
    let at_most = "at_most = \"3 %\"";
    mark("within = \"3 %\"", at_most, "\"3 %\"", "belongs to within");
    mark("within = \"3 %\"", "", "sensitivity_z", "no limit");
}

#[test]
fn mistakes_of_conditions_are_told() {
    let with = |variable: &str, pressure: &str, sweep: &str| {
        let text = format!(
            "schema = 2\nname = \"s\"\nsensor = \"liquid-metal-2x4\"\n\
             [variables.load]\n{variable}\n\
             [answers.change]\nof = \"channel_section\"\nquantity = \"change\"\n\
             pressure = {pressure}\nthickness = \"500 um\"\n[sweep]\n{sweep}\n"
        );
        read(&text).map(|_| ()).map_err(|error| error.to_string())
    };
    let values = "values = [\"25 kPa\", \"50 kPa\"]";
    assert_eq!(
        with(values, "\"load\"", "columns = [\"load\", \"change\"]"),
        Ok(())
    );
    for (variable, pressure, sweep, says) in [
        (values, "\"25 kPa\"", "", "no answer names it"),
        (
            "values = [\"25 um\"]",
            "\"load\"",
            "",
            "load is not a stress",
        ),
        (
            "values = [\"0 kPa\"]",
            "\"load\"",
            "",
            "not above zero everywhere",
        ),
        (
            "spread = { normal = \"1 kPa\" }",
            "\"load\"",
            "",
            "has a range or values",
        ),
        (
            "values = [\"25 kPa\"]\nspread = { normal = \"1 kPa\" }",
            "\"load\"",
            "",
            "does not spread",
        ),
        (
            "key = \"element.microchannel.base\"\nvalues = [\"90 um\"]",
            "\"load\"",
            "",
            "has a key of its own",
        ),
        (values, "\"lode\"", "", "or name a variable without a key"),
        (
            values,
            "\"load\"",
            "columns = [\"changes\"]",
            "no column \"changes\"",
        ),
    ] {
        let error = with(variable, pressure, sweep).unwrap_err();
        assert!(
            error.contains(says),
            "{variable} {pressure} {sweep}: {error}"
        );
    }
}

#[test]
fn designs_that_fail_are_rows_with_their_reasons() {
    // Without the link a small gap is refused: its deviation is still that of 50 um.
    let text = taxel_study::shipped_text("p1-resolution").unwrap();
    let link = "\"element.in_plane_capacitor.fabrication.gap_deviation\" = \"0.02 * gap\"\n";
    assert!(text.contains(link));
    let study = study_of(&text.replace(link, ""));
    let points = designs(&study, None).unwrap();
    let rows: Vec<_> = Runner::new(&study)
        .rows(&points)
        .unwrap()
        .into_iter()
        .flatten()
        .collect();
    assert_eq!(rows.len(), points.len());
    let refused = rows
        .iter()
        .filter(|row| row.status == Status::Refused)
        .count();
    assert!(
        refused > rows.len() / 5 && refused < rows.len(),
        "{refused} of {}",
        rows.len()
    );
    let commonest = &reasons(&rows)[0];
    assert_eq!(commonest.0, refused);
    assert!(commonest.1.contains("gap_deviation"), "{}", commonest.1);
    let done = rows.iter().find(|row| row.status == Status::Done).unwrap();
    // Which way answered is a word.
    let mut asked = study
        .answers
        .iter()
        .zip(&done.answers)
        .filter(|(one, _)| !one.word);
    assert!(asked.all(|(_, found)| found.number().is_some()));
}

#[test]
fn a_written_design_repeats_its_numbers() {
    let study = study_of(taxel_study::shipped_text("p1-resolution").unwrap());
    let point = [33.3e-6, 611.1e-6];
    let (text, written) = study.text_of(&point);
    // Comments survive.
    assert!(text.contains("# choice: the probe covers the whole width"));
    assert!(
        text.contains("height = \"411.1 um\"") && text.contains("gap_deviation = \"0.666 um\""),
        "{text}"
    );
    let again = study.read(&text).unwrap();
    assert_eq!(again.in_plane().unwrap().model().electrodes.gap, written[0]);
}

#[test]
fn mutated_studies_never_panic() {
    let text = taxel_study::shipped_text("p1-resolution").unwrap();
    let mut state = 1u64;
    let mut next = |below: usize| {
        // A linear congruential generator (Knuth): any bytes do.
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let words = [
        "\"", "[", "]", "=", "1e308", "-1", "nan", "um", "kPa", "\n", "(", "gap", "0", "\u{b5}",
    ];
    let mut read_well = 0;
    for _ in 0..300 {
        let mut mutated: Vec<char> = text.chars().collect();
        for _ in 0..=next(2) {
            let at = next(mutated.len());
            let end = (at + next(4)).min(mutated.len());
            mutated.splice(at..end, words[next(words.len())].chars());
        }
        let mutated: String = mutated.into_iter().collect();
        if let Ok(head) = taxel_study::study::header("study.toml", &mutated)
            && head.sensor == "in-plane-50um"
            && let Ok(study) = read(&mutated)
        {
            let row = study.evaluate(&study.nominal());
            assert_eq!(row.answers.len(), study.answers.len());
            read_well += 1;
        }
    }
    // Many mutations fall into comments.
    assert!(read_well > 20, "{read_well}");
}

#[test]
fn several_mistakes_are_found_in_one_run_and_say_what_may_be_meant() {
    let text = taxel_study::shipped_text("p1-resolution").unwrap();
    let swapped = |changes: &[(&str, &str)]| {
        let mut text = text.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        read(&text).map(|_| ()).unwrap_err().to_string()
    };
    let told = |message: &str, parts: &[&str]| {
        for part in parts {
            assert!(message.contains(part), "{part}: {message}");
        }
    };
    // Keys, and values that no key takes.
    let message = swapped(&[
        ("[variables.gap]\nkey", "[variables.gap]\nkee"),
        ("seed = 1", "seed = \"one\""),
        ("evaluations", "evaluation"),
    ]);
    told(
        &message,
        &[
            "did you mean \"key\"?",
            "a whole number of 0 or more is needed here",
            "did you mean \"evaluations\"?",
        ],
    );
    assert_eq!(message.matches("also: ").count(), 2, "{message}");
    // What is asked.
    let message = swapped(&[
        ("quantity = \"deviation\"", "quantity = \"devation\""),
        (
            "quantity = \"rest_capacitance\"",
            "quantity = \"rest_capacitence\"",
        ),
    ]);
    told(
        &message,
        &[
            "did you mean \"deviation\"?",
            "did you mean \"rest_capacitance\"?",
        ],
    );
    assert_eq!(message.matches("also: ").count(), 1, "{message}");
    told(
        &swapped(&[("thickness - 200 um", "thicknes - 200 um")]),
        &["did you mean \"thickness\"?"],
    );
}
