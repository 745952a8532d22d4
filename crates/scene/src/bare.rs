//! A bare asset is a scene: framed, on a ground, in the studio.
//!
//! Everything is in proportion to the asset, so that a millimetre and a kilometre look the same.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Vec3};
use halflight_file::LoadError;
use halflight_material::{ColorInput, Material, MaterialKind};

use crate::SceneError;
use crate::build::{
    self, Builder, CameraRig, Form, HeightSource, LightRig, MaterialEntry, Object, Placement,
};
use crate::camera::FieldOfView;
use crate::framing::{self, Outline};
use crate::lights::Environment;
use crate::scene::{LoadOptions, Scene, Up, apply_settings, outline};
use crate::schema::{FilePath, Problem, Table};
use crate::spec::{self, SceneSpec};

/// The extensions of models, of pictures of light, and of pictures of heights.
const MODELS: [&str; 4] = ["ply", "obj", "gltf", "glb"];
const LIGHT: [&str; 2] = ["hdr", "exr"];
const HEIGHTS: [&str; 4] = ["tif", "tiff", "png", "dem"];

/// How far the ground reaches, in radii of what stands on it.
const GROUND_RADII: f32 = 80.0;

/// How far below the lowest point it lies, in radii: too little to be seen, enough that what is flat there (a floor,
/// a sheet) does not share its plane, where rounding would choose between the two from ray to ray.
const GROUND_GAP: f32 = 5e-4;

/// What kind of scene an asset makes.
struct Stage {
    objects: Vec<Object>,
    /// Whether it needs something to stand on.
    ground: bool,
    environment: Option<Environment>,
    camera: Option<Placement>,
    field_of_view: FieldOfView,
    /// Exposure under the studio, where nothing else is asked for.
    exposure_ev: f32,
}

pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let extension = halflight_file::extension(path);
    let mut builder = Builder::default();
    let material = match &options.material {
        Some(text) => {
            let material = build::material_from_text(text, &mut builder)?;
            Some(MaterialEntry { index: builder.add_material(material), displacement: None })
        }
        None => None,
    };
    let stage = match extension.as_str() {
        known if MODELS.contains(&known) => model(path, material, options.up, &mut builder)?,
        "ddf" => field(path, material, &mut builder)?,
        known if HEIGHTS.contains(&known) => heights(path, material, &mut builder)?,
        known if LIGHT.contains(&known) => environment(path, &mut builder)?,
        "binary" => measured(path, &mut builder)?,
        _ => return Err(unknown(path, &extension).into()),
    };
    let spec = settings(options)?;
    finish(path, options, builder, stage, spec)
}

fn unknown(path: &Path, extension: &str) -> LoadError {
    if path.is_dir() {
        return LoadError::new("scene", path, "this is a folder, not a file").hint("name a file inside it");
    }
    let found = if extension.is_empty() {
        "a name without an extension".into()
    } else {
        format!("the extension .{extension}")
    };
    if !path.exists() {
        // The reader tells what is missing, and what is near.
        if let Err(error) = halflight_file::read(path, "scene") {
            return error;
        }
    }
    LoadError::new("scene", path, found)
        .hint("scenes are .toml; models .ply, .obj, .gltf, .glb; fields .ddf; environments .hdr, .exr; heights .tif, .png; any of them packed as .xz")
}

/// `--set`, `--environment` and `--size`, which bare assets take as scene files do, as far as it makes sense.
fn settings(options: &LoadOptions) -> Result<SceneSpec, SceneError> {
    let mut table = Table::empty();
    apply_settings(&mut table, options)?;
    for entry in &table.entries {
        if matches!(entry.name.as_str(), "shape" | "material" | "light") {
            let problem = Problem::new(&entry.key, format!("a bare asset has no `{}` to set", entry.name));
            return Err(problem.help("write a scene file that names the asset").into());
        }
    }
    Ok(spec::read_spec(&table)?)
}

