//! Scenes that are built in, made of nothing but formulas.

use std::path::Path;

use halflight_file::{nearest_name, write_whole};

use crate::job::JobError;

/// A scene that is part of the program.
#[derive(Clone, Copy, Debug)]
pub struct Demo {
    /// What it is called: `still-life`.
    pub name: &'static str,
    /// The scene file.
    text: &'static str,
    /// What renders it when the demo is asked for.
    technique: &'static str,
    /// Files that it names: paths below the scene file's folder, and what they hold.
    files: &'static [(&'static str, &'static [u8])],
}

/// A scene file that names no others.
const fn path_traced(name: &'static str, text: &'static str) -> Demo {
    Demo { name, text, technique: "path", files: &[] }
}

/// A scene file that names no others, for the technique `covariance`.
const fn covariant(name: &'static str, text: &'static str) -> Demo {
    Demo { name, text, technique: "covariance", files: &[] }
}

/// A model beside the scene files.
macro_rules! model {
    ($name:literal) => {
        (concat!("models/", $name), include_bytes!(concat!("../scenes/models/", $name)).as_slice())
    };
}

/// The light of the scenes that harmonics are for.
const SOFT_SUN: (&str, &[u8]) = model!("soft-sun.hdr");

/// The scenes; the first is what `halflight demo` renders.
pub const DEMOS: &[Demo] = &[
    path_traced("still-life", include_str!("../scenes/still-life.toml")),
    path_traced("terrain", include_str!("../scenes/terrain.toml")),
    path_traced("cornell-box", include_str!("../scenes/cornell-box.toml")),
    path_traced("depth-of-field", include_str!("../scenes/depth-of-field.toml")),
    path_traced("moving", include_str!("../scenes/moving.toml")),
    covariant("wheel", include_str!("../scenes/wheel.toml")),
    covariant("glossy-floor", include_str!("../scenes/glossy-floor.toml")),
    covariant("caustic-glass", include_str!("../scenes/caustic-glass.toml")),
    covariant("fog-lamp", include_str!("../scenes/fog-lamp.toml")),
    Demo {
        name: "two-mirrors",
        text: include_str!("../scenes/two-mirrors.toml"),
        technique: "covariance",
        files: &[model!("mosaic.png")],
    },
    Demo {
        name: "wrecking-ball",
        text: include_str!("../scenes/wrecking-ball.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("cannonballs.glb"), model!("wrecking-ball.glb")],
    },
    Demo {
        name: "whale-in-the-ocean",
        text: include_str!("../scenes/whale-in-the-ocean.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("whale.glb")],
    },
    Demo {
        name: "cone-man",
        text: include_str!("../scenes/cone-man.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("cone-man.glb")],
    },
    Demo {
        name: "three-paints",
        text: include_str!("../scenes/three-paints.toml"),
        technique: "bandwidth",
        files: &[model!("marble.png")],
    },
    Demo {
        name: "lamp-lit",
        text: include_str!("../scenes/lamp-lit.toml"),
        technique: "bandwidth",
        files: &[],
    },
    Demo {
        name: "red-whale",
        text: include_str!("../scenes/red-whale.toml"),
        technique: "bandwidth",
        files: &[model!("whale.glb")],
    },
    Demo {
        name: "three-figures",
        text: include_str!("../scenes/three-figures.toml"),
        technique: "bandwidth",
        files: &[model!("marble.png")],
    },
    Demo {
        name: "car-body",
        text: include_str!("../scenes/car-body.toml"),
        technique: "bandwidth",
        files: &[],
    },
    Demo {
        name: "hammered",
        text: include_str!("../scenes/hammered.toml"),
        technique: "bandwidth",
        files: &[model!("hammered.png"), model!("marble.png")],
    },
];

/// Before the name of a demo, wherever a scene file is expected: `demo:still-life`.
pub const PREFIX: &str = "demo:";
/// The scene file that is built in under a name such as `demo:still-life`; `None` for ordinary paths.
///
/// # Errors
/// A demo that there is not.
pub fn built_in(path: &Path) -> Result<Option<&'static Demo>, JobError> {
    match path.to_str().and_then(|text| text.strip_prefix(PREFIX)) {
        Some(name) => named(name).map(Some),
        None => Ok(None),
    }
}

/// The demo of that name.
///
/// # Errors
/// If there is none; the nearest is offered.
pub fn named(name: &str) -> Result<&'static Demo, JobError> {
    DEMOS.iter().find(|demo| demo.name == name).ok_or_else(|| {
        let names = || DEMOS.iter().map(|demo| demo.name);
        let hint = match nearest_name(name, names()) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("there are {}", names().collect::<Vec<_>>().join(", ")),
        };
        JobError::usage(format!("there is no demo scene {name:?} ({hint})"))
    })
}

impl Demo {
    /// Writes the scene file to a path, and the files that it names beside it.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn unpack(&self, path: &Path) -> Result<(), JobError> {
        self.unpack_files(path.parent().unwrap_or_else(|| Path::new("")))?;
        write_whole(path, "scene file", |writer| std::io::Write::write_all(writer, self.text.as_bytes()))?;
        Ok(())
    }

    /// The text of the scene file.
    pub fn text(&self) -> &'static str {
        self.text
    }

    /// What renders it when the demo is asked for.
    pub fn technique(&self) -> &'static str {
        self.technique
    }

    /// Writes the files that the scene names into a folder.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn unpack_files(&self, folder: &Path) -> Result<(), JobError> {
        for (name, bytes) in self.files {
            let file = folder.join(name);
            let made = file.parent().map_or(Ok(()), std::fs::create_dir_all);
            made.map_err(|e| JobError::failed(format!("cannot make a folder for {}: {e}", file.display())))?;
            write_whole(&file, "model", |writer| std::io::Write::write_all(writer, bytes))?;
        }
        Ok(())
    }

    /// What the scene file says of itself.
    pub fn description(&self) -> &'static str {
        let line = self.text.lines().find_map(|line| line.strip_prefix("description"));
        line.map_or("", |rest| rest.trim_matches([' ', '=', '"']))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_demo_says_what_it_shows() {
        assert!(DEMOS.iter().all(|demo| demo.description().len() > 10));
    }

    #[test]
    fn a_demo_is_unpacked_with_the_files_that_it_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("man.toml");
        named("cone-man").unwrap().unpack(&path).unwrap();
        assert!(path.exists() && folder.path().join("models/cone-man.glb").exists());
    }

    #[test]
    fn a_demo_is_found_by_its_name_or_the_nearest_is_offered() {
        assert_eq!(built_in(Path::new("demo:terrain")).unwrap().map(|d| d.name), Some("terrain"));
        assert!(built_in(Path::new("scene.toml")).unwrap().is_none());
        let error = built_in(Path::new("demo:terain")).err().unwrap();
        assert!(error.to_string().contains("did you mean terrain?"));
    }
}
