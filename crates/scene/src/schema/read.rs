//! From values as written to values as meant.

use super::docs::Docs;
use super::limits::Limits;
use super::problem::{Problem, Problems};
use super::source::Origin;
use super::value::{Kind, Table, Value};

/// Collects what is wrong while settings are read.
#[derive(Debug, Default)]
pub struct Reader {
    problems: Vec<Problem>,
}

impl Reader {
    /// A reader that has found nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Notes a problem.
    pub fn report(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    /// Notes that a value is not what its key takes.
    pub fn mistaken(&mut self, value: &Value, expected: &str) {
        self.report(Problem::new(&value.origin, format!("expected {expected}, found {}", value.found())));
    }

    /// Whether nothing was wrong so far.
    pub fn is_clean(&self) -> bool {
        self.problems.is_empty()
    }

    /// The value, or the problems in the order they stand in the text.
    ///
    /// # Errors
    /// If any problem was reported.
    pub fn finish<T>(mut self, value: Option<T>) -> Result<T, Problems> {
        match value {
            Some(value) if self.problems.is_empty() => Ok(value),
            _ => {
                if self.problems.is_empty() {
                    self.report(Problem::new(&Origin::nowhere(), "the settings could not be read"));
                }
                self.problems.sort_by_key(|problem| problem.origin.range.start);
                Err(Problems(self.problems))
            }
        }
    }

    /// Reports the keys of a table that are not among `known`.
    pub fn refuse_unknown(&mut self, table: &Table, title: &str, known: &[&str]) {
        for entry in table.entries.iter().filter(|entry| !known.contains(&entry.name.as_str())) {
            let problem = Problem::new(&entry.key, format!("`{}` is not a key of {title}", entry.name));
            self.report(problem.offer(&entry.name, known.iter().copied()));
        }
    }

    /// Reads one key of a table: its value if it is there, else its default, else what the type is when absent.
    pub fn field<T: ReadValue>(
        &mut self,
        table: &Table,
        title: &str,
        name: &str,
        default: Option<T>,
        limits: Option<Limits>,
    ) -> Option<T> {
        let Some(entry) = table.entry(name) else {
            return default.or_else(T::absent).or_else(|| {
                let message = format!("{title} lacks the key `{name}`");
                self.report(
                    Problem::new(&table.origin, message).help(format!("`{name}` is {}", T::expected())),
                );
                None
            });
        };
        let read = T::read_value(&entry.value, self)?;
        let mut outside = None;
        if let Some(limits) = limits {
            read.numbers(&mut |x| {
                if !limits.allow(x) {
                    outside = outside.or(Some(x));
                }
            });
            if let Some(x) = outside {
                // As it was written: 0.1 read in single precision is 0.10000000149.
                let short = x as f32;
                let found = if f64::from(short) == x { short.to_string() } else { x.to_string() };
                let message = format!("`{name}` must be {limits}, found {found}");
                self.report(Problem::new(&entry.value.origin, message));
                return None;
            }
        }
        Some(read)
    }
}

/// A type that a setting can have.
pub trait ReadValue: Sized {
    /// What is expected, with an article: `a number`, `three numbers [x, y, z]`.
    fn expected() -> String;

    /// Reads it, reporting what is wrong.
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self>;

    /// What it is when its key is absent and has no default; `None` if the key is required.
    fn absent() -> Option<Self> {
        None
    }

    /// How it is written, for the defaults on the reference page.
    fn written(&self) -> String {
        String::new()
    }

    /// Every number in it, for limits.
    fn numbers(&self, _visit: &mut dyn FnMut(f64)) {}

    /// The section of the reference page that describes the type, if it has one.
    fn section() -> Option<&'static str> {
        None
    }

    /// Adds the sections that describe the type to the reference page.
    fn document(_docs: &mut Docs) {}
}

/// A table of settings, as [`record!`](crate::record) declares it.
pub trait Record: Sized {
    /// What it is called in errors and on the reference page.
    const TITLE: &'static str;
    /// Its keys.
    fn keys() -> &'static [&'static str];
    /// Reads the keys it knows, and leaves the others alone.
    fn read_keys(table: &Table, title: &str, reader: &mut Reader) -> Option<Self>;
    /// The keys for the reference page.
    fn describe_keys(docs: &mut Docs) -> Vec<super::docs::FieldDoc>;
    /// What it is, for the reference page.
    fn about() -> String;
}

/// A table that holds no keys of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NoKeys;

