//! Settings as they were written: TOML values that know where they stand.

use std::ops::Range;
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::problem::{Problem, Problems};
use super::source::{Origin, Source};

/// A value and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// Where.
    pub origin: Origin,
    /// What.
    pub kind: Kind,
}

/// What a [`Value`] can be.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A string.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// Any other number; may be infinite or not a number, as TOML allows.
    Float(f64),
    /// `true` or `false`.
    Bool(bool),
    /// A list.
    List(Vec<Value>),
    /// A table.
    Table(Table),
    /// A date or a time, which no setting takes.
    Date(String),
}

impl Value {
    /// What it is, for "found …".
    pub fn found(&self) -> String {
        match &self.kind {
            Kind::Text(text) => format!("the text {:?}", clip(text)),
            Kind::Integer(n) => format!("{n}"),
            Kind::Float(x) => format!("{x}"),
            Kind::Bool(b) => format!("{b}"),
            Kind::List(items) if items.len() == 1 => "a list of 1 value".into(),
            Kind::List(items) => format!("a list of {} values", items.len()),
            Kind::Table(_) => "a table".into(),
            Kind::Date(date) => format!("the date {date}"),
        }
    }
}

fn clip(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.into();
    }
    text.chars().take(LONGEST).chain(['…']).collect()
}

/// One line of a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub name: String,
    /// Where the key stands.
    pub key: Origin,
    /// The value.
    pub value: Value,
}

/// Keys and values in the order they were written.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Where the table stands: its header, its braces, or the whole file.
    pub origin: Origin,
    /// The entries; no two have the same name.
    pub entries: Vec<Entry>,
}

impl Table {
    /// A table that stands nowhere and holds nothing.
    pub fn empty() -> Self {
        Self { origin: Origin::nowhere(), entries: Vec::new() }
    }

    /// Parses a TOML text.
    ///
    /// # Errors
    /// What TOML itself does not allow, all of it, with places.
    pub fn parse(source: &Arc<Source>) -> Result<Self, Problems> {
        refuse_deep_keys(source)?;
        let (table, errors) = DeTable::parse_recoverable(&source.text);
        if errors.is_empty() {
            return Ok(convert_table(source, 0, table.span(), table.get_ref()));
        }
        let problem = |error: &toml::de::Error| {
            let range = error.span().unwrap_or(0..0);
            Problem::new(&Origin::new(source, range), format!("this is not TOML: {}", error.message()))
        };
        Err(Problems(errors.iter().map(problem).collect()))
    }

    /// The value of a key.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.entry(name).map(|entry| &entry.value)
    }

    /// The entry of a key.
    pub fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }

    /// Sets one value from `key=value`, as options of the command give it, replacing what stood there.
    ///
    /// The key is dotted (`camera.aperture_radius`); tables on the way are made when they are absent. An element
    /// of a list goes by its place (`shape.0.radius`) or its `name` (`shape.bunny.material`). The value is TOML;
    /// what is not TOML is taken as text, so that `environment=studio` needs no quotes.
    ///
    /// ```
    /// use halflight_scene::schema::{Source, Table};
    /// let mut table = Table::parse(&Source::option("test", "path.max_depth = 2")).unwrap();
    /// table.assign("--set", "path.max_depth=4").unwrap();
    /// table.assign("--set", "path.guide=on").unwrap();
    /// ```
    ///
    /// # Errors
    /// No `=`, an empty key, or a key that leads through something other than a table.
    pub fn assign(&mut self, option: &str, text: &str) -> Result<(), Problem> {
        let source = Source::option(option, text);
        let whole = Origin::whole(&source);
        let Some(equals) = text.find('=') else {
            return Err(Problem::new(&whole, "this sets nothing")
                .help("write KEY=VALUE, as in camera.aperture_radius=0.05"));
        };
        let mut keys = Vec::new();
        let mut start = 0;
        for part in text[..equals].split('.') {
            let name = part.trim();
            let at = start + (part.len() - part.trim_start().len());
            let origin = Origin::new(&source, at..at + name.len());
            if name.is_empty() {
                return Err(Problem::new(&origin, "a part of the key is empty"));
            }
            keys.push((name, origin));
            start += part.len() + 1;
        }
        if keys.len() > DEEPEST_KEY {
            return Err(Problem::new(&whole, "the key has too many parts"));
        }
        let value = parse_value(&source, equals + 1);
        insert(self, &keys, value, &whole)
    }
}

/// Sets the value at a path of keys, making tables on the way.
fn insert(table: &mut Table, keys: &[(&str, Origin)], value: Value, whole: &Origin) -> Result<(), Problem> {
    let Some(((name, key), rest)) = keys.split_first() else { return Ok(()) };
    let index = match table.entries.iter().position(|entry| entry.name == *name) {
        Some(index) => index,
        // A number is the place in a list, and there is none.
        None if rest.first().is_some_and(|(place, _)| place.parse::<usize>().is_ok()) => {
            let all = match *name {
                "medium" => "media".to_string(),
                name if name.ends_with('s') => name.to_string(),
                name => format!("{name}s"),
            };
            return Err(Problem::new(key, format!("there are no {all} whose keys could be set")));
        }
        None => {
            let empty = Kind::Table(Table { origin: whole.clone(), entries: Vec::new() });
            let value = Value { origin: whole.clone(), kind: empty };
            table.entries.push(Entry { name: (*name).to_string(), key: key.clone(), value });
            table.entries.len() - 1
        }
    };
    insert_into(&mut table.entries[index], (name, key), rest, value, whole)
}

