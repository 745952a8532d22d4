//! Settings with a story: one declaration of a record gives its type, its reader with errors that point at the
//! line, and its page in the reference.
//!
//! - [`record!`](crate::record) declares a table of settings, [`choices!`](crate::choices) a setting that is one
//!   of several words, [`variants!`](crate::variants) a table whose `type` says which keys it has.
//! - [`Table`] holds settings as they were written, in a scene file or on the command line.
//! - [`read`] turns a table into a record, or into [`Problems`].
//! - [`Docs`] collects the reference page.
//!
//! ```
//! use halflight_scene::schema::{self, Source, Table, positive};
//! halflight_scene::record! {
//!     /// How the paths are traced.
//!     pub struct PathSettings, "[technique.path]" {
//!         /// Scatterings of a path at most.
//!         #[example = "4"]
//!         max_depth: u32 = 8 => positive(),
//!         /// Largest value of a sample; off by default.
//!         #[unit = "radiance"]
//!         #[example = "10"]
//!         clamp: Option<f32>,
//!     }
//! }
//! let mut table = Table::parse(&Source::option("test", "max_depth = 4")).unwrap();
//! let settings: PathSettings = schema::read(&table).unwrap();
//! assert_eq!(settings.max_depth, 4);
//! table.assign("--set", "max_dept=3").unwrap();
//! let problems = schema::read::<PathSettings>(&table).unwrap_err();
//! assert!(problems.to_string().contains("did you mean `max_depth`?"));
//! ```

mod docs;
mod limits;
mod macros;
mod problem;
mod read;
mod source;
mod value;
mod values;

pub use docs::{ChoiceDoc, Docs, FieldDoc, escape};
pub use limits::{Limits, at_least, between, fraction, positive, within};
pub use problem::{Problem, Problems};
pub use read::{NoKeys, ReadValue, Reader, Record, Tagged, Variants, read};
pub use source::{Origin, Source};
pub use value::{Entry, Kind, Table, Value};
pub use values::{At, Color, FilePath};

/// The word that was probably meant.
#[doc(hidden)]
pub fn nearest<'a>(text: &str, words: &[&'a str]) -> Option<&'a str> {
    halflight_file::nearest_name(text, words.iter().copied())
}

/// A field's name without the mark that lets it be a keyword of Rust.
#[doc(hidden)]
pub const fn bare(name: &'static str) -> &'static str {
    match name.as_bytes() {
        [b'r', b'#', rest @ ..] => match str::from_utf8(rest) {
            Ok(rest) => rest,
            Err(_) => name,
        },
        _ => name,
    }
}
