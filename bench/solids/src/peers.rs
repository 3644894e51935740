//! Other programs and ours in turn, each run in a process of its own.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Problems that run without a list.
const USUAL: [&str; 14] = [
    "dolfinx:A:1",
    "ngsolve:A:1:sparsecholesky",
    "felupe:A:1",
    "ccx:A:1",
    "dolfinx:A:3",
    "ngsolve:A:3:sparsecholesky",
    "felupe:A:3",
    "ccx:A:3",
    "dolfinx:B:8",
    "ngsolve:B:8:sparsecholesky",
    "dolfinx:B:12",
    "ngsolve:B:12:sparsecholesky",
    "felupe:B:12",
    "ccx:B:12",
];
/// Turns without a number.
const ROUNDS: usize = 3;

/// Area ratio of the void at 5 kPa that all agree on, and how near we have to be.
const AREA_RATIO: (f64, f64) = (0.66440, 0.001);
/// Force on the block, mN, and how near.
const REACTION: (f64, f64) = (-210.9, 2.109);

/// Every size of both problems, in equal steps and in our own.
pub(crate) fn all() -> Result<(), Box<dyn Error>> {
    for (case, size) in [("A", 1), ("A", 3), ("A", 6), ("B", 8), ("B", 12), ("B", 20)] {
        for extra in [None, Some("own")] {
            println!("{}", ours(case, &size.to_string(), extra, "10")?);
        }
    }
    Ok(())
}

/// Runs the programs of a folder and ours in turn; prints the ratios of the least
/// computing times.
pub(crate) fn compare(folder: &str, words: &[&str]) -> Result<(), Box<dyn Error>> {
    gate()?;
    let (rounds, list) = match words {
        [] => (ROUNDS, USUAL.to_vec()),
        [rounds] => (rounds.parse()?, USUAL.to_vec()),
        [rounds, list @ ..] => (rounds.parse()?, list.to_vec()),
    };
    for entry in list {
        let words: Vec<&str> = entry.split(':').collect();
        let [name, case, size, extra @ ..] = words.as_slice() else {
            return Err(format!("{entry:?} is not NAME:A|B:SIZE[:WORD ...]").into());
        };
        let mut least = BTreeMap::new();
        for _ in 0..rounds {
            for (who, line) in [
                ("steps", ours(case, size, None, "10")?),
                ("own", ours(case, size, Some("own"), "10")?),
                ("peer", peer(folder, name, [case, size, "1"], extra)?),
            ] {
                let seconds = line["cpu_s"].as_f64().unwrap_or(f64::INFINITY);
                let jit = line["jit_cpu_s"].as_f64().unwrap_or(0.0);
                let known = least.entry(who).or_insert((f64::INFINITY, Value::Null));
                if seconds - jit < known.0 {
                    *known = (seconds - jit, line);
                }
            }
        }
        report(name, case, size, &least);
    }
    Ok(())
}

fn report(name: &str, case: &str, size: &str, least: &BTreeMap<&str, (f64, Value)>) {
    let (Some(peer), Some(steps), Some(own)) =
        (least.get("peer"), least.get("steps"), least.get("own"))
    else {
        return;
    };
    if !peer.0.is_finite() {
        println!("{name:<8} {case} {size:>2}  failed or too long");
        return;
    }
    println!(
        "{name:<8} {case} {size:>2}  {:8.3} s, ours {:7.3} s and {:7.3} s in own steps; \
         ratio {:5.1} and {:5.1}; MB {} and {}",
        peer.0,
        steps.0,
        own.0,
        peer.0 / steps.0,
        peer.0 / own.0,
        peer.1["peak_mb"],
        steps.1["peak_mb"],
    );
    println!("figure solids.{name}.{case}{size} {:.4}", peer.0 / steps.0);
}

/// Nothing is timed before the results are right.
fn gate() -> Result<(), Box<dyn Error>> {
    let area = ours("A", "3", None, "5")?;
    let reaction = ours("B", "12", None, "5")?;
    for (line, key, (expected, near)) in [
        (&area, "area_ratio", AREA_RATIO),
        (&reaction, "reaction", REACTION),
    ] {
        let found = line[key].as_f64().unwrap_or(f64::NAN);
        println!("{key} {found:.6}, expected {expected} +- {near}");
        let right = (found - expected).abs() <= near;
        if !right {
            return Err(format!("{key} is wrong").into());
        }
    }
    Ok(())
}

/// One run of this program.
fn ours(case: &str, size: &str, extra: Option<&str>, kpa: &str) -> Result<Value, Box<dyn Error>> {
    let output = Command::new(std::env::current_exe()?)
        .args([case, size])
        .args(extra)
        .env("PTOP", kpa)
        .output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// One run of another program; null when it fails or takes too long.
fn peer(folder: &str, name: &str, run: [&str; 3], extra: &[&str]) -> Result<Value, Box<dyn Error>> {
    let variable = |key: &str, usual: &str| std::env::var(key).unwrap_or_else(|_| usual.into());
    let python = if name == "dolfinx" {
        variable("SYSPY", "/usr/bin/python3")
    } else {
        variable("PY", "python3")
    };
    let output = Command::new("timeout")
        .arg(variable("LIMIT", "300"))
        .arg(python)
        .args(["-W", "ignore"])
        .arg(Path::new(folder).join(format!("peer_{name}.py")))
        .args(run)
        .args(extra)
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().rfind(|line| line.starts_with('{'));
    Ok(line.map_or(Ok(Value::Null), serde_json::from_str)?)
}
