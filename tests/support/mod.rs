//! A folder with small assets, and the command run in it.

// Each test file uses its own part of this.
#![allow(dead_code)]

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use halflight::image::{Picture, RgbImage, save_hdr};
use serde_json::Value;

/// A scene of a ball that moves along x, 0.5 m a second, over a plane.
pub(crate) const SCENE: &str = r#"
description = "a ball on its way"

[image]
size = [48, 27]

[camera]
origin = [0, 1.2, 5]
target = [0, 0.5, 0]
vertical_fov_degrees = 35

[environment]
type = "sky"

[[shape]]
name = "ball"
type = "sphere"
radius = 0.5
material = { type = "diffuse", albedo = [0.7, 0.3, 0.2] }
keyframes = [
    { time = 0, translate = [-1, 0.5, 0] },
    { time = 4, translate = [1, 0.5, 0] },
]

[[shape]]
type = "plane"
material = { type = "diffuse", albedo = 0.5 }
"#;

/// An octahedron.
const MESH: &str = "ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element face 8
property list uchar int vertex_indices
end_header
1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1
3 0 2 4\n3 2 1 4\n3 1 3 4\n3 3 0 4\n3 2 0 5\n3 1 2 5\n3 3 1 5\n3 0 3 5
";

/// A folder that goes away with the test.
pub(crate) struct Place {
    folder: tempfile::TempDir,
}

/// What a run of the command said, and how it ended.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Place {
    /// With `scene.toml`, `bunny.ply` (an octahedron), `hall.hdr`.
    pub(crate) fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().expect("a folder for the test") };
        place.write("scene.toml", SCENE);
        place.write("bunny.ply", MESH);
        let hall = RgbImage::from_fn(16, 8, |x, y| [0.2 + x as f32 / 16.0, 0.5, 0.2 + y as f32 / 8.0]);
        save_hdr(&place.path("hall.hdr"), &hall).expect("the hall is written");
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a file of the test is written");
    }

    /// Names of all files below the folder `name`.
    pub(crate) fn files(&self, name: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(name)).expect("the folder is there");
        let mut names: Vec<String> =
            entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs `halflight` with arguments as a shell would split them.
    pub(crate) fn run(&self, line: &str) -> Outcome {
        let output = self.command(&words(line)).output().expect("the command runs");
        Outcome {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Runs it and expects it to be done.
    pub(crate) fn done(&self, line: &str) -> Outcome {
        let outcome = self.run(line);
        assert_eq!(outcome.code, 0, "{line}: {outcome:?}");
        outcome
    }

    /// Starts it and goes on.
    pub(crate) fn start(&self, line: &str) -> Child {
        let mut command = self.command(&words(line));
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
    }

    fn command(&self, arguments: &[String]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
        command.current_dir(self.folder.path()).args(arguments).stdin(Stdio::null());
        command
    }

    /// The picture of that name.
    pub(crate) fn exr(&self, name: &str) -> Picture {
        Picture::load_exr(&self.path(name)).expect("the picture can be read")
    }
}

impl Outcome {
    /// The JSON objects on stdout.
    pub(crate) fn events(&self) -> Vec<Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).expect("every line is JSON")).collect()
    }

    /// The first event of a name.
    pub(crate) fn event(&self, name: &str) -> Value {
        self.events()
            .into_iter()
            .find(|event| event["event"] == name)
            .unwrap_or_else(|| panic!("no {name}: {self:?}"))
    }
}

/// The bits of all channels, metadata aside.
pub(crate) fn bits(picture: &Picture) -> Vec<(String, Vec<u32>)> {
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect();
    picture.channels.iter().map(|channel| (channel.name.clone(), bits(&channel.values))).collect()
}

/// Splits at spaces outside double quotes.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in line.split('"').enumerate() {
        if index % 2 == 1 {
            words.push(part.to_string());
        } else {
            words.extend(part.split_whitespace().map(str::to_string));
        }
    }
    words
}

/// Sends a signal to a child, by its name without `SIG`.
pub(crate) fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").arg(format!("-{name}")).arg(child.id().to_string()).status();
    assert!(status.expect("kill runs").success());
}
