//! `taxel fabricate`: its folder, its summary, its refusals; and, where there is a Python with
//! them, its files as ezdxf, gdstk and trimesh read them.

use std::fs;
use std::process::Command;

use crate::common::{Folder, done, refused, refused_with};
use serde_json::Value;

#[test]
fn programs_of_others_read_the_files_of_every_device() {
    let Some(python) = crate::python::python(&["ezdxf", "gdstk", "trimesh"]) else {
        return;
    };
    let folder = Folder::new("fabricate-read");
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../taxel-fabricate/tests/python/reread.py"
    );
    for name in [
        "in-plane-50um",
        "three-axis-8x8",
        "piezo-1.5mm",
        "liquid-metal-2x4",
    ] {
        for options in [&[][..], &["--marks", "--mirror"]] {
            let target = folder.path(&format!("{name}{}", options.len()));
            let arguments = ["fabricate", name, "-o", &target, "--format", "json"];
            let said = folder.path("said.json");
            fs::write(&said, done(&[&arguments[..], options].concat())).unwrap();
            let output = Command::new(&python)
                .args([script, &target, &said])
                .output()
                .unwrap();
            assert!(output.status.success(), "{name}: {output:?}");
        }
    }
}

#[test]
fn the_summary_names_files_and_what_is_not_drawn() {
    let folder = Folder::new("fabricate-summary");
    let target = folder.path("made");
    let arguments = ["fabricate", "in-plane-50um", "-o", &target];
    let text = done(&arguments);
    for word in [
        "electrodes",
        "mould-tray.stl",
        "so not drawn",
        "- leads from the electrodes",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let layers = fs::read_to_string(format!("{target}/layers.csv")).unwrap();
    assert_eq!(layers.lines().count(), 5, "{layers}");
    // The deviation of the gap stands beside it, and the files carry the sensor file's hash.
    let drawing = fs::read_to_string(format!("{target}/drawing.svg")).unwrap();
    assert!(drawing.contains("D 50 µm, σ 1 µm"), "{drawing}");
    let dxf = fs::read_to_string(format!("{target}/masks.dxf")).unwrap();
    assert!(dxf.contains("sensor file sha256"));

    let message = refused(&arguments);
    assert!(message.contains("--force"), "{message}");
    let summary = |more: &[&str]| -> Value {
        let json = done(&[&arguments[..], &["--force", "--format", "json"], more].concat());
        serde_json::from_str(&json).unwrap()
    };
    let number = |json: &Value, row: usize, key: &str| json["rows"][row][key].as_f64().unwrap();
    let json = summary(&[]);
    let area = number(&json, 0, "area_m2");
    assert!((area - 20e-6).abs() < 1e-14, "{area}");
    assert!(json["not_in_the_sensor_file"].as_array().unwrap().len() >= 3);
    // What is printed is what the files have: 35 mm² without the electrodes, and a larger mould.
    let made = summary(&["--polarity", "inverted", "--shrink", "1.5 %"]);
    let area = number(&made, 0, "area_m2");
    assert!((area - 15e-6).abs() < 1e-14, "{area}");
    let larger = number(&made, 2, "volume_m3") / number(&json, 2, "volume_m3");
    assert!((larger * 0.985_f64.powi(3) - 1.0).abs() < 1e-12, "{larger}");
}

#[test]
fn wrong_options_and_devices_write_nothing() {
    let folder = Folder::new("fabricate-wrong");
    let target = folder.path("made");
    for (more, words) in [
        (&["--shrink", "1.5"][..], ["--shrink", "1.5 %"]),
        (&["--shrink", "80 %"], ["--shrink", "20 %"]),
        (&["--grid", "1 kPa"], ["--grid", "length"]),
        (&["--grid", "10 mm"], ["--grid", "100 um"]),
        (&["--grid", "30 um"], ["electrodes", "finer grid"]),
        (&["--grid", "1e-3 nm"], ["GDSII", "coarser grid"]),
    ] {
        let arguments = [&["fabricate", "in-plane-50um", "-o", &target][..], more].concat();
        refused_with(&arguments, &words);
        assert!(!fs::exists(&target).unwrap());
    }
    refused_with(
        &["fabricate", "force-4x4", "-o", &target],
        &["measured_force", "nothing can be made"],
    );
    assert!(!fs::exists(&target).unwrap());
}
