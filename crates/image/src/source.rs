//! The leash on foreign decoders: no allocation by a header's claim, no panic let through.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use halflight_file::LoadError;

/// The most pixels a picture may have: 4 GiB of floats, past what halflight is meant for.
const MAX_PIXELS: u128 = 1 << 28;

/// Pictures up to this size (8192 × 8192) may be of one colour, packed as well as their format can.
const FREE_PIXELS: u128 = 1 << 26;

/// Larger ones are packed at most this many times, as pictures of anything are; else a few megabytes could claim
/// minutes and all of the memory.
const LARGE_RATIO: u128 = 200;

/// Claims below this are never doubted: a small picture may be mostly header.
const SMALL_BYTES: u128 = 1 << 20;

/// The best that deflate can do: 258 bytes for two bits. JPEG's end-of-band runs and the run lengths inside
/// PIZ's Huffman codes stay below it.
pub(crate) const DEFLATE_RATIO: u64 = 1032;

/// Encoded bytes, and what to call them when something is wrong.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) name: &'a Path,
    pub(crate) asked: &'static str,
}

impl Source<'_> {
    pub(crate) fn error(&self, found: impl Into<String>) -> LoadError {
        LoadError::new(self.asked, self.name, found)
    }

    /// The error for a file that ends before its pixels do.
    pub(crate) fn cut_short(&self) -> LoadError {
        let found = format!("it ends after {} bytes, before all of its pixels", self.bytes.len());
        self.error(found).hint("the file is cut short: copy it again")
    }

    /// Refuses a picture that the bytes at hand cannot hold, before anything is allocated for it: `width × height`
    /// pixels of `bytes_per_pixel`, packed at most `ratio` times smaller than they are.
    pub(crate) fn check_size(
        &self,
        size: [u64; 2],
        bytes_per_pixel: u64,
        ratio: u64,
    ) -> Result<(), LoadError> {
        let [width, height] = size;
        if width == 0 || height == 0 {
            return Err(self.error(format!("the picture has no pixels: {width} × {height}")));
        }
        let pixels = u128::from(width) * u128::from(height);
        let room = self.bytes.len() as u128 * u128::from(ratio);
        if pixels > MAX_PIXELS {
            return Err(
                self.error(format!("the header claims {width} × {height} pixels; the limit is 2^28 of them"))
            );
        }
        let packed = self.bytes.len() as u128;
        if pixels > FREE_PIXELS && pixels * u128::from(bytes_per_pixel) > packed * LARGE_RATIO {
            let found = format!("the header claims {width} × {height} pixels in only {packed} bytes");
            return Err(self.error(found).hint(
                "a picture of more than 2^26 pixels may be packed at most 200 times; make it smaller",
            ));
        }
        if pixels * u128::from(bytes_per_pixel) > room.max(SMALL_BYTES) {
            let found = format!(
                "the header claims {width} × {height} pixels, more than {} bytes can hold",
                self.bytes.len()
            );
            return Err(self.error(found).hint("the file is damaged or cut short"));
        }
        Ok(())
    }

    /// Runs a foreign decoder; should it panic, the file was damaged in a way that its authors did not foresee.
    pub(crate) fn guarded<T>(&self, decode: impl FnOnce() -> Result<T, LoadError>) -> Result<T, LoadError> {
        quietly(decode).unwrap_or_else(|message| Err(self.panicked(&message)))
    }

    pub(crate) fn panicked(&self, message: &str) -> LoadError {
        self.error(format!("the decoder gave up: {message}")).hint("the file is damaged")
    }
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work` and turns a panic into its message, without a word on stderr.
///
/// The decoders of the `exr`, `image` and `tiff` crates check most of what they read, but arithmetic on sizes
/// from a damaged header still overflows here and there (fuzzing finds such places in each of them), and a
/// renderer must not end because of a picture. They hold no state that outlives a call, so unwinding out of
/// them leaves nothing half done.
pub(crate) fn quietly<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    // The message is printed by a hook that belongs to the whole process. Ours stands before whatever was
    // there, and passes on every panic but those of this function, on this thread.
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        if std::thread::panicking() {
            return;
        }
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !QUIET.get() {
                previous(info);
            }
        }));
    });
    let before = QUIET.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    QUIET.set(before);
    result.map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "a broken invariant".into())
    })
}
