//! What the page asks for and what it is told.
//!
//! The page sends JSON texts, each one [`Ask`]; and binary messages for files that were dropped on it. It gets JSON texts
//! (`{"kind": "state", …}`, `"error"`, `"explain"`), and binary messages. Binary messages are four bytes with the length
//! of a JSON header (little endian), the header, and the bytes of a picture or of files, one after the other. The header of
//! files is [`Files`].

use serde::{Deserialize, Serialize};

/// Bytes of a text at most.
pub const MAX_TEXT: usize = 16 * 1024;
/// Bytes of a dropped file at most.
pub const MAX_FILE: usize = 64 << 20;

/// One wish of a person at the page.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Ask {
    /// Turn the eye about what it looks at: parts of the picture's height to the right and down.
    Orbit {
        /// To the right.
        x: f64,
        /// Down.
        y: f64,
    },
    /// Move the eye sideways: parts of the picture's height.
    Pan {
        /// To the right.
        x: f64,
        /// Down.
        y: f64,
    },
    /// Come nearer: by this factor of the distance, below 1 for nearer.
    Dolly {
        /// The factor.
        by: f64,
    },
    /// Go: to the right, up and forwards, in parts of the distance to what is looked at.
    Fly {
        /// To the right, up, forwards.
        by: [f64; 3],
    },
    /// Look around without moving.
    Look {
        /// To the right, in parts of the picture's height.
        x: f64,
        /// Down.
        y: f64,
    },
    /// Back to the camera of the scene, which moves as the scene says.
    Home {},
    /// Everything in view.
    Frame {},
    /// Vertical field of view.
    FieldOfView {
        /// From the bottom to the top edge.
        degrees: f64,
    },
    /// Radius of the lens.
    Aperture {
        /// In metres; 0 for a pinhole.
        radius: f64,
    },
    /// Focus on what is seen at a place of the picture.
    Focus {
        /// From 0 at the left to 1.
        x: f64,
        /// From 0 at the top to 1.
        y: f64,
    },
    /// Another moment.
    Time {
        /// Of the scene.
        seconds: f64,
    },
    /// Run or hold.
    Play {
        /// Whether time runs.
        on: bool,
    },
    /// Turn the environment about the vertical.
    Environment {
        /// From where the scene has it.
        degrees: f64,
    },
    /// Move an object.
    Move {
        /// Its name in the scene.
        object: String,
        /// From where the scene has it, in metres.
        by: [f32; 3],
    },
    /// Exposure.
    Exposure {
        /// In stops.
        ev: f64,
    },
    /// Tone curve.
    Tone {
        /// Filmic, or plain sRGB.
        filmic: bool,
    },
    /// Another technique on one side.
    Technique {
        /// Which side.
        side: Side,
        /// Its name.
        name: String,
    },
    /// A setting of the technique of a side.
    Set {
        /// Which side.
        side: Side,
        /// The key.
        key: String,
        /// As in a scene file.
        value: String,
    },
    /// A stored picture on the right side, in place of a technique.
    Reference {
        /// A name of the list.
        name: String,
    },
    /// Two sides, or one.
    Compare {
        /// Whether there are two.
        on: bool,
    },
    /// Another layer: `color`, or one of the names in the state.
    Layer {
        /// Its name.
        name: String,
    },
    /// The size of the picture at rest.
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Why a pixel is as it is.
    Explain {
        /// From 0 at the left to 1.
        x: f64,
        /// From 0 at the top to 1.
        y: f64,
        /// Which side is asked.
        #[serde(default)]
        side: Side,
    },
    /// Send a file: `exr` with all layers, or `png`.
    Save {
        /// Its kind.
        format: String,
    },
    /// Write a copy of the scene with this camera and these settings.
    Keep {},
    /// Open another scene of the list.
    Open {
        /// Its name.
        name: String,
    },
    /// Swap the light for the one given; empty for the scene's own.
    Swap {
        /// A name of the list: `sky`, `studio`, `black`, or a file.
        #[serde(default)]
        environment: String,
    },
    /// Swap the material of an object for the one given; empty for the scene's own.
    Material {
        /// Its name in the scene.
        object: String,
        /// A material as the command line takes it.
        material: String,
    },
    /// Take the controls from whoever has them.
    Control {},
}

/// A side of the picture.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left one, and the only one when nothing is compared.
    #[default]
    A,
    /// The right one.
    B,
}

/// A text that is no wish.
pub(crate) fn parse(text: &str) -> Result<Ask, String> {
    if text.len() > MAX_TEXT {
        return Err(format!("a message of {} bytes is too long", text.len()));
    }
    let ask: Ask =
        serde_json::from_str(text).map_err(|error| format!("the message was not understood: {error}"))?;
    if !ask.is_finite() {
        return Err("the message holds a number that is not finite".into());
    }
    Ok(ask)
}

impl Ask {
    fn is_finite(&self) -> bool {
        match self {
            Ask::Orbit { x, y }
            | Ask::Pan { x, y }
            | Ask::Look { x, y }
            | Ask::Focus { x, y }
            | Ask::Explain { x, y, .. } => x.is_finite() && y.is_finite(),
            Ask::Dolly { by } => by.is_finite(),
            Ask::Fly { by } => by.iter().all(|x| x.is_finite()),
            Ask::Move { by, .. } => by.iter().all(|x| x.is_finite()),
            Ask::FieldOfView { degrees } | Ask::Environment { degrees } => degrees.is_finite(),
            Ask::Aperture { radius } => radius.is_finite(),
            Ask::Time { seconds } => seconds.is_finite(),
            Ask::Exposure { ev } => ev.is_finite(),
            _ => true,
        }
    }

