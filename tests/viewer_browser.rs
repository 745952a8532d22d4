//! The viewer in a real browser, driven by `tools/viewer/test.mjs`; skipped with a message where no browser is.

use std::path::Path;
use std::process::Command;

#[test]
fn a_person_can_look_turn_compare_ask_and_save() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/viewer/test.mjs");
    let mut node = Command::new("node");
    node.arg(script).arg(env!("CARGO_BIN_EXE_halflight"));
    match node.output() {
        Err(_) => eprintln!("skipped: there is no node to drive a browser with"),
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stdout);
            let failed = String::from_utf8_lossy(&output.stderr);
            if output.status.code() == Some(77) {
                eprintln!("{}", said.trim());
                return;
            }
            assert!(output.status.success(), "{said}\n{failed}");
            print!("{said}");
        }
    }
}
