//! A view written back into a copy of its scene file: what differs is changed, everything else stays as it is (but for
//! comments, which are lost).

use std::path::Path;

use glam::Vec3;
use halflight::demos::Demo;
use halflight_render::techniques::TECHNIQUES;
use halflight_view::Kept;
use toml::{Table, Value};

use crate::command::stage::SceneArgs;

/// A scene file that is open.
pub(super) struct Told {
    pub(super) text: String,
    /// Its name without the ending, below the folder.
    pub(super) stem: String,
    pub(super) demo: Option<&'static Demo>,
}

/// The text of a scene with a view and with the changes of the command line; and what could not be kept. The copy lies in
/// `folder` or below it; files that the command line names get their whole paths.
pub(super) fn with_view(
    text: &str,
    kept: &Kept,
    changes: &SceneArgs,
    folder: &Path,
) -> Result<(String, Vec<String>), String> {
    let mut scene: Table =
        text.parse().map_err(|error| format!("the scene file was not understood: {error}"))?;
    let mut left = Vec::new();
    command_line(&mut scene, changes)?;
    for (number, text) in &kept.swap.materials {
        let text = if text.contains(".binary") { whole(&folder.join(text)) } else { text.clone() };
        shape(&mut scene, *number)?.insert("material".into(), material(&text)?);
    }
    camera(&mut scene, kept)?;
    environment(&mut scene, kept, folder);
    for (number, by) in &kept.moved {
        match shape(&mut scene, *number) {
            Ok(shape) => shift(shape, *by)?,
            Err(_) => left.push("a light that was moved could not be kept".into()),
        }
    }
    let image = table(&mut scene, "image")?;
    image.insert("exposure_ev".into(), float(kept.exposure_ev));
    image.insert("tone".into(), if kept.filmic { "filmic" } else { "srgb" }.into());
    if let Some(size) = kept.size {
        image.insert("size".into(), Value::Array(size.map(|side| Value::Integer(side as i64)).to_vec()));
    }
    if !kept.settings.is_empty() {
        let technique = table(table(&mut scene, "technique")?, &kept.technique)?;
        for (key, value) in &kept.settings {
            technique.insert(key.clone(), parsed(value));
        }
    }
    let text = toml::to_string_pretty(&scene).map_err(|error| error.to_string())?;
    Ok((text, left))
}

/// A number as a person would write it: as short as an `f32` allows.
fn float(x: f32) -> Value {
    Value::Float(x.to_string().parse().unwrap_or_else(|_| f64::from(x)))
}

fn vector(v: Vec3) -> Value {
    Value::Array(v.to_array().map(float).to_vec())
}

/// A value as TOML has it, or else as text.
fn parsed(text: &str) -> Value {
    let table = format!("x = {}", text.trim()).parse::<Table>().ok();
    table.and_then(|mut table| table.remove("x")).unwrap_or_else(|| Value::String(text.trim().into()))
}

/// A path that holds wherever the copy lies.
fn whole(path: &Path) -> String {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf()).display().to_string()
}

/// The table of that name in another one, made if it is not there.
fn table<'a>(of: &'a mut Table, name: &str) -> Result<&'a mut Table, String> {
    let place = of.entry(name).or_insert_with(|| Table::new().into());
    place.as_table_mut().ok_or_else(|| format!("[{name}] is not a table"))
}

/// A shape by its number.
fn shape(scene: &mut Table, number: usize) -> Result<&mut Table, String> {
    let shapes = scene.get_mut("shape").and_then(Value::as_array_mut);
    let found = shapes.and_then(|shapes| shapes.get_mut(number)).and_then(Value::as_table_mut);
    found.ok_or_else(|| format!("the scene file has no shape {number}"))
}

/// A material as `--material` takes it, as a table.
fn material(text: &str) -> Result<Value, String> {
    let table = halflight_scene::material_as_toml(text);
    let parsed: Option<Value> = format!("x = {table}").parse::<Table>().ok().and_then(|mut t| t.remove("x"));
    parsed.ok_or_else(|| format!("the material {text:?} cannot be written"))
}

