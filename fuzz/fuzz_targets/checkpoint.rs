//! Checkpoints of a film of 19 × 5 pixels. The hash at the end is made right, or nothing behind it would be reached.

#![no_main]

use std::path::Path;

use halflight_render::checkpoint::{decode, fnv1a};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("fuzz.checkpoint");
    let _ = decode(bytes, name, "fuzz", 19, 5);
    if let Some((body, _)) = bytes.split_last_chunk::<8>() {
        let mut sound = body.to_vec();
        sound.extend(fnv1a(body).to_le_bytes());
        if let Ok(film) = decode(&sound, name, "fuzz", 19, 5) {
            assert_eq!((film.width(), film.height()), (19, 5));
        }
    }
});
