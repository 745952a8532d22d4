//! Makes the moving models of the demo scenes: `cargo run --release -p halflight-shape --example demo_models [FOLDER]`.
//!
//! | model | what it is |
//! |---|---|
//! | `cone-man.glb` | a figure of cones that walks over the land of `cone-man.toml`, its feet held to the ground |
//! | `whale.glb` | a whale that leaps over the sea |
//! | `cannonballs.glb` | 385 balls that a wrecking ball strikes: the nodes are the balls |
//! | `wrecking-ball.glb` | that ball and its chain of 16 |
//! | `soft-sun.hdr` | the light of all three scenes: four bands of spherical harmonics hold it exactly |
//!
//! It prints the path of the wrecking ball, which the ground of `wrecking-ball.toml` is dented by. The same bytes come
//! out each time on one machine; the committed files are what the scenes are shown with.

mod balls;
mod cone_man;
mod glb;
mod soft_sun;
mod surface;
mod whale;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/models")),
        PathBuf::from,
    );
    std::fs::create_dir_all(&folder)?;
    glb::write(&folder.join("cone-man.glb"), &cone_man::scene())?;
    glb::write(&folder.join("whale.glb"), &whale::scene())?;
    soft_sun::write(&folder.join("soft-sun.hdr"))?;
    let (pile, wrecker, path) = balls::scenes();
    glb::write(&folder.join("cannonballs.glb"), &pile)?;
    glb::write(&folder.join("wrecking-ball.glb"), &wrecker)?;
    println!("path = [");
    for (time, place) in path {
        println!("    [{time:.3}, {:.3}, {:.3}, {:.3}],", place.x, place.y, place.z);
    }
    println!("]");
    Ok(())
}
