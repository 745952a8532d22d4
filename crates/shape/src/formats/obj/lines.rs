//! Lines of OBJ and MTL files: statements of words, comments after `#`, a `\` at the end goes on in the next line.
//! Lines end in LF or CR LF, or in CR where there is no LF at all; a byte-order mark before the first is skipped.

use crate::formats::without_mark;

/// A statement and where it begins.
pub(super) struct Statement<'a> {
    /// Counted from one.
    pub(super) line: usize,
    pub(super) keyword: &'a str,
    /// All that follows, without blanks around it.
    pub(super) rest: &'a str,
}

/// Calls `each` with every statement of a text; stops at its first error.
pub(super) fn statements<E>(bytes: &[u8], mut each: impl FnMut(Statement) -> Result<(), E>) -> Result<(), E> {
    let mut joined = String::new();
    let mut begun = 0;
    let line_end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    for (number, line) in without_mark(bytes).split(|b| *b == line_end).enumerate() {
        let text = String::from_utf8_lossy(line);
        let mut text = text.trim_end_matches('\r');
        if let Some((before, _)) = text.split_once('#') {
            text = before;
        }
        let text = text.trim();
        if joined.is_empty() {
            begun = number + 1;
        }
        if let Some(head) = text.strip_suffix('\\') {
            joined.push_str(head);
            joined.push(' ');
            continue;
        }
        let whole = if joined.is_empty() {
            text
        } else {
            joined.push_str(text);
            joined.trim()
        };
        let (keyword, rest) = whole.split_once(char::is_whitespace).unwrap_or((whole, ""));
        if !keyword.is_empty() {
            each(Statement { line: begun, keyword, rest: rest.trim() })?;
        }
        joined.clear();
    }
    Ok(())
}

/// A word in a message: short, and without what would disturb a terminal.
pub(super) fn shown(word: &str) -> String {
    let start: String = word.chars().take(30).collect();
    format!("`{}`", start.escape_debug())
}

/// The number that a word stands for; it must be finite.
pub(super) fn number(word: &str) -> Result<f32, String> {
    match word.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) => Err(format!("{value} where a finite number is expected")),
        Err(_) => Err(format!("{} is not a number", shown(word))),
    }
}
