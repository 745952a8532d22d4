//! Typed arrays out of buffers.
//!
//! Every range is checked against its buffer view and every view against its buffer before a number is read.
//! Files may refer to the same bytes as often as they like; what that comes to when decoded is bounded by a
//! budget, so that a small file cannot ask for much memory or time.

use std::borrow::Cow;
use std::cell::Cell;
use std::path::Path;

use halflight_file::LoadError;

use super::ASKED;
use super::json::{Accessor, Root};
use crate::formats::Resolver;

/// Decoded bytes that any file may ask for.
const LEAST_BUDGET: u64 = 16 << 20;
/// Decoded bytes for each byte of the buffers. Bytes become floats (4), matrices of joints and frames stay as
/// they are; sharing of vertices between primitives is what takes the rest.
const BUDGET_FACTOR: u64 = 64;

/// A file with its buffers.
pub(super) struct Document<'a> {
    pub(super) root: &'a Root,
    pub(super) name: &'a Path,
    pub(super) companions: &'a Resolver,
    buffers: &'a [Cow<'a, [u8]>],
    budget: Cell<u64>,
}

impl<'a> Document<'a> {
    pub(super) fn new(
        root: &'a Root,
        buffers: &'a [Cow<'a, [u8]>],
        name: &'a Path,
        companions: &'a Resolver,
    ) -> Self {
        let bytes: u64 = buffers.iter().map(|buffer| buffer.len() as u64).sum();
        let budget = Cell::new(LEAST_BUDGET.max(bytes.saturating_mul(BUDGET_FACTOR)));
        Self { root, name, companions, buffers, budget }
    }

    /// An error about the file.
    pub(super) fn error(&self, found: impl Into<String>) -> LoadError {
        LoadError::new(ASKED, self.name, found)
    }

    /// `list[index]`, or an error that says who asked for it.
    pub(super) fn get<'t, T>(
        &self,
        list: &'t [T],
        index: usize,
        kind: &str,
        asker: &str,
    ) -> Result<&'t T, LoadError> {
        list.get(index).ok_or_else(|| {
            self.error(format!("{asker} refers to {kind} {index}, but there are {}", list.len()))
        })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize, asker: &str) -> Result<&'a [u8], LoadError> {
        let view = self.get(&self.root.buffer_views, index, "buffer view", asker)?;
        let who = format!("buffer view {index}");
        let buffer = self.get(self.buffers, view.buffer, "buffer", &who)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        end.and_then(|end| buffer.get(view.byte_offset..end)).ok_or_else(|| {
            self.error(format!(
                "buffer view {index} takes {} bytes from byte {}, but buffer {} has {}",
                view.byte_length,
                view.byte_offset,
                view.buffer,
                buffer.len()
            ))
        })
    }

    /// An accessor of `N` finite numbers an element; whole numbers become fractions if it says normalized.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        asker: &str,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let accessor = self.accessor::<N>(index, asker)?;
        let kind = self.component(accessor.component_type, index)?;
        let scale = if accessor.normalized { kind.normalizer() } else { 1.0 };
        let low = if accessor.normalized { -1.0 } else { f64::NEG_INFINITY };
        // Not `max`, which would make a number of what is none.
        let bounded = |value: f64| if value < low { low } else { value };
        let values = self.elements(accessor, index, [0f32; N], |value| bounded(value * scale) as f32)?;
        match values.iter().flatten().position(|value| !value.is_finite()) {
            Some(i) => {
                let value = values[i / N][i % N];
                Err(self.error(format!("{asker}: element {} of accessor {index} is {value}", i / N)))
            }
            None => Ok(values),
        }
    }

    /// An accessor of `N` whole numbers an element, none negative.
    pub(super) fn integers<const N: usize>(
        &self,
        index: usize,
        asker: &str,
    ) -> Result<Vec<[u32; N]>, LoadError> {
        let accessor = self.accessor::<N>(index, asker)?;
        if !matches!(
            self.component(accessor.component_type, index)?,
            Component::U8 | Component::U16 | Component::U32
        ) {
            return Err(self.error(format!("{asker}: accessor {index} is not of unsigned whole numbers")));
        }
        self.elements(accessor, index, [0u32; N], |value| value as u32)
    }

    fn accessor<const N: usize>(&self, index: usize, asker: &str) -> Result<&'a Accessor, LoadError> {
        let accessor = self.get(&self.root.accessors, index, "accessor", asker)?;
        let expected = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        if accessor.kind != expected {
            let kind = accessor.kind.escape_debug();
            return Err(
                self.error(format!("{asker}: accessor {index} is {kind} where {expected} is expected"))
            );
        }
        Ok(accessor)
    }

    fn component(&self, code: u32, accessor: usize) -> Result<Component, LoadError> {
        Component::of(code).ok_or_else(|| {
            self.error(format!("accessor {accessor} has components of the unknown type {code}"))
        })
    }

    fn elements<T: Copy, const N: usize>(
        &self,
        accessor: &Accessor,
        index: usize,
        zero: [T; N],
        convert: impl Fn(f64) -> T,
    ) -> Result<Vec<[T; N]>, LoadError> {
        let kind = self.component(accessor.component_type, index)?;
        let bytes = (accessor.count as u64).saturating_mul(4 * N as u64);
        let Some(left) = self.budget.get().checked_sub(bytes) else {
            return Err(self.error(format!(
                "accessor {index} claims {} elements: too much for the size of the file",
                accessor.count
            )));
        };
        self.budget.set(left);
        let read = |element: &[u8]| {
            let mut value = zero;
            for (i, component) in value.iter_mut().enumerate() {
                *component = convert(kind.read(&element[i * kind.bytes()..]));
            }
            value
        };
        let size = N * kind.bytes();
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let stride = self.root.buffer_views.get(view).and_then(|v| v.byte_stride);
                let who = format!("accessor {index}");
                let bytes = self.view(view, &who)?;
                self.strided(bytes, (accessor.byte_offset, stride, accessor.count), size, &who)?
                    .map(read)
                    .collect()
            }
            None => vec![zero; accessor.count],
        };
        if let Some(sparse) = &accessor.sparse {
            let who = format!("the sparse part of accessor {index}");
            let unsigned = self.component(sparse.indices.component_type, index)?;
            let places = self.view(sparse.indices.buffer_view, &who)?;
            let places = (places, (sparse.indices.byte_offset, None, sparse.count));
            let replacements = self.view(sparse.values.buffer_view, &who)?;
            let replacements = (replacements, (sparse.values.byte_offset, None, sparse.count));
            let places = self.strided(places.0, places.1, unsigned.bytes(), &who)?;
            for (place, element) in places.zip(self.strided(replacements.0, replacements.1, size, &who)?) {
                let place = unsigned.read(place);
                let count = values.len();
                let value =
                    values
                        .get_mut(place as usize)
                        .filter(|_| place >= 0.0 && place.fract() == 0.0)
                        .ok_or_else(|| self.error(format!("{who} replaces element {place} of {count}")))?;
                *value = read(element);
            }
        }
        Ok(values)
    }

    /// `count` elements of `size` bytes, `stride` bytes apart, from `offset` on.
    fn strided<'b>(
        &self,
        bytes: &'b [u8],
        (offset, stride, count): (usize, Option<usize>, usize),
        size: usize,
        who: &str,
    ) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, LoadError> {
        let stride = stride.filter(|stride| *stride > 0).unwrap_or(size);
        if stride < size {
            return Err(self.error(format!("{who}: elements of {size} bytes stand {stride} bytes apart")));
        }
        let needed = match count {
            0 => Some(0),
            _ => (count - 1)
                .checked_mul(stride)
                .and_then(|n| n.checked_add(size))
                .and_then(|n| n.checked_add(offset)),
        };
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let found = format!(
                "{who} takes {count} elements of {size} bytes from byte {offset}, but its buffer view has {} bytes",
                bytes.len()
            );
            return Err(self.error(found).hint("the file was cut short, or its JSON is wrong"));
        }
        // With no elements the offset may lie anywhere.
        let bytes = bytes.get(offset..).unwrap_or_default();
        Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
    }
}

/// The type of a component.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// By the numbers of OpenGL.
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// What takes the largest value to 1 (glTF 2.0, §3.6.2.2).
    fn normalizer(self) -> f64 {
        match self {
            Self::I8 => 1.0 / 127.0,
            Self::U8 => 1.0 / 255.0,
            Self::I16 => 1.0 / 32767.0,
            Self::U16 => 1.0 / 65535.0,
            Self::U32 | Self::F32 => 1.0,
        }
    }

    fn read(self, bytes: &[u8]) -> f64 {
        fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
            *bytes.first_chunk().expect("the range was checked")
        }
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(first(bytes))),
            Self::U8 => f64::from(u8::from_le_bytes(first(bytes))),
            Self::I16 => f64::from(i16::from_le_bytes(first(bytes))),
            Self::U16 => f64::from(u16::from_le_bytes(first(bytes))),
            Self::U32 => f64::from(u32::from_le_bytes(first(bytes))),
            Self::F32 => f64::from(f32::from_le_bytes(first(bytes))),
        }
    }
}
