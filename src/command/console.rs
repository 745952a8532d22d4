//! What the command says, and where: answers on stdout, everything about the work on stderr, and with `--json`
//! one object a line on stdout.

use std::io::{self, IsTerminal, Write};

use serde_json::{Value, json};

/// How talkative the command is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Console {
    quiet: bool,
    json: bool,
}

impl Console {
    pub(crate) fn new(quiet: bool, json: bool) -> Self {
        Self { quiet, json }
    }

    /// How progress is to be shown.
    pub(crate) fn progress_style(self) -> ProgressStyle {
        match (self.quiet, self.json, io::stderr().is_terminal()) {
            (true, _, _) => ProgressStyle::None,
            (_, true, _) => ProgressStyle::Json,
            (_, _, true) => ProgressStyle::Bar,
            _ => ProgressStyle::Lines,
        }
    }

    /// The answer that was asked for: always said, unless programs get it as an event.
    pub(crate) fn answer(self, text: &str) {
        if !self.json {
            line(io::stdout(), text);
        }
    }

    /// The answer for programs.
    pub(crate) fn event(self, name: &str, fields: Value) {
        if self.json {
            line(io::stdout(), &event_line(name, fields));
        }
    }

    /// A remark about the work.
    pub(crate) fn note(self, text: &str) {
        if self.json {
            self.event("note", json!({ "message": text }));
        } else if !self.quiet {
            line(io::stderr(), text);
        }
    }

    /// Something that the user should know though the work goes on; said even when quiet.
    pub(crate) fn warn(self, text: &str) {
        self.event("warning", json!({ "message": text }));
        line(io::stderr(), &format!("warning: {text}"));
    }

    /// Why the work ended.
    pub(crate) fn error(self, text: &str) {
        self.event("error", json!({ "message": text }));
        line(io::stderr(), &format!("error: {text}"));
    }
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProgressStyle {
    /// Not at all.
    None,
    /// A bar that is drawn over and over.
    Bar,
    /// A line every few seconds, for logs.
    Lines,
    /// An object a line, for programs.
    Json,
}

/// One event on one line, its name first.
pub(crate) fn event_line(name: &str, fields: Value) -> String {
    let mut event = serde_json::Map::new();
    event.insert("event".into(), name.into());
    if let Value::Object(fields) = fields {
        event.extend(fields);
    }
    Value::Object(event).to_string()
}

/// A reader that went away (`| head`) is no reason to fail.
pub(crate) fn line(mut to: impl Write, text: &str) {
    let _ = writeln!(to, "{text}").and_then(|()| to.flush());
}
