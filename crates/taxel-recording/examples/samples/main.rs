//! Writes the sample recordings of this repository into a folder.
//!
//! `cargo run -p taxel-recording --example samples -- crates/taxel-recording/tests/recordings`
//! writes those that are committed; a test compares them.

use std::error::Error;
use std::fs;
use std::path::Path;

mod recordings;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("give a folder")?;
    for (name, text) in recordings::all() {
        let path = Path::new(&folder).join(name);
        fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
        fs::write(path, text)?;
    }
    Ok(())
}
