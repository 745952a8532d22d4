//! Every example of the help texts runs as it stands.

mod support;

use support::Place;

/// The commands of the help, from its list of subcommands.
fn subcommands(place: &Place) -> Vec<String> {
    let help = place.done("help").stdout;
    let list = help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let names =
        list.take_while(|line| !line.trim().is_empty()).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_string).collect()
}

fn examples(help: &str) -> Vec<&str> {
    let lines = help.lines().skip_while(|line| !line.starts_with("Examples:"));
    lines.filter_map(|line| line.strip_prefix("  halflight ")).collect()
}

#[test]
fn every_example_of_every_help_text_runs() {
    let place = Place::new();
    // What the examples expect to find.
    place.done("render scene.toml --spp 16 -o noisy.exr");
    place.done("render scene.toml --spp 64 --seed 1 -o truth.exr");
    place.done("render scene.toml --spp 1 --tile 1/2 -o half.exr");
    place.done("render scene.toml --spp 1 --tile 2/2 -o half.exr");
    place.done("brdf synth diffuse -o paint.binary");
    place.done("sh project hall.hdr -o light.json");
    place.done("spheres fit bunny.ply -n 3");
    place.done("ddf train bunny.ply --steps 2");
    let commands = subcommands(&place);
    assert!(commands.len() >= 7, "{commands:?}");
    let mut lines: Vec<String> =
        examples(&place.done("--help").stdout).into_iter().map(str::to_string).collect();
    for command in &commands {
        let help = place.done(&format!("{command} --help")).stdout;
        let found = examples(&help);
        assert!(!found.is_empty(), "{command} has no example");
        lines.extend(found.into_iter().map(str::to_string));
    }
    lines.sort();
    lines.dedup();
    for line in &lines {
        place.done(&quick(line));
    }
}

/// Pictures are made small and with few samples where the example does not say otherwise.
fn quick(line: &str) -> String {
    let renders = line.starts_with("render") || (line.starts_with("demo") && !line.contains("--list"));
    let size = if renders && !line.contains("--size") { " --size 48x27" } else { "" };
    let samples = if renders && !line.contains("--spp") { " --spp 2" } else { "" };
    format!("{line}{size}{samples}")
}