    /// Whether somebody without the controls may ask it.
    pub(crate) fn only_looks(&self) -> bool {
        matches!(self, Ask::Explain { .. } | Ask::Save { .. } | Ask::Control {})
    }
}

/// What the header of dropped files says.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub(crate) struct Files {
    /// Names and lengths; the first that can be shown is opened, the others are what it names.
    files: Vec<(String, usize)>,
    /// Whether the file is a picture to compare with.
    #[serde(default)]
    pub(crate) reference: bool,
}

/// Files of one drop at most, and bytes of a name.
const MAX_FILES: usize = 64;
const MAX_NAME: usize = 255;
/// Bytes around files: the header with their names.
pub(crate) const MAX_AROUND: usize = MAX_FILES * (MAX_NAME + 32);

/// Files of one drop, by their names.
pub(crate) type Dropped = Vec<(String, Vec<u8>)>;

/// Takes a message with files apart.
pub(crate) fn unpack(bytes: &[u8]) -> Result<(Files, Dropped), String> {
    let wrong = |what: &str| format!("the files did not arrive whole: {what}");
    let (length, rest) = bytes.split_first_chunk().ok_or_else(|| wrong("there is no header"))?;
    let length = u32::from_le_bytes(*length) as usize;
    if length > MAX_AROUND || length > rest.len() {
        return Err(wrong("the header is too long"));
    }
    let (header, mut rest) = rest.split_at(length);
    let header: Files = serde_json::from_slice(header).map_err(|error| wrong(&error.to_string()))?;
    if header.files.is_empty() || header.files.len() > MAX_FILES {
        return Err(format!("between one and {MAX_FILES} files can be dropped together"));
    }
    let mut files = Vec::with_capacity(header.files.len());
    for (name, length) in &header.files {
        if name.is_empty() || name.len() > MAX_NAME {
            return Err("a file has no name, or too long a one".into());
        }
        let (file, after) = rest.split_at_checked(*length).ok_or_else(|| wrong("bytes are missing"))?;
        files.push((name.clone(), file.to_vec()));
        rest = after;
    }
    if rest.is_empty() { Ok((header, files)) } else { Err(wrong("there are too many bytes")) }
}

/// A picture or a file with its header, as it is sent.
pub(crate) fn pack(header: &serde_json::Value, bytes: &[u8]) -> Vec<u8> {
    let header = header.to_string();
    let mut packed = Vec::with_capacity(4 + header.len() + bytes.len());
    packed.extend_from_slice(&(header.len() as u32).to_le_bytes());
    packed.extend_from_slice(header.as_bytes());
    packed.extend_from_slice(bytes);
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read() {
        assert_eq!(parse(r#"{"do":"orbit","x":0.5,"y":-1}"#), Ok(Ask::Orbit { x: 0.5, y: -1.0 }));
        assert_eq!(
            parse(r#"{"do":"technique","side":"b","name":"path"}"#),
            Ok(Ask::Technique { side: Side::B, name: "path".into() })
        );
        assert_eq!(parse(r#"{"do":"field-of-view","degrees":40}"#), Ok(Ask::FieldOfView { degrees: 40.0 }));
    }

    #[test]
    fn everything_else_is_refused_with_a_reason() {
        let long = format!(r#"{{"do":"open","name":"{}"}}"#, "x".repeat(MAX_TEXT));
        for text in [
            "",
            "{}",
            "[]",
            "null",
            r#"{"do":"fly"}"#,
            r#"{"do":"orbit","x":1}"#,
            r#"{"do":"orbit","x":1,"y":1e999}"#,
            r#"{"do":"orbit","x":1,"y":2,"z":3}"#,
            r#"{"do":"move","object":"a","by":[1e39,0,0]}"#,
            r#"{"do":"keep","x":1}"#,
            r#"{"do":"home","x":1}"#,
            r#"{"do":"frame","x":1}"#,
            r#"{"do":"control","x":1}"#,
            &long,
        ] {
            assert!(parse(text).is_err(), "{text:.60}");
        }
    }

    #[test]
    fn files_are_taken_apart_and_torn_ones_refused() {
        let header = serde_json::json!({ "files": [["a.obj", 2], ["a.mtl", 3]] });
        let whole = pack(&header, b"xxyyy");
        let (_, files) = unpack(&whole).unwrap();
        assert_eq!(files, [("a.obj".into(), b"xx".to_vec()), ("a.mtl".into(), b"yyy".to_vec())]);
        for cut in 0..whole.len() {
            assert!(unpack(&whole[..cut]).is_err(), "{cut}");
        }
        assert!(unpack(&pack(&header, b"xxyyyz")).is_err());
        assert!(unpack(&pack(&serde_json::json!({ "files": [] }), b"")).is_err());
        assert!(unpack(&pack(&serde_json::json!({ "files": [["a", usize::MAX]] }), b"")).is_err());
        assert!(unpack(&[255; 8]).is_err());
    }
}
