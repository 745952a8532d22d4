//! Writes the seed of the fuzz target `checkpoint`: `cargo run -p halflight-render --example checkpoint_seed [FOLDER]`,
//! into `fuzz/corpus/checkpoint` unless told otherwise. To be run when the layout of a checkpoint changes.

use std::path::PathBuf;

use glam::Vec3;
use halflight_render::{Film, checkpoint};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/checkpoint");
    let corpus = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| corpus.into()));
    // The size and the identity that the fuzz target asks for.
    let mut film = Film::new(19, 5);
    for tile in film.tiles_mut() {
        for (i, pixel) in tile.pixels.iter_mut().enumerate() {
            pixel.add(Vec3::new(0.1 * i as f32, 0.7, 1e-20));
        }
        tile.non_finite = 3;
    }
    std::fs::create_dir_all(&corpus)?;
    checkpoint::save(&corpus.join("film"), "fuzz", &film)?;
    println!("wrote {}", corpus.join("film").display());
    Ok(())
}
