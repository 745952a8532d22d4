//! What the viewer may show: scenes of a folder, those that are built in, and what is dropped on the page.

use std::path::{Component, Path, PathBuf};

use halflight::demos::{self, DEMOS};
use halflight::job::Stage;
use halflight_file::write_whole;
use halflight_image::RgbImage;
use halflight_render::techniques::TECHNIQUES;
use halflight_view::{Kept, Library, Swap};
use tempfile::TempDir;

use super::keep::{self, Told};
use crate::command::failure::Failure;
use crate::command::stage::{self, MachineArgs, SceneArgs};

/// Files of the folder that are offered, at most, and how deep below it they may lie.
const MAX_LISTED: usize = 200;
const MAX_DEPTH: usize = 3;
/// What can be opened.
const SCENES: &[&str] = &["toml", "glb", "gltf", "ply", "obj", "tif", "binary"];
/// What can be swapped in as light.
const LIGHTS: &[&str] = &["hdr", "exr"];
/// What can be compared with.
const PICTURES: &[&str] = &["exr", "hdr", "png"];

/// The scenes of a folder and those that are built in.
pub(super) struct Shelf {
    /// In its shortest absolute form.
    folder: PathBuf,
    changes: SceneArgs,
    machine: MachineArgs,
    /// What is open, by its name.
    open: Option<String>,
    /// What was dropped on the page, for as long as it is open: where it lies, and the file that is shown.
    dropped: Option<(TempDir, PathBuf)>,
}

impl Shelf {
    pub(super) fn new(folder: PathBuf, changes: SceneArgs, machine: MachineArgs) -> Self {
        Self { folder, changes, machine, open: None, dropped: None }
    }

    /// Files of the folder with one of these endings, as names below it.
    fn files(&self, endings: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        list(&self.folder, 0, &mut |path| {
            let fits = endings.contains(&halflight_file::extension(path).as_str());
            if let (true, Ok(below)) = (fits, path.strip_prefix(&self.folder)) {
                found.push(below.display().to_string());
            }
            found.len() < MAX_LISTED
        });
        found.sort();
        found
    }

    /// A file below the folder; links that lead out of it do not count.
    fn beneath(&self, name: &str) -> Result<PathBuf, String> {
        let outside = || format!("{name} is not in the folder that may be read, or not there");
        let plain = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if !plain || name.is_empty() {
            return Err(outside());
        }
        let path = self.folder.join(name).canonicalize().map_err(|_| outside())?;
        if path.starts_with(&self.folder) { Ok(path) } else { Err(outside()) }
    }

    /// The changes of the command line with those of the page.
    fn changed(&self, swap: &Swap) -> Result<SceneArgs, String> {
        let mut changes = self.changes.clone();
        match swap.environment.as_str() {
            "" => {}
            name @ ("sky" | "studio" | "black") => changes.environment = Some(name.into()),
            name => changes.environment = Some(self.beneath(name)?),
        }
        for (number, text) in &swap.materials {
            let text = self.material(text)?;
            if self.open.as_deref().is_some_and(is_scene_file) {
                let table = halflight_scene::material_as_toml(&text);
                changes.set.push(format!("shape.{}.material={table}", self.shape_key(*number)));
            } else {
                changes.material = Some(text);
            }
        }
        Ok(changes)
    }

    /// A material that the page names: no paths, files of the folder by their names.
    fn material(&self, text: &str) -> Result<String, String> {
        let text = match text.trim() {
            text if text.contains(".binary") => self.beneath(text)?.display().to_string(),
            text if text.contains(['/', '\\']) || text.contains("..") => {
                return Err("a material of the page names no paths; files of the folder by their name".into());
            }
            text => text.to_string(),
        };
        halflight_scene::material_from_text(&text).map_err(|error| error.to_string())?;
        Ok(text)
    }

    /// What a shape goes by in `--set`: its name, or its number.
    fn shape_key(&self, number: usize) -> String {
        let named = || {
            let scene: toml::Table = self.text().ok()?.text.parse().ok()?;
            let shape = scene.get("shape")?.as_array()?.get(number)?;
            Some(shape.get("name")?.as_str()?.to_string())
        };
        named().unwrap_or_else(|| number.to_string())
    }

