//! The types that settings are made of.

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::docs::Docs;
use super::problem::Problem;
use super::read::{ReadValue, Reader};
use super::source::Origin;
use super::value::{Kind, Value};

/// A number as it was written, if the value is one. Infinite ones and those that are not numbers are refused.
fn number(value: &Value, reader: &mut Reader, expected: &str) -> Option<f64> {
    match value.kind {
        Kind::Integer(n) => Some(n as f64),
        Kind::Float(x) if x.is_finite() => Some(x),
        _ => {
            reader.mistaken(value, expected);
            None
        }
    }
}

macro_rules! real {
    ($type:ty) => {
        impl ReadValue for $type {
            fn expected() -> String {
                "a number".into()
            }
            fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
                let x = number(value, reader, &Self::expected())? as $type;
                if !x.is_finite() {
                    reader.mistaken(value, "a number of ordinary size");
                    return None;
                }
                Some(x)
            }
            fn written(&self) -> String {
                format!("{self}")
            }
            fn numbers(&self, visit: &mut dyn FnMut(f64)) {
                visit(f64::from(*self));
            }
        }
    };
}
real!(f32);
real!(f64);

macro_rules! whole {
    ($($type:ty),*) => {$(
        impl ReadValue for $type {
            fn expected() -> String {
                "a whole number".into()
            }
            fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
                if let Kind::Integer(n) = value.kind {
                    if let Ok(n) = Self::try_from(n) {
                        return Some(n);
                    }
                    let expected = format!("a whole number from {} to {}", Self::MIN, Self::MAX);
                    reader.mistaken(value, &expected);
                } else {
                    reader.mistaken(value, &Self::expected());
                }
                None
            }
            fn written(&self) -> String {
                self.to_string()
            }
            fn numbers(&self, visit: &mut dyn FnMut(f64)) {
                visit(*self as f64);
            }
        }
    )*};
}
whole!(u32, u64, usize, i32);

impl ReadValue for bool {
    fn expected() -> String {
        "`true` or `false`".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        if let Kind::Bool(b) = value.kind {
            return Some(b);
        }
        reader.mistaken(value, &Self::expected());
        None
    }
    fn written(&self) -> String {
        self.to_string()
    }
}

impl ReadValue for String {
    fn expected() -> String {
        "a text".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        if let Kind::Text(text) = &value.kind {
            return Some(text.clone());
        }
        reader.mistaken(value, &Self::expected());
        None
    }
    fn written(&self) -> String {
        format!("{self:?}")
    }
}

impl<const N: usize> ReadValue for [f32; N] {
    fn expected() -> String {
        match N {
            2 => "two numbers `[x, y]`".into(),
            3 => "three numbers `[x, y, z]`".into(),
            _ => format!("a list of {N} numbers"),
        }
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::List(items) if items.len() == N => {
                let mut numbers = [0.0; N];
                for (number, item) in numbers.iter_mut().zip(items) {
                    *number = f32::read_value(item, reader)?;
                }
                Some(numbers)
            }
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn written(&self) -> String {
        let numbers: Vec<String> = self.iter().map(f32::to_string).collect();
        format!("[{}]", numbers.join(", "))
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        self.iter().for_each(|&x| visit(f64::from(x)));
    }
}

macro_rules! whole_list {
    ($type:ty, $count:literal, $words:literal) => {
        impl ReadValue for [$type; $count] {
            fn expected() -> String {
                $words.into()
            }
            fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
                match &value.kind {
                    Kind::List(items) if items.len() == $count => {
                        let mut numbers = [0; $count];
                        for (number, item) in numbers.iter_mut().zip(items) {
                            *number = <$type>::read_value(item, reader)?;
                        }
                        Some(numbers)
                    }
                    _ => {
                        reader.mistaken(value, &Self::expected());
                        None
                    }
                }
            }
            fn written(&self) -> String {
                format!("{self:?}")
            }
            fn numbers(&self, visit: &mut dyn FnMut(f64)) {
                self.iter().for_each(|&x| visit(f64::from(x)));
            }
        }
    };
}
whole_list!(u32, 2, "two whole numbers");
whole_list!(u32, 3, "three whole numbers");

macro_rules! vector {
    ($type:ty, $count:literal) => {
        impl ReadValue for $type {
            fn expected() -> String {
                <[f32; $count]>::expected()
            }
            fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
                <[f32; $count]>::read_value(value, reader).map(Self::from)
            }
            fn written(&self) -> String {
                self.to_array().written()
            }
            fn numbers(&self, visit: &mut dyn FnMut(f64)) {
                self.to_array().numbers(visit);
            }
        }
    };
}
vector!(Vec2, 2);
vector!(Vec3, 3);

