//! What the page asks for and what it is told.
//!
//! The page sends JSON texts, each one [`Ask`]; and a binary message for a file that was dropped on it: its name, a zero
//! byte, its bytes. It gets JSON texts (`{"kind": "state", …}`, `"error"`, `"explain"`), and binary messages: four
//! bytes with the length of a JSON header (little endian), the header, and the bytes of a picture or a file.

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
    /// Back to the camera of the scene.
    Home,
    /// Everything in view.
    Frame,
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
    },
    /// Send a file: `exr` with all layers, or `png`.
    Save {
        /// Its kind.
        format: String,
    },
    /// Write a copy of the scene with this camera and these settings.
    Keep,
    /// Open another scene of the list.
    Open {
        /// Its name.
        name: String,
    },
    /// Swap the light or the material for those given; empty for the scene's own.
    Swap {
        /// A name of the list: `sky`, `studio`, `black`, or a file.
        #[serde(default)]
        environment: String,
        /// A material as the command line takes it.
        #[serde(default)]
        material: String,
    },
    /// Take the controls from whoever has them.
    Control,
}

/// A side of the picture.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left one, and the only one when nothing is compared.
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
            | Ask::Explain { x, y } => x.is_finite() && y.is_finite(),
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
        matches!(self, Ask::Explain { .. } | Ask::Save { .. } | Ask::Control)
    }
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
            &long,
        ] {
            assert!(parse(text).is_err(), "{text:.60}");
        }
    }
}