    /// The scene file that is open.
    fn text(&self) -> Result<Told, String> {
        let name = self.open.clone().ok_or("nothing is open")?;
        if let Ok(Some(demo)) = demos::built_in(Path::new(&name)) {
            let (text, stem) = (demo.text().to_string(), demo.name.to_string());
            return Ok(Told { text, stem, demo: Some(demo) });
        }
        if !is_scene_file(&name) {
            return Err(format!(
                "{name} is no scene file, so that there is nothing to keep this view in (write a scene that names it)"
            ));
        }
        let path = match &self.dropped {
            Some((_, path)) => path.clone(),
            None => self.beneath(&name)?,
        };
        let bytes =
            halflight_file::read(&path, "scene").map_err(|error| self.without_paths(&error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| format!("{name} is not UTF-8 text"))?;
        Ok(Told { text, stem: name.trim_end_matches(".toml").to_string(), demo: None })
    }

    /// A message without the place where dropped files happen to lie.
    fn without_paths(&self, message: &str) -> String {
        let Some((folder, _)) = &self.dropped else { return message.to_string() };
        let mut said = message.to_string();
        for place in [folder.path().canonicalize().unwrap_or_default(), folder.path().to_path_buf()] {
            if !place.as_os_str().is_empty() {
                let place = place.display().to_string();
                said = said.replace(&format!("{place}/"), "").replace(&place, "the dropped files");
            }
        }
        said
    }

    pub(super) fn show(&mut self, name: String, stage: Stage) -> Result<halflight_view::Stage, Failure> {
        let settings = TECHNIQUES
            .iter()
            .map(|entry| Ok((entry.name.to_string(), stage.technique_settings(entry.name)?)))
            .collect::<Result<_, Failure>>()?;
        self.open = Some(name.clone());
        Ok(halflight_view::Stage { name, scene: stage.into_scene(), settings })
    }

    fn load(
        &mut self,
        name: &str,
        path: &Path,
        changes: &SceneArgs,
    ) -> Result<halflight_view::Stage, String> {
        let told = |failure: Failure| self.without_paths(failure.message().unwrap_or_default());
        let stage = stage::load(path, changes, &self.machine).map_err(told)?;
        // What the command line named may lie anywhere.
        let asked = &self.changes;
        let material = asked.material.as_deref().map(|text| text.split_once('=').map_or(text, |(_, of)| of));
        let named: Vec<PathBuf> = [asked.environment.as_deref(), material.map(Path::new)]
            .into_iter()
            .flatten()
            .filter_map(|path| path.canonicalize().ok())
            .collect();
        let dropped = self.dropped.as_ref().and_then(|(folder, _)| folder.path().canonicalize().ok());
        let allowed = |file: &PathBuf| {
            let file = file.canonicalize().unwrap_or_default();
            let beneath = |folder: &PathBuf| file.starts_with(folder);
            beneath(&self.folder) || dropped.as_ref().is_some_and(beneath) || named.contains(&file)
        };
        if !is_built_in(name) && !stage.scene().files().iter().all(allowed) {
            return Err(format!("{name} names files outside of the folder that may be read (see --folder)"));
        }
        self.show(name.into(), stage).map_err(|failure| failure.message().unwrap_or_default().to_string())
    }
}

fn is_built_in(name: &str) -> bool {
    name.starts_with("demo:")
}

fn is_scene_file(name: &str) -> bool {
    is_built_in(name) || name.ends_with(".toml")
}

/// A name of a dropped file without what could lead elsewhere.
fn plain(name: &str) -> Result<String, String> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let plain: String = last.chars().filter(|c| c.is_alphanumeric() || "._- ".contains(*c)).collect();
    let plain = plain.trim_start_matches(['.', ' ']).to_string();
    if plain.is_empty() { Err(format!("the file {name:?} has no name that can be used")) } else { Ok(plain) }
}

/// Calls `take` with the files of a folder and below it, in order, until it has enough.
fn list(folder: &Path, depth: usize, take: &mut dyn FnMut(&Path) -> bool) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return true };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let wanted = match path.symlink_metadata() {
            Ok(data) if hidden || data.is_symlink() => true,
            Ok(data) if data.is_dir() => depth >= MAX_DEPTH || list(&path, depth + 1, take),
            Ok(_) => take(&path),
            Err(_) => true,
        };
        if !wanted {
            return false;
        }
    }
    true
}