fn camera(scene: &mut Table, kept: &Kept) -> Result<(), String> {
    if kept.place.is_none() && kept.vertical_fov_degrees.is_none() && kept.lens.is_none() {
        return Ok(());
    }
    let camera = table(scene, "camera")?;
    if let Some([origin, target]) = kept.place {
        // What moves the camera would move it from where it is kept.
        camera.remove("keyframes");
        camera.remove("transform");
        camera.insert("origin".into(), vector(origin));
        camera.insert("target".into(), vector(target));
    }
    if let Some(angle) = kept.vertical_fov_degrees {
        camera.remove("horizontal_fov_degrees");
        camera.insert("vertical_fov_degrees".into(), float(angle));
    }
    if let Some([radius, distance]) = kept.lens {
        camera.insert("aperture_radius".into(), float(radius));
        camera.insert("focus_distance".into(), float(distance));
    }
    Ok(())
}

/// The environment as it is turned, or another one.
fn environment(scene: &mut Table, kept: &Kept, folder: &Path) {
    match kept.swap.environment.as_str() {
        "" => {}
        name @ ("sky" | "studio" | "black") => drop(scene.insert("environment".into(), name.into())),
        name => drop(scene.insert("environment".into(), whole(&folder.join(name)).into())),
    }
    if kept.turn_degrees == 0.0 || !kept.has_environment {
        return;
    }
    // Where nothing is said, the studio lights the scene.
    let said = scene.remove("environment").unwrap_or_else(|| "studio".into());
    let mut environment = match said {
        Value::Table(environment) => environment,
        Value::String(text) => {
            let key = match text.as_str() {
                "sky" | "studio" | "black" => "type",
                color if color.starts_with('#') => "color",
                _ => "file",
            };
            Table::from_iter([(key.to_string(), Value::String(text))])
        }
        other => return drop(scene.insert("environment".into(), other)),
    };
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
    let before = environment.get("rotation_degrees").and_then(number).unwrap_or(0.0);
    let turned = (before + kept.turn_degrees).rem_euclid(360.0);
    environment.insert("rotation_degrees".into(), Value::Float(turned));
    scene.insert("environment".into(), environment.into());
}

/// Moves a shape in the world: by its keyframes if it has any, as they are applied last, else by its copies or itself.
fn shift(shape: &mut Table, by: Vec3) -> Result<(), String> {
    for key in ["keyframes", "instances"] {
        let list = shape.get_mut(key).and_then(Value::as_array_mut).filter(|list| !list.is_empty());
        if let Some(list) = list {
            return list.iter_mut().try_for_each(|item| {
                shift_transform(
                    item.as_table_mut().ok_or_else(|| format!("`{key}` is no list of tables"))?,
                    by,
                )
            });
        }
    }
    shift_transform(table(shape, "transform")?, by)
}

fn shift_transform(transform: &mut Table, by: Vec3) -> Result<(), String> {
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
    let shifted = |value: Option<&Value>, by: f32| {
        float((value.and_then(number).unwrap_or(0.0) + f64::from(by)) as f32)
    };
    if let Some(rows) = transform.get_mut("matrix").and_then(Value::as_array_mut) {
        for (row, by) in rows.iter_mut().zip(by.to_array()) {
            let row = row.as_array_mut().filter(|row| row.len() == 4).ok_or("`matrix` is no matrix")?;
            row[3] = shifted(row.get(3), by);
        }
        return Ok(());
    }
    let before = transform.get("translate").and_then(Value::as_array).cloned().unwrap_or_default();
    let axes = by.to_array().into_iter().enumerate().map(|(axis, by)| shifted(before.get(axis), by));
    let translate = Value::Array(axes.collect());
    transform.insert("translate".into(), translate);
    Ok(())
}