impl Record for NoKeys {
    const TITLE: &'static str = "";
    fn keys() -> &'static [&'static str] {
        &[]
    }
    fn read_keys(_: &Table, _: &str, _: &mut Reader) -> Option<Self> {
        Some(Self)
    }
    fn describe_keys(_: &mut Docs) -> Vec<super::docs::FieldDoc> {
        Vec::new()
    }
    fn about() -> String {
        String::new()
    }
}

/// One of several records, as [`variants!`](crate::variants) declares it.
pub trait Variants: Sized {
    /// What it is called in errors and on the reference page.
    const TITLE: &'static str;
    /// The words that the key `type` takes.
    fn names() -> &'static [&'static str];
    /// The word that a table without `type` means, found by the keys it has.
    fn inferred(table: &Table) -> Option<&'static str>;
    /// The keys of one variant.
    fn keys_of(name: &str) -> &'static [&'static str];
    /// Reads one variant; `None` also if there is no such variant.
    fn read_variant(name: &str, table: &Table, reader: &mut Reader) -> Option<Self>;
    /// The variants for the reference page.
    fn describe(docs: &mut Docs, common: Vec<super::docs::FieldDoc>);
}

/// A table whose key `type` says which keys it has, beside those that all variants share.
#[derive(Clone, Debug, PartialEq)]
pub struct Tagged<Common, Kind> {
    /// Where it stands.
    pub origin: Origin,
    /// The keys that all variants share.
    pub common: Common,
    /// The variant.
    pub kind: Kind,
}

impl<Common: Record, K: Variants> Tagged<Common, K> {
    /// Reads it from a table, as variant `name` if that is given.
    pub fn read_table(table: &Table, name: Option<&str>, reader: &mut Reader) -> Option<Self> {
        let tag = table.get("type");
        let name = match tag {
            Some(Value { kind: Kind::Text(text), .. }) => text.as_str(),
            Some(other) => {
                reader.mistaken(other, "a text");
                return None;
            }
            None => match name.or_else(|| K::inferred(table)) {
                Some(name) => name,
                None => {
                    let names: Vec<String> = K::names().iter().map(|n| format!("\"{n}\"")).collect();
                    let problem = Problem::new(&table.origin, format!("{} lacks the key `type`", K::TITLE));
                    reader.report(problem.help(format!("`type` is one of {}", names.join(", "))));
                    return None;
                }
            },
        };
        if !K::names().contains(&name) {
            let origin = tag.map_or(&table.origin, |tag| &tag.origin);
            let problem = Problem::new(origin, format!("\"{name}\" is not a type of {}", K::TITLE));
            reader.report(problem.offer(name, K::names().iter().copied()));
            return None;
        }
        let mut known = vec!["type"];
        known.extend(K::keys_of(name));
        known.extend(Common::keys());
        reader.refuse_unknown(table, &format!("{} of type \"{name}\"", K::TITLE), &known);
        let kind = K::read_variant(name, table, reader);
        let common = Common::read_keys(table, K::TITLE, reader);
        Some(Self { origin: table.origin.clone(), common: common?, kind: kind? })
    }
}

impl<Common: Record, K: Variants> ReadValue for Tagged<Common, K> {
    fn expected() -> String {
        format!("a table with a `type` ({})", K::TITLE)
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Table(table) => Self::read_table(table, None, reader),
            // A word alone is the variant with all its defaults.
            Kind::Text(name) if K::names().contains(&name.as_str()) => Self::read_table(
                &Table { origin: value.origin.clone(), entries: Vec::new() },
                Some(name),
                reader,
            ),
            Kind::Text(name) => {
                let problem =
                    Problem::new(&value.origin, format!("\"{name}\" is not a type of {}", K::TITLE));
                reader.report(problem.offer(name, K::names().iter().copied()));
                None
            }
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn section() -> Option<&'static str> {
        Some(K::TITLE)
    }
    fn document(docs: &mut Docs) {
        if docs.begin(K::TITLE) {
            let common = Common::describe_keys(docs);
            K::describe(docs, common);
        }
    }
}

/// Reads a record from a table.
///
/// # Errors
/// Every unknown key, wrong type, missing key and value outside its limits.
pub fn read<T: Record>(table: &Table) -> Result<T, Problems> {
    let mut reader = Reader::new();
    reader.refuse_unknown(table, T::TITLE, T::keys());
    let value = T::read_keys(table, T::TITLE, &mut reader);
    reader.finish(value)
}
