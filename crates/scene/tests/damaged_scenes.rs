//! No text makes the reader of scene files panic, hang or allocate without measure.

use std::path::Path;

use halflight_scene::Scene;

const SCENE: &str = include_str!("../../../tests/reference/hf25_coneman.toml");
const OTHER: &str = include_str!("../../../tests/reference/bunny_merlfile.toml");

/// Marsaglia's xorshift: the same texts on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

fn read(text: &str) {
    if let Err(error) = Scene::parse(text, Path::new("scene.toml")) {
        // The report must be printable too, wherever the trouble is.
        assert!(!error.to_string().is_empty());
    }
}

#[test]
fn a_scene_cut_off_anywhere_is_read_or_refused() {
    for end in (0..OTHER.len()).filter(|&end| OTHER.is_char_boundary(end)) {
        read(&OTHER[..end]);
    }
}

#[test]
fn a_scene_with_random_damage_is_read_or_refused() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let pieces = [
        "[",
        "]",
        "{",
        "}",
        "=",
        ".",
        "\"",
        "nan",
        "-inf",
        "1e999",
        "'''",
        "\n",
        "#",
        "é",
        "\0",
        "[[",
        "true",
        "9999999999999999999",
        "time",
        "\u{feff}",
    ];
    for _ in 0..4000 {
        let mut text = if random.below(2) == 0 { SCENE.to_string() } else { OTHER.to_string() };
        for _ in 0..1 + random.below(4) {
            let boundary = |mut at: usize, text: &str| {
                while !text.is_char_boundary(at) {
                    at -= 1;
                }
                at
            };
            let start = boundary(random.below(text.len() + 1), &text);
            let end = boundary((start + random.below(12)).min(text.len()), &text).max(start);
            match random.below(3) {
                0 => text.replace_range(start..end, ""),
                1 => text.insert_str(start, pieces[random.below(pieces.len())]),
                _ => text.replace_range(start..end, pieces[random.below(pieces.len())]),
            }
        }
        read(&text);
    }
}

#[test]
fn deep_nesting_is_refused_instead_of_overflowing_the_stack() {
    let deep = 100_000;
    for text in [
        format!("{}b = 1", "a.".repeat(deep)),
        format!("[{}b]", "a.".repeat(deep)),
        format!("a = {}", "[".repeat(deep)),
        format!("a = {}", "{a=".repeat(deep)),
        format!("a = {}", "{a.a.a.a.a.a.a.a=".repeat(200)),
        format!("\"x\".'y'.{}b = 1", "\"a\".".repeat(deep)),
    ] {
        assert!(Scene::parse(&text, Path::new("scene.toml")).is_err());
    }
}

#[test]
fn bytes_that_are_no_text_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, b"[camera]\n\xff\xfe").expect("written");
    let error = Scene::load(&path, &halflight_scene::LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("UTF-8"), "{error}");
}