/// What `--environment`, `--material`, `--shape` and `--set` said.
fn command_line(scene: &mut Table, changes: &SceneArgs) -> Result<(), String> {
    if let Some(environment) = &changes.environment {
        let text = environment.display().to_string();
        let built_in = matches!(text.as_str(), "sky" | "studio" | "black");
        let text = if built_in { text } else { whole(environment) };
        scene.insert("environment".into(), text.into());
    }
    for setting in &changes.set {
        let (key, value) = setting.split_once('=').ok_or_else(|| format!("--set {setting} sets nothing"))?;
        let of_technique = TECHNIQUES
            .iter()
            .any(|entry| key.trim().strip_prefix(entry.name).is_some_and(|rest| rest.starts_with('.')));
        let keys: Vec<&str> = key.split('.').map(str::trim).collect();
        let technique = if of_technique { &["technique"][..] } else { &[] };
        let keys: Vec<&str> = technique.iter().copied().chain(keys).collect();
        assign(scene, &keys, parsed(value))?;
    }
    for (name, file) in &changes.shape {
        let key = if halflight_file::extension(Path::new(file)) == "ddf" { "field" } else { "file" };
        assign(scene, &["shape", name, key], whole(Path::new(file)).into())?;
    }
    let Some(text) = &changes.material else { return Ok(()) };
    let named = text
        .split_once('=')
        .filter(|(name, _)| scene.get("material").and_then(|all| all.get(name.trim())).is_some());
    let of_file = |text: &str| {
        let text = text.trim();
        material(&if text.ends_with(".binary") { whole(Path::new(text)) } else { text.to_string() })
    };
    if let Some((name, text)) = named {
        let (name, value) = (name.trim().to_string(), of_file(text)?);
        table(scene, "material")?.insert(name, value);
    } else if let Some(shapes) = scene.get_mut("shape").and_then(Value::as_array_mut) {
        let value = of_file(text)?;
        for shape in shapes.iter_mut().filter_map(Value::as_table_mut) {
            shape.entry("material").or_insert_with(|| value.clone());
        }
    }
    Ok(())
}

/// Sets the value at a path of keys; elements of lists go by their `name` or number.
fn assign(table: &mut Table, keys: &[&str], value: Value) -> Result<(), String> {
    let unknown = || format!("`{}` of the command line cannot be kept", keys.join("."));
    let [key, rest @ ..] = keys else { return Err(unknown()) };
    if rest.is_empty() {
        table.insert((*key).to_string(), value);
        return Ok(());
    }
    match table.entry(*key).or_insert_with(|| Table::new().into()) {
        Value::Table(inner) => assign(inner, rest, value),
        Value::Array(items) => {
            let (wanted, rest) = rest.split_first().ok_or_else(unknown)?;
            let is_named = |item: &Value| item.get("name").and_then(Value::as_str) == Some(wanted);
            let found = items.iter().position(is_named).or_else(|| wanted.parse().ok());
            match found.and_then(|index| items.get_mut(index)) {
                Some(Value::Table(inner)) if !rest.is_empty() => assign(inner, rest, value),
                Some(item) if rest.is_empty() => {
                    *item = value;
                    Ok(())
                }
                _ => Err(unknown()),
            }
        }
        // `environment = "studio"` is short for a table.
        place @ Value::String(_) => {
            let short = place.as_str().unwrap_or_default().to_string();
            *place = Value::Table(Table::from_iter([("type".to_string(), Value::String(short))]));
            place.as_table_mut().map_or_else(|| Err(unknown()), |inner| assign(inner, rest, value))
        }
        _ => Err(unknown()),
    }
}

#[cfg(test)]
mod tests {
    use halflight_view::Swap;

    use super::*;

    const SCENE: &str = r#"# hello
        environment = { type = "sky", turbidity = 4, rotation_degrees = 350 }
        [image]
        size = [64, 32]
        [camera]
        up = [0, 0, 1]
        shutter = [0.0, 0.1]
        keyframes = [{ time = 0, origin = [0, 0, 9] }, { time = 1, origin = [0, 5, 9] }]
        [[shape]]
        name = "ball"
        type = "sphere"
        keyframes = [{ time = 0 }, { time = 1, translate = [1, 0, 0] }]
        [[shape]]
        type = "box"
        [[shape]]
        type = "plane"
        transform = { matrix = [[1, 0, 0, 0], [0, 1, 0, 2], [0, 0, 1, 0]] }
    "#;

    fn kept(kept: &Kept, changes: &SceneArgs) -> Table {
        let (text, _) = with_view(SCENE, kept, changes, Path::new(".")).expect("it can be kept");
        halflight_scene::Scene::parse(&text, Path::new("kept.toml")).expect("the copy is a scene");
        text.parse().expect("the copy is TOML")
    }

