//! Texts that settings are read from, and places in them.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A text that settings come from: a scene file, or an option of the command.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// The name people know it by: `scenes/still-life.toml`, `--set`.
    pub name: String,
    /// The whole text.
    pub text: String,
    /// The folder that relative paths in the text start from.
    pub folder: PathBuf,
}

impl Source {
    /// The text of a file.
    pub fn file(path: &Path, text: impl Into<String>) -> Arc<Self> {
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Arc::new(Self { name: path.display().to_string(), text: text.into(), folder })
    }

    /// The text of an option, whose paths start from the current folder.
    pub fn option(name: impl Into<String>, text: impl Into<String>) -> Arc<Self> {
        Arc::new(Self { name: name.into(), text: text.into(), folder: PathBuf::new() })
    }
}

/// A stretch of bytes of a [`Source`].
#[derive(Clone, PartialEq, Eq)]
pub struct Origin {
    /// The text.
    pub source: Arc<Source>,
    /// The bytes of it.
    pub range: Range<usize>,
}

impl Origin {
    /// A stretch of a source. Ends outside the text, or inside a character, are moved to a character's start.
    pub fn new(source: &Arc<Source>, range: Range<usize>) -> Self {
        let text = &source.text;
        let floor = |mut at: usize| {
            at = at.min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (start, end) = (floor(range.start), floor(range.end));
        Self { source: Arc::clone(source), range: start..end.max(start) }
    }

    /// The whole of a source.
    pub fn whole(source: &Arc<Source>) -> Self {
        Self::new(source, 0..source.text.len())
    }

    /// An origin for what stands in no text.
    pub fn nowhere() -> Self {
        Self::whole(&Source::option("", ""))
    }

    /// Line and column, both counted from one; columns are characters.
    pub fn line_column(&self) -> (usize, usize) {
        let before = &self.source.text[..self.range.start];
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// The text of the stretch.
    pub fn text(&self) -> &str {
        &self.source.text[self.range.clone()]
    }

    /// The line it starts on with the stretch underlined, as compilers show it.
    pub(super) fn excerpt(&self) -> String {
        /// The most characters of a line that are shown; longer ones are cut around the stretch.
        const WIDTH: usize = 100;
        if self.source.text.is_empty() {
            return if self.source.name.is_empty() {
                String::new()
            } else {
                format!("  --> {}\n", self.source.name)
            };
        }
        let (number, column) = self.line_column();
        let text = &self.source.text;
        let start = text[..self.range.start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[start..].lines().next().unwrap_or("");
        let first = column.saturating_sub(1 + WIDTH / 2);
        let shown: String =
            line.chars().skip(first).take(WIDTH).map(|c| if c.is_control() { ' ' } else { c }).collect();
        let on_line = self.range.end.min(start + line.len()).max(self.range.start);
        let carets = text[self.range.start..on_line].chars().count();
        let carets = carets.clamp(1, (WIDTH + first + 1).saturating_sub(column).max(1));
        let margin = " ".repeat(number.to_string().len());
        format!(
            "{margin} --> {}:{number}:{column}\n{margin} |\n{number} | {shown}\n{margin} | {}{}\n",
            self.source.name,
            " ".repeat(column - 1 - first),
            "^".repeat(carets)
        )
    }
}

impl fmt::Debug for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.line_column();
        write!(f, "{}:{line}:{column}", self.source.name)
    }
}
