//! The examples that stand below each command's help. A test runs every one of them.

/// A command line that can be run as it stands, given a scene, a few assets and two pictures.
pub(crate) struct Example {
    /// The subcommand whose help shows it.
    pub(crate) command: &'static str,
    /// What it is good for.
    pub(crate) about: &'static str,
    /// What to type.
    pub(crate) line: &'static str,
}

const fn example(command: &'static str, about: &'static str, line: &'static str) -> Example {
    Example { command, about, line }
}

/// All examples, in the order in which help shows them.
pub(crate) const EXAMPLES: &[Example] = &[
    example("halflight", "Look at the first demo scene", "halflight demo -o demo.png"),
    example("halflight", "Render a mesh that you have", "halflight render bunny.ply -o bunny.png"),
    example("halflight", "Find out what a file holds", "halflight info bunny.ply"),
    example(
        "render",
        "A mesh under a map of a place",
        "halflight render bunny.ply --environment hall.hdr -o bunny.png",
    ),
    example("render", "All layers, for compositing", "halflight render scene.toml --spp 256 -o scene.exr"),
    example(
        "render",
        "Twelve frames of an animation",
        "halflight render scene.toml --frames 1..12 --fps 12 --size 320x180 -o frames/out.####.png",
    ),
    example(
        "render",
        "Until it is good enough, and safe against a power cut",
        "halflight render scene.toml --error 0.02 --checkpoint scene.checkpoint --resume -o scene.exr",
    ),
    example(
        "render",
        "Another material, and direct light only",
        "halflight render bunny.ply --material \"phong exponent=40\" --max-depth 1 -o shiny.png",
    ),
    example(
        "render",
        "A quarter of a picture, on one machine of four",
        "halflight render scene.toml --spp 8 --size 320x180 --tile 1/4 -o big.exr",
    ),
    example(
        "merge",
        "Both halves of a picture",
        "halflight merge half.tile1of2.exr half.tile2of2.exr -o half.png",
    ),
    example(
        "compare",
        "How far is a picture from the truth?",
        "halflight compare noisy.exr truth.exr -o report",
    ),
    example(
        "compare",
        "A check for scripts",
        "halflight compare noisy.exr truth.exr --fail-above relmse=0.5",
    ),
    example(
        "compare",
        "Settings against each other over several budgets",
        "halflight compare scene.toml -t path -t path:max_depth=1 --reference path --spp 1,4,16 --reference-spp 64 -o report",
    ),
    example("info", "A mesh", "halflight info bunny.ply"),
    example("info", "A picture, for programs", "halflight info truth.exr --json"),
    example(
        "brdf",
        "A brushed metal, measured by calculation",
        "halflight brdf synth \"conductor roughness=0.3\" -o metal.binary",
    ),
    example("brdf", "What a measured material is like", "halflight brdf info paint.binary"),
    example("sh", "Sixteen coefficients of a map", "halflight sh project hall.hdr --order 4 -o light.json"),
    example(
        "sh",
        "A quarter turn about the vertical",
        "halflight sh rotate light.json --degrees 90 -o turned.json",
    ),
    example("sh", "For another library", "halflight sh convert light.json --to directxmath"),
    example("sh", "What is left of the light", "halflight sh show light.json -o light.png"),
    example("ddf", "Learn a mesh", "halflight ddf train bunny.ply --steps 20 -o small.ddf"),
    example("ddf", "How good the field is", "halflight ddf eval bunny.ddf bunny.ply"),
    example("ddf", "Render with it in place of its mesh", "halflight render bunny.ddf --spp 4 -o bunny.png"),
    example("ddf", "See it beside its mesh", "halflight ddf render bunny.ddf bunny.ply -o field.png"),
    example("spheres", "25 spheres for a mesh", "halflight spheres fit bunny.ply -n 25 -o small.spheres"),
    example("spheres", "How good they are", "halflight spheres check bunny.ply bunny.spheres"),
    example(
        "spheres",
        "What they look like",
        "halflight spheres show bunny.spheres bunny.ply -o spheres.png",
    ),
    example("demo", "Which scenes there are", "halflight demo --list"),
    example("demo", "One of them, small", "halflight demo cornell-box --size 160x160 --spp 8 -o cornell.png"),
    example(
        "view",
        "Two seconds of a scene in the browser",
        "halflight view scene.toml --seconds 2 --no-browser --port 0",
    ),
    example("explain", "Why a pixel is shaded as it is", "halflight explain scene.toml --pixel 20,12"),
    example("bench", "Rays per second on a mesh made for it", "halflight bench rays --quick"),
    example("completions", "For bash", "halflight completions bash"),
];

/// What help shows below the options of a command.
pub(crate) fn after_help(command: &str) -> String {
    let mut text = String::from("Examples:");
    for example in EXAMPLES.iter().filter(|e| e.command == command) {
        text += &format!("\n  # {}\n  {}", example.about, example.line);
    }
    if command == "halflight" {
        text += "\n\nExit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted (the picture holds the samples there were)";
    }
    text
}
