//! `halflight view`: a scene in the browser, live.

use std::net::IpAddr;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use clap::Args;
use halflight::demos::{self, DEMOS, Demo};
use halflight::job::Stage;
use halflight_file::write_whole;
use halflight_render::techniques::TECHNIQUES;
use halflight_view::{Address, Kept, Library, Swap};
use serde_json::json;
use tempfile::TempDir;

use super::console::Console;
use super::failure::Failure;
use super::interrupt;
use super::parse::positive;
use super::stage::{self, MachineArgs, SceneArgs};

/// Files of the folder that are offered, at most, and how deep below it they may lie.
const MAX_LISTED: usize = 200;
const MAX_DEPTH: usize = 3;
/// What can be opened.
const SCENES: &[&str] = &["toml", "glb", "gltf", "ply", "obj", "tif", "binary"];
/// What can be swapped in as light.
const LIGHTS: &[&str] = &["hdr", "exr"];

#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// A scene file, `demo:NAME` or a bare asset
    #[arg(default_value = "demo:cone-man")]
    scene: PathBuf,
    /// The technique that is shown first [default: what the demo is for, or path]
    #[arg(long, short, value_name = "NAME")]
    technique: Option<String>,
    /// The port to listen on; 0 for any that is free
    #[arg(long, value_name = "N", default_value_t = 8642)]
    port: u16,
    /// The address to listen on. Any but this machine's own lets others in who know the token in the address
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    address: IpAddr,
    /// Only print the address
    #[arg(long)]
    no_browser: bool,
    /// Files may be opened and written in this folder and below it [default: the scene's]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// End after so many seconds [default: when interrupted]
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    changes: SceneArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

pub(crate) fn run(args: &ViewArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    interrupt::listen();
    let built_in = demos::built_in(&args.scene)?;
    let technique = args.technique.as_deref().or(built_in.map(Demo::technique)).unwrap_or(TECHNIQUES[0].name);
    halflight_render::techniques::find(technique).map_err(Failure::usage)?;
    let folder = folder_of(args, built_in.is_some())?;
    let name = match args.scene.canonicalize() {
        Ok(path) if built_in.is_none() => match path.strip_prefix(&folder) {
            Ok(below) => below.display().to_string(),
            Err(_) => {
                let (scene, folder) = (args.scene.display(), folder.display());
                return Err(Failure::usage(format!(
                    "{scene} is not below the folder {folder} (see --folder)"
                )));
            }
        },
        _ => args.scene.display().to_string(),
    };
    let mut shelf = Shelf {
        folder,
        changes: args.changes.clone(),
        machine: args.machine.clone(),
        open: None,
        dropped: None,
    };
    let stage = stage::load(&args.scene, &args.changes, &args.machine)?;
    stage.warnings().iter().for_each(|warning| console.warn(warning));
    let first = shelf.show(name, stage)?;
    let begun = Instant::now();
    let over =
        || interrupt::is_asked_to_stop() || args.seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s);
    let ready = |url: &str, address: std::net::SocketAddr| {
        console.answer(&format!("{url}\nCtrl-C ends"));
        console.event("view", json!({ "url": url, "port": address.port() }));
        if !args.no_browser && !open_browser(url) {
            console.note("no browser was found: open the address in one");
        }
    };
    let address = Address { ip: args.address, port: args.port };
    halflight_view::view(address, Box::new(shelf), first, technique, ready, &over).map_err(Failure::failed)
}

/// The folder that may be read and written.
fn folder_of(args: &ViewArgs, built_in: bool) -> Result<PathBuf, Failure> {
    let folder = match (&args.folder, args.scene.parent()) {
        (Some(folder), _) => folder.clone(),
        (None, Some(parent)) if !built_in && !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    folder
        .canonicalize()
        .map_err(|error| Failure::usage(format!("cannot use the folder {}: {error}", folder.display())))
}

/// Asks the desktop to show an address.
fn open_browser(url: &str) -> bool {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let quiet = Command::new(program)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    quiet.is_ok()
}

/// The scenes of a folder and those that are built in.
struct Shelf {
    /// In its shortest absolute form.
    folder: PathBuf,
    changes: SceneArgs,
    machine: MachineArgs,
    /// What is open, by its name.
    open: Option<String>,
    /// The file that was dropped on the page, for as long as it is open.
    dropped: Option<(TempDir, PathBuf)>,
}

impl Shelf {
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
        match swap.material.trim() {
            "" => {}
            text if text.contains(".binary") => {
                changes.material = Some(self.beneath(text)?.display().to_string());
            }
            text if text.contains(['/', '\\']) || text.contains("..") => {
                return Err("a material of the page names no paths; files of the folder by their name".into());
            }
            text => changes.material = Some(text.into()),
        }
        Ok(changes)
    }

    fn show(&mut self, name: String, stage: Stage) -> Result<halflight_view::Stage, Failure> {
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
        let told = |failure: Failure| failure.message().unwrap_or_default().to_string();
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
        self.show(name.into(), stage).map_err(told)
    }
}

