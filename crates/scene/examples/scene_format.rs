//! Writes the reference page of the scene format: `cargo run -p halflight-scene --example scene_format`.

fn main() -> std::io::Result<()> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene-format.md");
    std::fs::write(path, halflight_scene::spec::scene_format_markdown())
}
