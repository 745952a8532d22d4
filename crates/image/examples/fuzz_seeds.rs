//! Writes the seeds of the picture formats for the fuzzers: `cargo run -p halflight-image --example fuzz_seeds [FOLDER]`,
//! into `fuzz/corpus` unless told otherwise. To be run when a format or its writer changes.

#[path = "../tests/seeds/mod.rs"]
mod seeds;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus");
    let corpus = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| corpus.into()));
    for seed in seeds::all() {
        let folder = corpus.join(seed.target);
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join(seed.name), seed.bytes)?;
    }
    println!("wrote the seeds of {} formats into {}", seeds::FORMATS.len(), corpus.display());
    Ok(())
}
