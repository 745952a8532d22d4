//! From a file to its JSON and its buffers: `.gltf` text or a `.glb` container, data URIs, companions.
//!
//! A `.glb` file is `glTF`, the version 2 and the length of the whole, then chunks of length, type and data; the
//! first is JSON, the second, if there is one, the buffer without a URI. All numbers are little-endian `u32`.

use std::borrow::Cow;
use std::path::Path;

use halflight_file::{LoadError, Place};

use super::ASKED;
use super::json::Root;
use crate::formats::{Resolver, without_mark};

/// The parts of a file.
pub(super) struct Container<'a> {
    pub(super) root: Root,
    pub(super) buffers: Vec<Cow<'a, [u8]>>,
}

/// Takes a file apart and gathers its buffers.
pub(super) fn open<'a>(
    bytes: &'a [u8],
    name: &Path,
    companions: &Resolver,
) -> Result<Container<'a>, LoadError> {
    let error = |found: String| LoadError::new(ASKED, name, found);
    if bytes.is_empty() {
        return Err(error("the file is empty".into()));
    }
    let (json, json_start, binary) = if bytes.starts_with(b"glTF") {
        let chunks = chunks(bytes).map_err(|(offset, found)| error(found).at(Place::Byte(offset as u64)))?;
        (chunks.json, chunks.json_start, chunks.binary)
    } else {
        (without_mark(bytes), 0, None)
    };
    let root: Root = serde_json::from_slice(json).map_err(|e| {
        let found = format!("the JSON is not glTF's: {}", without_place(&e));
        let (line, column) = (e.line(), e.column());
        if json_start > 0 {
            error(format!("{found}, in line {line}, column {column} of the JSON chunk"))
                .at(Place::Byte(json_start as u64))
        } else {
            error(found).at(Place::LineColumn(line.max(1), column.max(1)))
        }
    })?;
    if !root.asset.version.starts_with("2.") {
        let found = match root.asset.version.as_str() {
            "" => "it does not say its version in `asset.version`".to_string(),
            version => format!("it is glTF {}, and only 2.x is read", version.escape_debug()),
        };
        return Err(error(found));
    }
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let data: Cow<[u8]> = match &buffer.uri {
            Some(uri) => Cow::Owned(fetch(uri, "glTF buffer", name, companions)?),
            None => match binary {
                Some(binary) if index == 0 => Cow::Borrowed(binary),
                _ => return Err(error(format!("buffer {index} has neither a URI nor a binary chunk"))),
            },
        };
        if data.len() < buffer.byte_length {
            return Err(error(format!(
                "buffer {index} should have {} bytes, but there are {}",
                buffer.byte_length,
                data.len()
            ))
            .hint("the file was cut short"));
        }
        buffers.push(match data {
            Cow::Borrowed(data) => Cow::Borrowed(&data[..buffer.byte_length]),
            Cow::Owned(mut data) => {
                data.truncate(buffer.byte_length);
                Cow::Owned(data)
            }
        });
    }
    Ok(Container { root, buffers })
}

/// The data of a URI: in the URI itself, or in a companion.
pub(super) fn fetch(
    uri: &str,
    asked: &str,
    name: &Path,
    companions: &Resolver,
) -> Result<Vec<u8>, LoadError> {
    match data_uri(uri) {
        Some(Ok(data)) => Ok(data),
        Some(Err(found)) => Err(LoadError::new(asked, name, found)),
        None => companions.bytes(&local_name(uri).map_err(|e| LoadError::new(asked, name, e))?, asked, name),
    }
}

/// The name of the file beside the model that a URI stands for; one that lies elsewhere is said to.
pub(super) fn local_name(uri: &str) -> Result<String, String> {
    // RFC 3986: a letter, then letters, digits and a few signs. A single letter is a drive of Windows.
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme).filter(|scheme| {
        scheme.len() > 1
            && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    match scheme {
        Some(_) => {
            let shown: String = uri.chars().take(60).collect();
            Err(format!("it refers to {}, and only files beside it are read", shown.escape_debug()))
        }
        None => Ok(percent_decoded(uri)),
    }
}

/// The data inside a `data:` URI; `None` if it is another kind of URI.
pub(super) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let data = uri.strip_prefix("data:")?;
    let Some((_, payload)) = data.split_once(";base64,") else {
        return Some(Err("a data URI is not in base64".into()));
    };
    Some(base64(payload.as_bytes()).ok_or_else(|| "the base64 of a data URI is damaged".into()))
}

