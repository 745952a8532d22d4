//! The reference page, from the same declarations that read the settings.

use std::fmt::Write;

/// One key on the reference page.
#[derive(Clone, Debug)]
pub struct FieldDoc {
    /// The key.
    pub name: String,
    /// What it is and does.
    pub about: String,
    /// Its type, in words.
    pub kind: String,
    /// The section that describes its type, if there is one.
    pub section: Option<&'static str>,
    /// Its unit, if it has one.
    pub unit: Option<&'static str>,
    /// The numbers it takes, if they are limited.
    pub limits: Option<String>,
    /// Its value when it is absent, as it is written.
    pub default: String,
    /// Whether it must be there.
    pub required: bool,
    /// An example, as it is written.
    pub example: Option<&'static str>,
}

/// One word of a choice on the reference page.
#[derive(Clone, Debug)]
pub struct ChoiceDoc {
    /// The word.
    pub name: &'static str,
    /// What it means.
    pub about: String,
}

/// Collects the sections of a reference page, each once, in the order they are first met.
#[derive(Debug, Default)]
pub struct Docs {
    begun: Vec<&'static str>,
    sections: Vec<(&'static str, String)>,
}

impl Docs {
    /// A page without sections.
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the section of this title is new, and keeps its place on the page.
    pub fn begin(&mut self, title: &'static str) -> bool {
        let new = !self.begun.contains(&title);
        if new {
            self.begun.push(title);
        }
        new
    }

    /// Fills the section of a record.
    pub fn record(&mut self, title: &'static str, about: &str, fields: &[FieldDoc]) {
        let mut text = format!("{about}\n\n");
        write_fields(&mut text, fields);
        self.sections.push((title, text));
    }

    /// Fills the section of a choice.
    pub fn choices(&mut self, title: &'static str, about: &str, choices: &[ChoiceDoc]) {
        let mut text = format!("{about}\n\n| value | meaning |\n|---|---|\n");
        for choice in choices {
            let _ = writeln!(text, "| `\"{}\"` | {} |", choice.name, escape(&choice.about));
        }
        text.push('\n');
        self.sections.push((title, text));
    }

    /// Fills the section of variants: for each its word, what it is, and its keys.
    pub fn variants(
        &mut self,
        title: &'static str,
        about: &str,
        common: &[FieldDoc],
        variants: &[(ChoiceDoc, Vec<FieldDoc>)],
    ) {
        let words: Vec<String> =
            variants.iter().map(|(choice, _)| format!("`\"{}\"`", choice.name)).collect();
        let mut text = format!("{about}\n\nThe key `type` is one of {}.\n\n", words.join(", "));
        if !common.is_empty() {
            text.push_str("Keys of every type:\n\n");
            write_fields(&mut text, common);
        }
        for (choice, fields) in variants {
            let _ = write!(text, "### `type = \"{}\"`\n\n{}\n\n", choice.name, choice.about);
            if !fields.is_empty() {
                write_fields(&mut text, fields);
            }
        }
        self.sections.push((title, text));
    }

    /// The sections as Markdown, with headings of the second level.
    pub fn markdown(&self) -> String {
        let mut page = String::new();
        for title in &self.begun {
            if let Some((_, text)) = self.sections.iter().find(|(name, _)| name == title) {
                let _ = write!(page, "## {}\n\n{text}", heading(title));
            }
        }
        page.truncate(page.trim_end().len());
        page.push('\n');
        page
    }
}

/// A heading: titles that are not keys in brackets begin with a capital letter and lose their article.
fn heading(title: &str) -> String {
    if title.starts_with('[') {
        return format!("`{title}`");
    }
    let bare = title.strip_prefix("a ").or_else(|| title.strip_prefix("an ")).unwrap_or(title);
    let mut letters = bare.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The anchor that a heading has on the page.
fn anchor(title: &str) -> String {
    let kept = heading(title).to_lowercase();
    kept.chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// Text that can stand in a cell of a Markdown table.
pub fn escape(text: &str) -> String {
    text.replace('|', "\\|").split_whitespace().collect::<Vec<_>>().join(" ")
}

fn write_fields(text: &mut String, fields: &[FieldDoc]) {
    text.push_str("| key | type | default | meaning | example |\n|---|---|---|---|---|\n");
    for field in fields {
        let mut kind = escape(&field.kind);
        if let Some(section) = field.section {
            kind = format!("[{kind}](#{})", anchor(section));
        }
        if let Some(limits) = &field.limits {
            let _ = write!(kind, ", {limits}");
        }
        if let Some(unit) = field.unit {
            let _ = write!(kind, "; {unit}");
        }
        let default = match (field.required, field.default.as_str()) {
            (true, _) => "required".into(),
            (false, "") => "—".into(),
            (false, default) => format!("`{}`", escape(default)),
        };
        let example = field.example.map(|e| format!("`{} = {}`", field.name, escape(e))).unwrap_or_default();
        let _ = writeln!(
            text,
            "| `{}` | {kind} | {default} | {} | {example} |",
            field.name,
            escape(&field.about)
        );
    }
    text.push('\n');
}