    #[test]
    fn an_eye_that_was_not_moved_keeps_the_motion_of_the_camera() {
        let scene = kept(&Kept::default(), &SceneArgs::default());
        let before: Table = SCENE.parse().unwrap();
        assert_eq!(scene["camera"], before["camera"]);
        let zoomed = Kept { vertical_fov_degrees: Some(20.0), ..Kept::default() };
        let scene = kept(&zoomed, &SceneArgs::default());
        assert_eq!(scene["camera"]["keyframes"], before["camera"]["keyframes"]);
        assert_eq!(scene["camera"]["vertical_fov_degrees"].as_float(), Some(20.0));
    }

    #[test]
    fn an_eye_that_was_moved_keeps_what_is_up_and_all_other_keys() {
        let view = Kept {
            place: Some([Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO]),
            lens: Some([0.1, 2.0]),
            ..Kept::default()
        };
        let scene = kept(&view, &SceneArgs::default());
        let camera = scene["camera"].as_table().unwrap();
        assert_eq!(camera["origin"][2].as_float(), Some(3.0));
        assert_eq!(camera["up"][2].as_integer(), Some(1));
        assert_eq!(camera["shutter"][1].as_float(), Some(0.1));
        assert_eq!(camera["aperture_radius"].as_float(), Some(0.1));
        assert!(!camera.contains_key("keyframes"));
    }

    #[test]
    fn light_materials_objects_and_looks_are_kept_as_they_are_shown() {
        let view = Kept {
            exposure_ev: 1.5,
            filmic: true,
            size: Some([320, 180]),
            turn_degrees: 30.0,
            has_environment: true,
            swap: Swap { materials: vec![(1, "copper roughness=0.2".into())], ..Swap::default() },
            moved: vec![
                (0, Vec3::new(0.0, 0.5, 0.0)),
                (1, Vec3::new(1.0, 0.0, 0.0)),
                (2, Vec3::new(0.0, 1.0, 0.0)),
            ],
            technique: "shexp".into(),
            settings: vec![("order".into(), "5".into()), ("blocker".into(), "closed-form".into())],
            ..Kept::default()
        };
        let scene = kept(&view, &SceneArgs::default());
        assert_eq!(scene["environment"]["rotation_degrees"].as_float(), Some(20.0));
        assert_eq!(scene["environment"]["turbidity"].as_integer(), Some(4));
        assert_eq!(scene["image"]["tone"].as_str(), Some("filmic"));
        assert_eq!(scene["image"]["size"][0].as_integer(), Some(320));
        assert_eq!(scene["shape"][0]["keyframes"][1]["translate"][1].as_float(), Some(0.5));
        assert_eq!(scene["shape"][0]["keyframes"][1]["translate"][0].as_float(), Some(1.0));
        assert_eq!(scene["shape"][1]["transform"]["translate"][0].as_float(), Some(1.0));
        assert_eq!(scene["shape"][1]["material"]["metal"].as_str(), Some("copper"));
        assert_eq!(scene["shape"][2]["transform"]["matrix"][1][3].as_float(), Some(3.0));
        assert_eq!(scene["technique"]["shexp"]["order"].as_integer(), Some(5));
        assert_eq!(scene["technique"]["shexp"]["blocker"].as_str(), Some("closed-form"));
        let swapped = Swap { environment: "studio".into(), ..Swap::default() };
        let scene = kept(&Kept { swap: swapped, ..view }, &SceneArgs::default());
        assert_eq!(scene["environment"]["type"].as_str(), Some("studio"));
        assert_eq!(scene["environment"]["rotation_degrees"].as_float(), Some(30.0));
    }

    #[test]
    fn what_the_command_line_changed_is_kept_too() {
        let changes = SceneArgs {
            environment: Some("studio".into()),
            material: Some("phong exponent=40".into()),
            set: vec![
                "path.max_depth=2".into(),
                "shape.ball.radius=0.5".into(),
                "image.exposure_ev=3".into(),
                "environment.rotation_degrees=10".into(),
            ],
            ..SceneArgs::default()
        };
        let scene = kept(&Kept { exposure_ev: 3.0, ..Kept::default() }, &changes);
        assert_eq!(scene["environment"]["type"].as_str(), Some("studio"));
        assert_eq!(scene["environment"]["rotation_degrees"].as_integer(), Some(10));
        assert_eq!(scene["technique"]["path"]["max_depth"].as_integer(), Some(2));
        assert_eq!(scene["shape"][0]["radius"].as_float(), Some(0.5));
        assert_eq!(scene["shape"][1]["material"]["type"].as_str(), Some("phong"));
    }
}
