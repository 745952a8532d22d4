//! Renders that are cut short, and go on.

mod support;

use std::time::{Duration, Instant};

use support::{Place, bits, signal};

#[test]
fn a_resumed_render_has_the_bits_of_an_uninterrupted_one() {
    let place = Place::new();
    place.done("render scene.toml --spp 11 -o whole.exr");
    place.done("render scene.toml --spp 5 -o part.exr --checkpoint film");
    place.done("render scene.toml --spp 11 -o part.exr --checkpoint film --resume");
    assert!(bits(&place.exr("whole.exr")) == bits(&place.exr("part.exr")));
    assert_eq!(place.exr("part.exr").metadata["samples"], "11");
}

#[test]
fn a_checkpoint_of_another_render_is_refused_and_a_missing_one_begins() {
    let place = Place::new();
    let outcome = place.done("render scene.toml --spp 2 -o out.exr --checkpoint film --resume");
    assert!(outcome.stderr.contains("starting from the beginning"), "{outcome:?}");
    for change in [
        "--seed 3",
        "--max-depth 2",
        "--frame 9",
        "--size 40x30",
        "--simd baseline",
        "--set camera.aperture_radius=0.1",
    ] {
        let outcome =
            place.run(&format!("render scene.toml --spp 4 -o new.exr --checkpoint film --resume {change}"));
        assert_eq!(outcome.code, 1, "{change}: {outcome:?}");
        assert!(outcome.stderr.contains("belongs to"), "{change}: {outcome:?}");
    }
    assert!(!place.path("new.exr").exists());
    place.write("film", "not a checkpoint");
    assert_eq!(place.run("render scene.toml --spp 4 -o new.exr --checkpoint film --resume").code, 1);
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_samples_and_the_render_can_go_on() {
    let place = Place::new();
    let line = "render scene.toml --size 160x90 --seed 2 -o out.exr --checkpoint film --checkpoint-every 0.1";
    let child = place.start(&format!("{line} --spp 1000000"));
    wait_for(&place, "film");
    let asked = Instant::now();
    signal(&child, "INT");
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(asked.elapsed() < Duration::from_secs(30));
    assert!(stderr.contains("interrupted: wrote out.exr with"), "{stderr}");
    let samples = place.exr("out.exr").channel("samples").unwrap().to_vec();
    let most = samples.iter().copied().fold(0.0, f32::max) as u32;
    assert!(samples.iter().all(|&s| s > 0.0) && most < 1_000_000);
    // Gone on with to a round number, it is as if nothing had happened.
    let goal = most + 1;
    place.done(&format!("{line} --spp {goal} --resume"));
    place.done(&format!("render scene.toml --size 160x90 --seed 2 -o whole.exr --spp {goal}"));
    assert!(bits(&place.exr("out.exr")) == bits(&place.exr("whole.exr")));
}

#[cfg(unix)]
#[test]
fn a_request_to_terminate_is_an_interrupt_too() {
    let place = Place::new();
    let child = place.start(
        "render scene.toml --size 160x90 --spp 1000000 -o out.png --checkpoint film --checkpoint-every 0.1 --json",
    );
    wait_for(&place, "film");
    signal(&child, "TERM");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(place.path("out.png").exists());
    assert!(String::from_utf8_lossy(&output.stdout).contains("\"interrupted\":true"));
}

#[test]
fn a_sequence_goes_on_with_the_frame_it_stopped_at() {
    let place = Place::new();
    // As if the sequence had been cut short in its second frame.
    place.done("render scene.toml --spp 2 --frame 2 -o s.0002.exr --checkpoint film");
    place.done("render scene.toml --spp 4 --frames 1..3 -o s.exr --checkpoint film --resume");
    assert!(!place.path("s.0001.exr").exists());
    for frame in [2, 3] {
        place.done(&format!("render scene.toml --spp 4 --frame {frame} -o still.exr"));
        assert!(bits(&place.exr("still.exr")) == bits(&place.exr(&format!("s.000{frame}.exr"))), "{frame}");
    }
}

/// The limit on the size of files leaves room for the picture (below 13 kB) and none for the checkpoint (147 kB).
#[cfg(unix)]
#[test]
fn a_disk_too_full_for_the_checkpoint_still_gets_the_picture() {
    let place = Place::new();
    let script = format!(
        "ulimit -f 60; exec '{}' render scene.toml --size 64x64 --spp 4 -o out.png --checkpoint film",
        env!("CARGO_BIN_EXE_halflight")
    );
    let output =
        std::process::Command::new("sh").arg("-c").arg(script).current_dir(place.path("")).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(
        stderr.contains("cannot write the checkpoint film") && stderr.contains("wrote out.png"),
        "{stderr}"
    );
    assert!(place.path("out.png").exists() && !place.path("film").exists());
}

fn wait_for(place: &Place, name: &str) {
    let start = Instant::now();
    while !place.path(name).exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{name} does not appear");
        std::thread::sleep(Duration::from_millis(20));
    }
}
