//! The header: what elements there are, and what each row of them holds.

use std::path::Path;

use halflight_file::{LoadError, Place, nearest_name};

use super::ASKED;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A type of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

const SCALARS: [(&str, Scalar); 16] = [
    ("char", Scalar::I8),
    ("uchar", Scalar::U8),
    ("short", Scalar::I16),
    ("ushort", Scalar::U16),
    ("int", Scalar::I32),
    ("uint", Scalar::U32),
    ("float", Scalar::F32),
    ("double", Scalar::F64),
    ("int8", Scalar::I8),
    ("uint8", Scalar::U8),
    ("int16", Scalar::I16),
    ("uint16", Scalar::U16),
    ("int32", Scalar::I32),
    ("uint32", Scalar::U32),
    ("float32", Scalar::F32),
    ("float64", Scalar::F64),
];

impl Scalar {
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The largest value, for whole numbers.
    pub(super) fn largest(self) -> Option<f64> {
        match self {
            Self::I8 => Some(f64::from(i8::MAX)),
            Self::U8 => Some(f64::from(u8::MAX)),
            Self::I16 => Some(f64::from(i16::MAX)),
            Self::U16 => Some(f64::from(u16::MAX)),
            Self::I32 => Some(f64::from(i32::MAX)),
            Self::U32 => Some(f64::from(u32::MAX)),
            Self::F32 | Self::F64 => None,
        }
    }
}

/// One property of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A table of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The fewest bytes that a row can take.
    pub(super) fn least_row_bytes(&self, encoding: Encoding) -> u64 {
        let bytes = |p: &Property| match (encoding, p.kind) {
            // A digit and a blank.
            (Encoding::Ascii, _) => 2,
            (_, Kind::One(scalar) | Kind::List { count: scalar, .. }) => scalar.bytes() as u64,
        };
        self.properties.iter().map(bytes).sum()
    }
}

/// The header, and where the rows begin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Offset of the first row in bytes.
    pub(super) body: usize,
    /// Lines that the header has.
    pub(super) lines: usize,
}

/// Reads the header of a file. Lines end in LF, CR LF or CR, as the first one does.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Header, LoadError> {
    let error = |found: String| LoadError::new(ASKED, path, found);
    if bytes.is_empty() {
        return Err(error("the file is empty".into()));
    }
    if !bytes.starts_with(b"ply") || !bytes.get(3).is_some_and(u8::is_ascii_whitespace) {
        return Err(error("it does not begin with the line `ply`".into()).hint("is this a PLY file?"));
    }
    let line_end: &[u8] = match bytes[3..] {
        [b'\r', b'\n', ..] => b"\r\n",
        [b'\r', ..] => b"\r",
        _ => b"\n",
    };
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut start = 0;
    for number in 1.. {
        let rest = bytes.get(start..).unwrap_or_default();
        let at = |found: String| error(found).at(Place::Line(number));
        let Some(length) = find(rest, line_end) else {
            return Err(at("the header has no `end_header` line".into()).hint("the file was cut short"));
        };
        start += length + line_end.len();
        let line = String::from_utf8_lossy(&rest[..length]);
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, _version] => {
                encoding = Some(parse_encoding(name).ok_or_else(|| unknown_format(name, &at))?)
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| at(format!("`{count}` is not a count of elements")))?;
                if elements.iter().any(|e| e.name == *name) {
                    return Err(at(format!("there are two elements called `{name}`")));
                }
                elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property = parse_property(rest).map_err(|(found, hint)| match hint {
                    Some(hint) => at(found).hint(hint),
                    None => at(found),
                })?;
                let element =
                    elements.last_mut().ok_or_else(|| at("a property stands before any element".into()))?;
                if element.properties.iter().any(|p| p.name == property.name) {
                    return Err(at(format!(
                        "element `{}` has two properties `{}`",
                        element.name, property.name
                    )));
                }
                element.properties.push(property);
            }
            ["end_header"] => {
                let encoding = encoding.ok_or_else(|| at("the header does not say its format".into()))?;
                return Ok(Header { encoding, elements, body: start, lines: number });
            }
            _ => {
                let shown: String = line.chars().take(60).collect();
                return Err(at(format!("`{}` is not a line of a PLY header", shown.escape_debug())));
            }
        }
    }
    unreachable!("the loop ends at the end of the bytes")
}

fn find(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    bytes.windows(needle.len()).position(|window| window == needle)
}

fn parse_encoding(name: &str) -> Option<Encoding> {
    match name {
        "ascii" => Some(Encoding::Ascii),
        "binary_little_endian" => Some(Encoding::LittleEndian),
        "binary_big_endian" => Some(Encoding::BigEndian),
        _ => None,
    }
}

fn unknown_format(name: &str, at: &dyn Fn(String) -> LoadError) -> LoadError {
    at(format!("the format `{name}` is not known"))
        .hint("known are ascii, binary_little_endian and binary_big_endian")
}

fn parse_property(words: &[&str]) -> Result<Property, (String, Option<String>)> {
    let scalar = |name: &str| {
        let found = SCALARS.iter().find(|(known, _)| *known == name);
        found.map(|(_, scalar)| *scalar).ok_or_else(|| {
            let near = nearest_name(name, SCALARS.iter().map(|(known, _)| *known));
            (format!("`{name}` is not a type of number"), near.map(|near| format!("did you mean `{near}`?")))
        })
    };
    match words {
        ["list", count, item, name] => {
            let count = scalar(count)?;
            if count.largest().is_none() {
                return Err((format!("the list `{name}` counts its items in fractions"), None));
            }
            Ok(Property { name: (*name).into(), kind: Kind::List { count, item: scalar(item)? } })
        }
        [kind, name] => Ok(Property { name: (*name).into(), kind: Kind::One(scalar(kind)?) }),
        _ => Err(("a property is `type name` or `list type type name`".into(), None)),
    }
}
