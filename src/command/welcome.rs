//! What `halflight` says when nothing was asked.

use super::console::Console;
use super::examples::EXAMPLES;

pub(crate) fn welcome(console: Console) {
    let mut text = format!(
        "halflight {}: a renderer for scenes that move, lit from everywhere, made of measured materials.\n\nTry:",
        env!("CARGO_PKG_VERSION")
    );
    for example in EXAMPLES.iter().filter(|e| e.command == "halflight") {
        text += &format!("\n  {:<42} {}", example.line, example.about.to_lowercase());
    }
    text += "\n\n`halflight help` lists everything it can do, `halflight help render` one part of it.";
    console.answer(&text);
    console.event("welcome", serde_json::json!({ "version": env!("CARGO_PKG_VERSION"), "message": text }));
}