fn finish(
    path: &Path,
    options: &LoadOptions,
    mut builder: Builder,
    mut stage: Stage,
    mut spec: SceneSpec,
) -> Result<Scene, SceneError> {
    // Framed over the whole motion, so that nothing leaves the picture.
    let duration = stage.objects.iter().filter_map(Object::duration).fold(0.0, f64::max);
    let times: Vec<f64> =
        if duration > 0.0 { (0..9).map(|i| duration * f64::from(i) / 8.0).collect() } else { vec![0.0] };
    let outline = outline(&stage.objects, &times);
    if stage.ground {
        stage.objects.push(ground(&outline, &mut builder));
    }
    let studio_light = spec.environment.is_none() && stage.environment.is_none();
    if studio_light && !options.set.iter().any(|setting| setting.trim_start().starts_with("image")) {
        spec.image.exposure_ev = stage.exposure_ev;
    }
    let environment = match &spec.environment {
        Some(environment) => build::environment(environment, &mut builder),
        None => Some(stage.environment.unwrap_or_else(build::studio)),
    };
    let camera = match (&spec.camera, stage.camera) {
        (None, Some(placement)) => CameraRig {
            placement,
            field_of_view: stage.field_of_view,
            aperture_radius: 0.0,
            focus_distance: None,
            subject_distance: outline.radius(),
            shutter: [0.0, 0.0],
        },
        (None, None) => {
            let aspect = spec.image.size[0] as f32 / spec.image.size[1] as f32;
            let (origin, target) = framing::frame(&outline, stage.field_of_view, aspect, None);
            CameraRig {
                placement: Placement::LookAt { keys: vec![(0.0, origin, target)], up: Vec3::Y },
                field_of_view: stage.field_of_view,
                aperture_radius: 0.0,
                focus_distance: None,
                subject_distance: origin.distance(target),
                shutter: [0.0, 0.0],
            }
        }
        (Some(_), _) => builder.camera(spec.camera.as_ref(), &outline, spec.image.size),
    };
    let lights = LightRig { environment, deltas: Vec::new() };
    let said = format!("{}\n{}", path.display(), options.said());
    Scene::finish(path.display().to_string(), said, options, builder, spec, stage.objects, lights, camera)
}

/// A large, dull floor just below the lowest point.
fn ground(outline: &Outline, builder: &mut Builder) -> Object {
    let material = Material { name: "ground".into(), ..Material::diffuse(Vec3::splat(0.35)) };
    let materials: Arc<[u32]> = Arc::from([builder.add_material(material)]);
    let half = GROUND_RADII * outline.radius();
    let lowest = outline.bounds().0.y;
    // Far from the origin, what the numbers can tell apart.
    let gap = (GROUND_GAP * outline.radius()).max(8.0 * f32::EPSILON * lowest.abs());
    let center = outline.center().with_y(lowest - gap);
    let place = Affine3A::from_translation(center)
        * build::facing_up()
        * Affine3A::from_scale(Vec3::new(half, half, 1.0));
    Object {
        name: "ground".into(),
        form: Form::Rectangle,
        materials,
        places: vec![place],
        track: None,
        ground: true,
    }
}

/// The exposure that keeps a material below white where the studio's main light falls on it straight: that gives an
/// irradiance of about 2.1 π, of which an albedo of 0.48 makes white.
fn exposure(material: &Material) -> f32 {
    const WHITE: f32 = 0.48;
    let brightest = |color: &ColorInput| color.mean().max_element();
    let albedo = match &material.kind {
        MaterialKind::Diffuse { albedo } => brightest(albedo),
        MaterialKind::MetallicRoughness { base_color, .. } => brightest(base_color),
        // The picture of the lights in a mirror is white at any exposure.
        _ => 0.0,
    };
    -(albedo / WHITE).max(1.0).log2()
}

/// The lens of bare assets: long enough that nothing looks distorted.
const LENS: FieldOfView = FieldOfView::Vertical(0.50);

fn model(
    path: &Path,
    material: Option<MaterialEntry>,
    up: Up,
    builder: &mut Builder,
) -> Result<Stage, SceneError> {
    let mut model = builder.bare_model(path)?;
    if !model.lights.is_empty() {
        builder.warnings.push(format!(
            "{}: its {} lights are left out in favour of the studio; a scene file that names it has them",
            path.display(),
            model.lights.len()
        ));
        Arc::make_mut(&mut model).lights.clear();
    }
    let name = model.name.clone();
    if model.triangle_count() == 0 {
        builder.warnings.push(format!("{}: there are no triangles in it", path.display()));
    }
    let material = material.or_else(|| {
        let plain = model.materials.iter().all(|material| material.stand_in);
        plain.then(|| MaterialEntry { index: builder.add_material(clay()), displacement: None })
    });
    let file = FilePath::direct(path);
    let (form, materials) = builder.place_model(&name, &model, &file, None, (0.0, 1.0, true), material);
    // A camera of the file would have to turn with it; a model that lies on its side is framed anew.
    let camera = model.cameras.first().filter(|_| up == Up::Y);
    let place = match up {
        Up::Y => Affine3A::IDENTITY,
        Up::Z => build::facing_up(),
    };
    let field_of_view = camera.map_or(LENS, |camera| FieldOfView::Vertical(camera.vertical_fov));
    let camera = camera.map(|camera| Placement::Node(Arc::clone(&model), camera.node));
    let exposure_ev = materials.iter().map(|&m| exposure(&builder.materials[m as usize])).fold(0.0, f32::min);
    let object = Object { name, form, materials, places: vec![place], track: None, ground: false };
    Ok(Stage { objects: vec![object], ground: true, environment: None, camera, field_of_view, exposure_ev })
}