impl Library for Shelf {
    fn names(&self) -> Vec<String> {
        let demos = DEMOS.iter().map(|demo| format!("demo:{}", demo.name));
        demos.chain(self.files(SCENES)).collect()
    }

    fn environments(&self) -> Vec<String> {
        let built_in = ["sky", "studio", "black"].map(String::from);
        built_in.into_iter().chain(self.files(LIGHTS)).collect()
    }

    fn open(&mut self, name: &str, swap: &Swap) -> Result<halflight_view::Stage, String> {
        let changes = self.changed(swap)?;
        if is_built_in(name) {
            return self.load(name, Path::new(name), &changes);
        }
        if let Some((_, path)) = self.dropped.as_ref().filter(|_| self.open.as_deref() == Some(name)) {
            let path = path.clone();
            return self.load(name, &path, &changes);
        }
        let path = self.beneath(name)?;
        let stage = self.load(name, &path, &changes)?;
        self.dropped = None;
        Ok(stage)
    }

    fn pictures(&self) -> Vec<String> {
        self.files(PICTURES)
    }

    fn picture(&mut self, name: &str) -> Result<RgbImage, String> {
        let path = self.beneath(name)?;
        halflight_image::load_rgb(&path).map_err(|error| error.to_string())
    }

    fn take_picture(&mut self, name: &str, bytes: &[u8]) -> Result<RgbImage, String> {
        let plain = plain(name)?;
        let failed = |error: std::io::Error| format!("cannot read {plain}: {error}");
        let folder = tempfile::tempdir().map_err(failed)?;
        let path = folder.path().join(&plain);
        std::fs::write(&path, bytes).map_err(failed)?;
        halflight_image::load_rgb(&path)
            .map_err(|error| error.to_string().replace(&path.display().to_string(), &plain))
    }

    fn take(&mut self, files: &[(String, Vec<u8>)]) -> Result<halflight_view::Stage, String> {
        let failed = |error: std::io::Error| format!("cannot keep what was dropped: {error}");
        let folder = tempfile::tempdir().map_err(failed)?;
        let mut names = Vec::new();
        for (name, bytes) in files {
            let plain = plain(name)?;
            std::fs::write(folder.path().join(&plain), bytes).map_err(failed)?;
            names.push(plain);
        }
        // A scene file before the models that it names, those before maps and pictures.
        let rank = |name: &String| {
            let ending = halflight_file::extension(Path::new(name));
            SCENES.iter().chain(LIGHTS).position(|known| *known == ending).unwrap_or(usize::MAX)
        };
        let Some(shown) = names.iter().min_by_key(|name| rank(name)).cloned() else {
            return Err("nothing was dropped".into());
        };
        let path = folder.path().join(&shown);
        let before = self.dropped.replace((folder, path.clone()));
        let was_open = self.open.clone();
        let changes = self.changes.clone();
        let loaded = self.load(&shown, &path, &changes);
        if loaded.is_err() {
            (self.dropped, self.open) = (before, was_open);
        }
        loaded
    }

    fn keep(&mut self, kept: &Kept) -> Result<String, String> {
        let told = self.text()?;
        let (text, left) = keep::with_view(&told.text, kept, &self.changes, &self.folder)?;
        let free = |number: usize| {
            let number = if number == 1 { String::new() } else { format!("-{number}") };
            self.folder.join(format!("{}-view{number}.toml", told.stem))
        };
        let path = (1..1000).map(free).find(|path| !path.exists()).ok_or("there are too many kept views")?;
        if let Some(demo) = told.demo {
            demo.unpack_files(&self.folder).map_err(|error| error.to_string())?;
        }
        let mut said = vec![path.display().to_string()];
        if let Some((folder, scene)) = &self.dropped {
            said.extend(self.copy_dropped(folder.path(), scene)?);
        }
        write_whole(&path, "scene file", |writer| std::io::Write::write_all(writer, text.as_bytes()))
            .map_err(|error| error.to_string())?;
        said.extend(left);
        Ok(said.join("; "))
    }
}