/// RFC 4648, standard or URL alphabet, padding optional.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let end = text.iter().rposition(|b| *b != b'=').map_or(0, |last| last + 1);
    let mut bytes = Vec::with_capacity(end / 4 * 3 + 3);
    for group in text[..end].chunks(4) {
        let mut word = 0u32;
        for &symbol in group {
            let six = match symbol {
                b'A'..=b'Z' => symbol - b'A',
                b'a'..=b'z' => symbol - b'a' + 26,
                b'0'..=b'9' => symbol - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            word = word << 6 | u32::from(six);
        }
        if group.len() == 1 {
            return None;
        }
        // A short group holds as many whole bytes as it has symbols, less one.
        let word = word << (6 * (4 - group.len()));
        bytes.extend_from_slice(&word.to_be_bytes()[1..group.len()]);
    }
    Some(bytes)
}

/// `%20` and its like to the bytes they stand for (RFC 3986).
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(decoded) if byte == b'%' => {
                bytes.push(decoded);
                rest = &after[2..];
            }
            _ => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// serde_json says the place too, at the end; it is said elsewhere.
fn without_place(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.split(" at line ").next().unwrap_or(&text).to_string()
}

struct Chunks<'a> {
    json: &'a [u8],
    json_start: usize,
    binary: Option<&'a [u8]>,
}

/// The offset of a byte, and what is wrong there.
type Found = (usize, String);

fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, Found> {
    let word = |offset: usize| {
        let word = bytes.get(offset..).and_then(|rest| rest.first_chunk::<4>());
        word.map(|word| u32::from_le_bytes(*word)).ok_or((offset, "the file ends in its header".to_string()))
    };
    let version = word(4)?;
    if version != 2 {
        return Err((4, format!("it is a binary glTF of version {version}, and only version 2 is read")));
    }
    let claimed = word(8)? as usize;
    if claimed > bytes.len() {
        return Err((8, format!("the file should have {claimed} bytes, but has {}", bytes.len())));
    }
    let chunk = |offset: usize| -> Result<(&[u8], &[u8]), Found> {
        let length = word(offset)? as usize;
        let kind = bytes.get(offset + 4..offset + 8).unwrap_or_default();
        let data = bytes.get(offset + 8..).unwrap_or_default();
        if length > data.len() {
            return Err((offset, format!("a chunk should have {length} bytes, but {} are left", data.len())));
        }
        Ok((kind, &data[..length]))
    };
    let (kind, json) = chunk(12)?;
    if kind != b"JSON" {
        return Err((16, "the first chunk is not JSON".into()));
    }
    let mut binary = None;
    let mut offset = 20 + json.len().next_multiple_of(4);
    while offset < claimed && binary.is_none() {
        let (kind, data) = chunk(offset)?;
        // Chunks of other kinds are to be passed over.
        if kind == b"BIN\0" {
            binary = Some(data);
        }
        offset += 8 + data.len().next_multiple_of(4);
    }
    Ok(Chunks { json, json_start: 20, binary })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_decoded_with_and_without_padding() {
        for (text, expected) in [
            ("", &b""[..]),
            ("Zg==", b"f"),
            ("Zg", b"f"),
            ("Zm8=", b"fo"),
            ("Zm9v", b"foo"),
            ("Zm9vYmFy", b"foobar"),
            ("+/-_", &[0xfb, 0xff, 0xbf]),
        ] {
            assert_eq!(base64(text.as_bytes()).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(base64(b"Zm9vY"), None);
        assert_eq!(base64(b"Zm 9"), None);
    }

    #[test]
    fn names_in_uris_are_decoded() {
        assert_eq!(percent_decoded("a%20b%C3%A9%zz%2"), "a bé%zz%2");
    }
}