fn insert_into(
    entry: &mut Entry,
    (name, key): (&str, &Origin),
    rest: &[(&str, Origin)],
    value: Value,
    whole: &Origin,
) -> Result<(), Problem> {
    if rest.is_empty() {
        *entry = Entry { name: entry.name.clone(), key: key.clone(), value };
        return Ok(());
    }
    match &mut entry.value.kind {
        Kind::Table(inner) => insert(inner, rest, value, whole),
        Kind::List(items) => {
            let Some(((wanted, wanted_at), rest)) = rest.split_first() else { return Ok(()) };
            let names: Vec<String> =
                items.iter().enumerate().map(|(i, item)| element_name(item, i)).collect();
            let found = names.iter().position(|name| name == wanted).or_else(|| wanted.parse().ok());
            match found.and_then(|index: usize| items.get_mut(index)) {
                Some(item) if rest.is_empty() => *item = value,
                Some(Value { kind: Kind::Table(inner), .. }) => return insert(inner, rest, value, whole),
                _ => {
                    let problem =
                        Problem::new(wanted_at, format!("`{name}` has no element `{wanted}` with keys"));
                    return Err(problem.offer(wanted, names.iter().map(String::as_str)));
                }
            }
            Ok(())
        }
        _ => {
            Err(Problem::new(key, format!("`{name}` is {}, and has no keys of its own", entry.value.found())))
        }
    }
}

/// What an element of a list goes by: its `name`, or its place.
fn element_name(item: &Value, index: usize) -> String {
    if let Kind::Table(table) = &item.kind
        && let Some(Value { kind: Kind::Text(name), .. }) = table.get("name")
    {
        return name.clone();
    }
    index.to_string()
}

/// Parses the end of a source as one TOML value, or takes it as text.
fn parse_value(source: &Arc<Source>, start: usize) -> Value {
    let text = &source.text[start..];
    let trimmed = text.trim();
    let start = start + (text.len() - text.trim_start().len());
    let origin = Origin::new(source, start..start + trimmed.len());
    let mut value = match DeValue::parse(trimmed) {
        Ok(parsed) => convert(source, start, parsed.span(), parsed.get_ref()),
        Err(_) => Value { origin: origin.clone(), kind: Kind::Text(trimmed.into()) },
    };
    value.origin = origin;
    value
}

/// The longest dotted key that is taken: deeper ones are an attack on the stack rather than a setting.
const DEEPEST_KEY: usize = 32;

/// The parser limits the nesting of brackets, but not of dotted keys: `a.a.a…` is a table in a table in a table,
/// which overflows the stack where it is dropped. This counts the dots of keys, passing over texts and comments.
fn refuse_deep_keys(source: &Arc<Source>) -> Result<(), Problems> {
    let bytes = source.text.as_bytes();
    let (mut at, mut depth) = (0, 0_usize);
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'.' => depth += 1,
            b'\n' | b'=' | b',' | b'{' | b'[' => depth = 0,
            b'#' => {
                while bytes.get(at + 1).is_some_and(|&next| next != b'\n') {
                    at += 1;
                }
            }
            b'"' | b'\'' => at = end_of_text(bytes, at),
            _ => {}
        }
        if depth > DEEPEST_KEY {
            let origin = Origin::new(source, at..at + 1);
            return Err(Problem::new(&origin, format!("a key with more than {DEEPEST_KEY} dots")).into());
        }
        at += 1;
    }
    Ok(())
}

/// The last byte of the text whose opening quote stands at `start`.
fn end_of_text(bytes: &[u8], start: usize) -> usize {
    let quote = bytes[start];
    let triple = bytes[start..].starts_with(&[quote; 3]);
    let mut at = if triple { start + 3 } else { start + 1 };
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'\\' if quote == b'"' => at += 1,
            b'\n' if !triple => return at - 1,
            _ if byte == quote && !triple => return at,
            _ if bytes[at..].starts_with(&[quote; 3]) && triple => return at + 2,
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

fn convert_table(source: &Arc<Source>, offset: usize, span: Range<usize>, table: &DeTable<'_>) -> Table {
    let origin = |span: Range<usize>| Origin::new(source, span.start + offset..span.end + offset);
    let mut entries: Vec<Entry> = table
        .iter()
        .map(|(key, value)| Entry {
            name: key.get_ref().to_string(),
            key: origin(key.span()),
            value: convert(source, offset, value.span(), value.get_ref()),
        })
        .collect();
    entries.sort_by_key(|entry| entry.key.range.start);
    Table { origin: origin(span), entries }
}

fn convert(source: &Arc<Source>, offset: usize, span: Range<usize>, value: &DeValue<'_>) -> Value {
    let origin = Origin::new(source, span.start + offset..span.end + offset);
    let kind = match value {
        DeValue::String(text) => Kind::Text(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(n) => Kind::Integer(n),
            Err(_) => Kind::Float(number.as_str().parse().unwrap_or(f64::INFINITY)),
        },
        DeValue::Float(number) => Kind::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(b) => Kind::Bool(*b),
        DeValue::Datetime(date) => Kind::Date(date.to_string()),
        DeValue::Array(items) => Kind::List(
            items.iter().map(|item| convert(source, offset, item.span(), item.get_ref())).collect(),
        ),
        DeValue::Table(table) => Kind::Table(convert_table(source, offset, span, table)),
    };
    Value { origin, kind }
}