impl Shelf {
    /// Copies what was dropped beside a scene file to the folder; says what.
    fn copy_dropped(&self, from: &Path, scene: &Path) -> Result<Vec<String>, String> {
        let mut said = Vec::new();
        let entries =
            std::fs::read_dir(from).map_err(|error| format!("the dropped files are gone: {error}"))?;
        for path in entries.flatten().map(|entry| entry.path()).filter(|path| path != scene) {
            let Some(name) = path.file_name() else { continue };
            let to = self.folder.join(name);
            let bytes = halflight_file::read(&path, "dropped file")
                .map_err(|e| self.without_paths(&e.to_string()))?;
            if to.exists() {
                if std::fs::read(&to).ok().as_deref() != Some(&bytes[..]) {
                    return Err(format!("{} is in the folder already, and another file", name.display()));
                }
                continue;
            }
            write_whole(&to, "dropped file", |writer| std::io::Write::write_all(writer, &bytes))
                .map_err(|error| error.to_string())?;
            said.push(format!("with {}", name.display()));
        }
        Ok(said)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shelf() -> (TempDir, Shelf) {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        std::fs::write(inner.join("a.toml"), "").unwrap();
        std::fs::write(folder.path().join("outside.toml"), "").unwrap();
        let shelf = Shelf {
            folder: inner.canonicalize().unwrap(),
            changes: SceneArgs::default(),
            machine: MachineArgs::default(),
            open: None,
            dropped: None,
        };
        (folder, shelf)
    }

    #[test]
    fn only_files_beneath_the_folder_are_found() {
        let (_folder, shelf) = shelf();
        assert!(shelf.beneath("a.toml").is_ok());
        for name in [
            "../outside.toml",
            "/etc/passwd",
            "",
            ".",
            "b.toml",
            "a.toml/../../outside.toml",
            "./../outside.toml",
        ] {
            assert!(shelf.beneath(name).is_err(), "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../outside.toml", shelf.folder.join("link.toml")).unwrap();
            assert!(shelf.beneath("link.toml").is_err());
            assert!(!shelf.names().contains(&"link.toml".to_string()));
        }
        assert!(shelf.names().contains(&"a.toml".to_string()));
    }

    #[test]
    fn materials_of_the_page_name_no_paths() {
        let (_folder, shelf) = shelf();
        let swap = |material: &str| {
            shelf.changed(&Swap { materials: vec![(0, material.into())], ..Swap::default() })
        };
        assert!(swap("phong exponent=40").is_ok());
        for text in ["/etc/x.binary", "../x.binary", "diffuse albedo=/etc/passwd", "a..b"] {
            assert!(swap(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_dropped_scene_can_be_kept_with_what_was_dropped_beside_it() {
        let (_folder, mut shelf) = shelf();
        let scene = b"[[shape]]\ntype = \"mesh\"\nfile = \"tri.obj\"\n".to_vec();
        let mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec();
        let stage = shelf.take(&[("tri.obj".into(), mesh), ("a scene.toml".into(), scene)]).unwrap();
        assert_eq!(stage.name, "a scene.toml");
        let said = shelf.keep(&Kept { filmic: true, ..Kept::default() }).unwrap();
        assert!(said.contains("a scene-view.toml") && said.contains("with tri.obj"), "{said}");
        assert!(shelf.open("a scene-view.toml", &Swap::default()).is_ok());
    }

    #[test]
    fn errors_of_dropped_files_name_no_place_of_this_machine() {
        let (_folder, mut shelf) = shelf();
        let temporary = std::env::temp_dir().display().to_string();
        for (name, bytes) in [
            ("bad.toml", &b"[camera]\norigin = [0, 0"[..]),
            ("rel.toml", b"[[shape]]\ntype = \"mesh\"\nfile = \"models/x.ply\"\n"),
            ("trunc.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
            ("x.txt", b"hello"),
        ] {
            let error = shelf.take(&[(name.into(), bytes.to_vec())]).err().expect("it is refused");
            assert!(!error.contains(&temporary) && error.contains(name), "{error}");
        }
        let error = shelf.take_picture("x.exr", b"nothing").unwrap_err();
        assert!(!error.contains(&temporary) && error.contains("x.exr"), "{error}");
    }
}