impl<T: ReadValue> ReadValue for Option<T> {
    fn expected() -> String {
        T::expected()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        T::read_value(value, reader).map(Some)
    }
    fn absent() -> Option<Self> {
        Some(None)
    }
    fn written(&self) -> String {
        self.as_ref().map(T::written).unwrap_or_default()
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        if let Some(value) = self {
            value.numbers(visit);
        }
    }
    fn section() -> Option<&'static str> {
        T::section()
    }
    fn document(docs: &mut Docs) {
        T::document(docs);
    }
}

impl<T: ReadValue> ReadValue for Vec<T> {
    fn expected() -> String {
        let one = T::expected();
        format!("a list, each {}", one.strip_prefix("a list of ").unwrap_or(&one))
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let Kind::List(items) = &value.kind else {
            reader.mistaken(value, &Self::expected());
            return None;
        };
        // Every element is read, so that each tells its own problem.
        let read: Vec<Option<T>> = items.iter().map(|item| T::read_value(item, reader)).collect();
        read.into_iter().collect()
    }
    fn absent() -> Option<Self> {
        Some(Vec::new())
    }
    fn written(&self) -> String {
        let items: Vec<String> = self.iter().map(T::written).collect();
        format!("[{}]", items.join(", "))
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        self.iter().for_each(|item| item.numbers(visit));
    }
    fn section() -> Option<&'static str> {
        T::section()
    }
    fn document(docs: &mut Docs) {
        T::document(docs);
    }
}

/// A value that remembers where it stands, for problems that show later.
#[derive(Clone, Debug, PartialEq)]
pub struct At<T> {
    /// Where.
    pub origin: Origin,
    /// What.
    pub value: T,
}

impl<T> std::ops::Deref for At<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: ReadValue> ReadValue for At<T> {
    fn expected() -> String {
        T::expected()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        Some(Self { origin: value.origin.clone(), value: T::read_value(value, reader)? })
    }
    fn written(&self) -> String {
        self.value.written()
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        self.value.numbers(visit);
    }
    fn section() -> Option<&'static str> {
        T::section()
    }
    fn document(docs: &mut Docs) {
        T::document(docs);
    }
}

/// The path of a file, which starts from the folder of the text that names it.
#[derive(Clone, Debug, PartialEq)]
pub struct FilePath {
    /// Where it is named.
    pub origin: Origin,
    /// The path to open.
    pub path: PathBuf,
}

impl FilePath {
    /// A path as the text at `origin` names it.
    pub fn named(text: &str, origin: &Origin) -> Self {
        Self { origin: origin.clone(), path: origin.source.folder.join(text) }
    }

    /// A path that the program itself names.
    pub fn direct(path: &Path) -> Self {
        let name = path.display().to_string();
        Self { origin: Origin::whole(&super::Source::option(name, "")), path: path.to_path_buf() }
    }
}

impl ReadValue for FilePath {
    fn expected() -> String {
        "a file".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Text(text) if text.is_empty() || text.contains('\0') => {
                reader.report(Problem::new(
                    &value.origin,
                    "expected the name of a file, found a text that names none",
                ));
                None
            }
            Kind::Text(text) => Some(Self::named(text, &value.origin)),
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
}

/// A linear colour: one number for grey, three for red, green and blue, or `"#rrggbb"` in sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(pub Vec3);

impl Color {
    /// The same amount of red, green and blue.
    pub const fn grey(x: f32) -> Self {
        Self(Vec3::splat(x))
    }

    /// A colour as `#rrggbb` or `#rgb` says it.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#')?;
        if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return None;
        }
        let byte = |at: usize| match digits.len() {
            3 => u8::from_str_radix(digits.get(at..=at)?, 16).ok().map(|x| x * 17),
            6 => u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok(),
            _ => None,
        };
        // The sRGB curve, IEC 61966-2-1.
        let linear = |x: u8| {
            let x = f32::from(x) / 255.0;
            if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        };
        Some(Self(Vec3::new(linear(byte(0)?), linear(byte(1)?), linear(byte(2)?))))
    }
}

impl ReadValue for Color {
    fn expected() -> String {
        "a colour: `[r, g, b]`, one number, or `\"#rrggbb\"`".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Integer(_) | Kind::Float(_) => f32::read_value(value, reader).map(Self::grey),
            Kind::List(items) if items.len() == 3 => Vec3::read_value(value, reader).map(Self),
            Kind::Text(text) if Self::from_hex(text).is_some() => Self::from_hex(text),
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn written(&self) -> String {
        if self.0 == Vec3::splat(self.0.x) { self.0.x.written() } else { self.0.written() }
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        self.0.numbers(visit);
    }
}