fn field(path: &Path, material: Option<MaterialEntry>, builder: &mut Builder) -> Result<Stage, SceneError> {
    let shape = builder.bare_field(path)?;
    let index = match material {
        Some(entry) => entry.index,
        None => builder.add_material(clay()),
    };
    let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    builder.field_notices(&name, &shape, index);
    let exposure_ev = exposure(&builder.materials[index as usize]).min(0.0);
    let object = Object {
        name,
        form: Form::Field(shape),
        materials: Arc::from([index]),
        places: vec![Affine3A::IDENTITY],
        track: None,
        ground: false,
    };
    Ok(Stage {
        objects: vec![object],
        ground: true,
        environment: None,
        camera: None,
        field_of_view: LENS,
        exposure_ev,
    })
}

/// What shows the form of something that says nothing of its material: like unglazed clay.
fn clay() -> Material {
    let clay = MaterialKind::MetallicRoughness {
        base_color: Vec3::new(0.62, 0.56, 0.50).into(),
        metallic: 0.0.into(),
        roughness: 0.55.into(),
        transmission: 0.0.into(),
        ior: 1.5,
    };
    Material::new("clay", clay)
}

fn heights(path: &Path, material: Option<MaterialEntry>, builder: &mut Builder) -> Result<Stage, SceneError> {
    let image = halflight_image::load_height(path)?;
    builder.note_file(path);
    if image.filled_voids > 0 {
        builder.warnings.push(format!(
            "{}: {} voids were filled from their neighbours",
            path.display(),
            image.filled_voids
        ));
    }
    let (min, max, scale, offset) = build::relief(&image);
    if image.metres_per_pixel.is_some() && scale > 1.0 {
        builder.warnings.push(format!("{}: heights are exaggerated by {scale:.1}", path.display()));
    }
    let field = halflight_shape::HeightField::from_plane(&image.plane, min, max, scale, offset)
        .map_err(|error| LoadError::new("picture of heights", path, error.to_string()))?;
    let index = material.map_or_else(
        || {
            let rock = Material { name: "rock".into(), ..Material::diffuse(Vec3::new(0.42, 0.37, 0.31)) };
            builder.add_material(rock)
        },
        |entry| entry.index,
    );
    let object = Object {
        name: "landscape".into(),
        form: Form::Heights(HeightSource::Still(Arc::new(field)), OnceLock::new()),
        materials: Arc::from([index]),
        places: vec![Affine3A::IDENTITY],
        track: None,
        ground: false,
    };
    let sky = build::sky_of(24.0, -75.0);
    Ok(Stage {
        objects: vec![object],
        ground: false,
        environment: Some(sky),
        camera: None,
        field_of_view: LENS,
        exposure_ev: 0.0,
    })
}

/// Three balls that show what an environment does: a mirror, dull white, and gold.
fn balls(materials: [Material; 3], builder: &mut Builder) -> Vec<Object> {
    let places = [-2.2, 0.0, 2.2];
    let ball = |(material, x): (Material, f32)| Object {
        name: material.name.clone(),
        form: Form::Spheres(vec![(Vec3::new(x, 1.0, 0.0), 1.0)], OnceLock::new()),
        materials: Arc::from([builder.add_material(material)]),
        places: vec![Affine3A::IDENTITY],
        track: None,
        ground: false,
    };
    materials.into_iter().zip(places).map(ball).collect()
}

fn environment(path: &Path, builder: &mut Builder) -> Result<Stage, SceneError> {
    let environment = build::environment_image(path, builder)?;
    let white = Material { name: "white".into(), ..Material::diffuse(Vec3::splat(0.8)) };
    let gold = build::material_from_text("gold roughness=0.4", builder)?;
    let objects = balls([Material::mirror(), white, gold], builder);
    Ok(Stage {
        objects,
        ground: true,
        environment: Some(environment),
        camera: None,
        field_of_view: LENS,
        exposure_ev: 0.0,
    })
}

fn measured(path: &Path, builder: &mut Builder) -> Result<Stage, SceneError> {
    let file = FilePath::direct(path);
    let material = builder.bare_measured(&file)?;
    let index = builder.add_material(material);
    let ball = halflight_shape::procedural::mesh::shader_ball(256);
    let slots = ball.material_slots.iter().max().map_or(1, |&slot| slot as usize + 1);
    let mut materials = vec![index; slots];
    if let Some(inner) = materials.get_mut(1) {
        *inner = builder.default_material();
    }
    let object = Object {
        name: "ball".into(),
        form: Form::Mesh(build::MeshPart::new(Arc::new(ball))),
        materials: materials.into(),
        places: vec![Affine3A::IDENTITY],
        track: None,
        ground: false,
    };
    Ok(Stage {
        objects: vec![object],
        ground: true,
        environment: None,
        camera: None,
        field_of_view: LENS,
        exposure_ev: 0.0,
    })
}