fn is_built_in(name: &str) -> bool {
    name.starts_with("demo:")
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

    fn take(&mut self, name: &str, bytes: &[u8]) -> Result<halflight_view::Stage, String> {
        let plain: String = name.chars().filter(|c| c.is_alphanumeric() || "._- ".contains(*c)).collect();
        let plain = plain.trim_start_matches(['.', ' ']).to_string();
        if plain.is_empty() {
            return Err("the file has no name".into());
        }
        let failed = |error: std::io::Error| format!("cannot keep {plain}: {error}");
        let folder = tempfile::tempdir().map_err(failed)?;
        let path = folder.path().join(&plain);
        std::fs::write(&path, bytes).map_err(failed)?;
        let before = self.dropped.replace((folder, path.clone()));
        let changes = self.changes.clone();
        let loaded = self.load(&plain, &path, &changes);
        if loaded.is_err() {
            self.dropped = before;
        }
        loaded
    }

    fn keep(&mut self, kept: &Kept) -> Result<String, String> {
        let name = self.open.clone().ok_or("nothing is open")?;
        let (text, stem, of_demo) = match demos::built_in(Path::new(&name)) {
            Ok(Some(demo)) => (demo.text().to_string(), demo.name.to_string(), Some(demo)),
            _ => {
                if self.dropped.is_some() || !name.ends_with(".toml") {
                    return Err("only scene files of the folder and demos can be kept".into());
                }
                let path = self.beneath(&name)?;
                let text =
                    std::fs::read_to_string(&path).map_err(|error| format!("cannot read {name}: {error}"))?;
                (text, name.trim_end_matches(".toml").to_string(), None)
            }
        };
        let text = with_view(&text, kept)?;
        let free = |number: usize| {
            let number = if number == 1 { String::new() } else { format!("-{number}") };
            self.folder.join(format!("{stem}-view{number}.toml"))
        };
        let path = (1..1000).map(free).find(|path| !path.exists()).ok_or("there are too many kept views")?;
        if let Some(demo) = of_demo {
            demo.unpack_files(&self.folder).map_err(|error| error.to_string())?;
        }
        write_whole(&path, "scene file", |writer| std::io::Write::write_all(writer, text.as_bytes()))
            .map_err(|error| error.to_string())?;
        Ok(path.display().to_string())
    }
}

/// The table of that name in another one, made if it is not there.
fn table<'a>(of: &'a mut toml::Table, name: &str) -> Result<&'a mut toml::Table, String> {
    let place = of.entry(name).or_insert_with(|| toml::Table::new().into());
    place.as_table_mut().ok_or_else(|| format!("[{name}] is not a table"))
}

/// The text of a scene with another view. Comments are lost; everything else stays as it is.
fn with_view(text: &str, kept: &Kept) -> Result<String, String> {
    let mut scene: toml::Table =
        text.parse().map_err(|error| format!("the scene file was not understood: {error}"))?;
    let vector =
        |v: glam::Vec3| toml::Value::Array(v.to_array().map(|x| toml::Value::Float(f64::from(x))).to_vec());
    let float = |x: f32| toml::Value::Float(f64::from(x));
    let mut camera = toml::Table::new();
    camera.insert("origin".into(), vector(kept.origin));
    camera.insert("target".into(), vector(kept.target));
    camera.insert("vertical_fov_degrees".into(), float(kept.vertical_fov_degrees));
    if kept.aperture_radius > 0.0 {
        camera.insert("aperture_radius".into(), float(kept.aperture_radius));
        camera.insert("focus_distance".into(), float(kept.focus_distance));
    }
    if let Some(shutter) = scene.get("camera").and_then(|camera| camera.get("shutter")) {
        camera.insert("shutter".into(), shutter.clone());
    }
    scene.insert("camera".into(), camera.into());
    table(&mut scene, "image")?.insert("exposure_ev".into(), float(kept.exposure_ev));
    if !kept.settings.is_empty() {
        let technique = table(table(&mut scene, "technique")?, &kept.technique)?;
        for (key, value) in &kept.settings {
            let value =
                format!("x = {value}").parse::<toml::Table>().ok().and_then(|mut table| table.remove("x"));
            technique
                .insert(key.clone(), value.ok_or_else(|| format!("the setting {key} was not understood"))?);
        }
    }
    toml::to_string_pretty(&scene).map_err(|error| error.to_string())
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
        let swap = |material: &str| shelf.changed(&Swap { material: material.into(), ..Swap::default() });
        assert!(swap("phong exponent=40").is_ok());
        for text in ["/etc/x.binary", "../x.binary", "diffuse albedo=/etc/passwd", "a..b"] {
            assert!(swap(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_kept_view_is_a_scene_with_another_camera() {
        let kept = Kept {
            origin: glam::Vec3::new(1.0, 2.0, 3.0),
            target: glam::Vec3::ZERO,
            vertical_fov_degrees: 40.0,
            aperture_radius: 0.1,
            focus_distance: 2.0,
            exposure_ev: 1.5,
            technique: "shexp".into(),
            settings: vec![("order".into(), "5".into())],
        };
        let text = with_view(
            "# hello\n[camera]\norigin = [0, 0, 9]\nup = [0, 1, 0]\n[[shape]]\ntype = \"sphere\"\n",
            &kept,
        )
        .unwrap();
        let scene: toml::Table = text.parse().unwrap();
        assert_eq!(scene["camera"]["origin"][2].as_float(), Some(3.0));
        assert_eq!(scene["technique"]["shexp"]["order"].as_integer(), Some(5));
        assert_eq!(scene["shape"][0]["type"].as_str(), Some("sphere"));
        halflight_scene::Scene::parse(&text, Path::new("kept.toml")).unwrap();
    }
}
