//! The reference page is what the types say.

#[test]
fn the_page_in_docs_is_what_the_types_say() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene-format.md");
    let page = std::fs::read_to_string(path).expect("the page is there");
    assert!(
        page == halflight_scene::spec::scene_format_markdown(),
        "docs/scene-format.md is stale: run `cargo run -p halflight-scene --example scene_format`"
    );
}
