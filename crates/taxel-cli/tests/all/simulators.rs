//! `taxel export`: bodies for MuJoCo and places for any engine; and, where there is a Python with
//! it, MuJoCo itself.

use std::process::Command;

use crate::common::{Folder, done, refused};
use serde_json::Value;

#[test]
fn every_sensor_has_bodies_and_poses() {
    for (name, taxels) in [
        ("in-plane-50um", 1),
        ("three-axis-8x8", 64),
        ("piezo-1.5mm", 8),
        ("liquid-metal-2x4", 8),
        ("force-4x4", 16),
    ] {
        let model = done(&["export", name, "--to", "mjcf"]);
        assert_eq!(
            model.matches("<body name=\"taxel_").count(),
            taxels + 1,
            "{name}"
        );
        assert_eq!(model.matches("<force ").count(), taxels, "{name}");
        assert!(model.contains("sensor file sha256"));
        let json: Value = serde_json::from_str(&done(&["export", name, "--to", "json"])).unwrap();
        let poses = json["poses"].as_array().unwrap();
        assert_eq!(poses.len(), taxels);
        assert!(poses.iter().all(|pose| pose.as_array().unwrap().len() == 7));
        assert!(json["frame_period_s"].as_f64().unwrap() > 0.0);
    }
    refused(&[
        "export",
        "three-axis-8x8",
        "--to",
        "mjcf",
        "--friction",
        "-1",
    ]);
    refused(&["export", "three-axis-8x8", "--to", "urdf"]);
}

#[test]
fn a_ball_at_rest_in_mujoco_weighs_what_the_taxels_read() {
    let Some(python) = crate::python::python(&["mujoco", "numpy"]) else {
        return;
    };
    let folder = Folder::new("mujoco");
    let model = folder.path("taxels.xml");
    done(&["export", "three-axis-8x8", "--to", "mjcf", "-o", &model]);
    let example = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/mujoco_touch.py"
    );
    let output = Command::new(python)
        .args([example, &model])
        .output()
        .unwrap();
    // The example itself ends with 1 beyond 0.1 %.
    assert!(output.status.success(), "{output:?}");
}
