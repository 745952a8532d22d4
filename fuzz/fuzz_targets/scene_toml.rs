//! Scene files, as far as they can be read without the files they name; and settings of the command line.

#![no_main]

use std::path::Path;

use halflight_scene::Scene;
use halflight_scene::schema::Table;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = Scene::parse(text, Path::new("fuzz.toml")) {
        assert!(!error.to_string().is_empty());
    }
    let mut table = Table::empty();
    for line in text.lines().take(16) {
        if let Err(problem) = table.assign("--set", line) {
            assert!(!problem.to_string().is_empty());
        }
    }
});
