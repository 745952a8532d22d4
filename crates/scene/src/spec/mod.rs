//! What a scene file may say, key by key. The reference page `docs/scene-format.md` is made from these declarations.

mod camera;
mod height;
mod light;
mod material;
mod medium;
mod shape;
mod transform;

pub use camera::{CameraKey, CameraSpec, ImageSpec, ToneName};
pub use height::{
    BumpSpec, FractalSpec, HeightImageSpec, HeightKind, ImageSequenceSpec, OceanSpec, SineSpec, SinesSpec,
};
pub use light::{
    ConstantEnvironment, DirectionalLightSpec, DiskLightSpec, EnvironmentCommon, EnvironmentKind,
    EnvironmentSpec, ImageEnvironment, LightKind, LightSpec, MapLayout, NamedLight, PointLightSpec,
    RectangleLightSpec, SkySpec, SphereLightSpec,
};
pub use material::{
    ColorSetting, ConductorSpec, DielectricSpec, DiffuseSpec, DisplacementSpec, EmissiveSpec, Interpolation,
    MaterialCommon, MaterialKindSpec, MaterialSpec, MeasuredSpec, Metal, MetallicRoughnessSpec, MirrorSpec,
    MixSpec, NormalMapSpec, NormalMapTable, PhongSpec, ScalarSetting, SpaceName, TextureSpec, WrapName,
};
pub use medium::MediumSpec;
pub use shape::{
    BoxSpec, DiskSpec, GeneratedName, GeneratedSpec, HeightFieldSpec, HeightsSpec, MaterialReference,
    MeshSpec, PlaneSpec, RectangleSpec, Shading, ShapeCommon, ShapeKind, ShapeSpec, SphereSpec, SpheresSpec,
    TrianglesSpec,
};
pub use transform::{AxisAngle, Ease, MatrixRows, Rotation, Scale, TransformKey, TransformSpec};

pub(crate) use material::{measured, plain};

use crate::record;
use crate::schema::{At, Docs, Entry, Kind, Problem, ReadValue, Reader, Table, Value};

record! {
    /// The tables at the top of a scene file. Paths are relative to the scene file; lengths are metres, times seconds,
    /// angles degrees where the key says so; colours are linear Rec. 709 (`[r, g, b]`, one number for grey, or
    /// `"#rrggbb"` in sRGB). The world is right-handed with +y up.
    pub struct SceneSpec, "scene" {
        /// One line that says what the scene shows.
        #[example = "\"a still life\""]
        description: Option<String>,
        /// The picture.
        image: ImageSpec,
        /// The camera. Without it the scene is framed from the front, a little to the right and above.
        camera: Option<CameraSpec>,
        /// The light from all around. Without it, and without any other light, the built-in studio lights the scene.
        #[example = "\"studio\""]
        environment: Option<EnvironmentSpec>,
        /// Lights other than the environment, each a `[[light]]`.
        light: Vec<At<LightSpec>>,
        /// Materials by name, each a `[material.NAME]`.
        material: Named<MaterialSpec>,
        /// Shapes, each a `[[shape]]`.
        shape: Vec<At<ShapeSpec>>,
        /// What light meets between surfaces, each a `[[medium]]`.
        medium: Vec<At<MediumSpec>>,
        /// Settings of techniques, each a `[technique.NAME]`, with the keys that the technique's own page lists.
        technique: RawTables,
    }
}

/// Values by name, in the order they were written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Named<T>(pub Vec<(At<String>, T)>);

fn entries_of<'a>(value: &'a Value, reader: &mut Reader, expected: &str) -> Option<&'a [Entry]> {
    if let Kind::Table(table) = &value.kind {
        return Some(&table.entries);
    }
    reader.mistaken(value, expected);
    None
}

impl<T: ReadValue> ReadValue for Named<T> {
    fn expected() -> String {
        format!("named tables, each {}", T::expected())
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let mut named = Vec::new();
        let mut whole = true;
        for entry in entries_of(value, reader, &Self::expected())? {
            match T::read_value(&entry.value, reader) {
                Some(read) => named.push((At { origin: entry.key.clone(), value: entry.name.clone() }, read)),
                None => whole = false,
            }
        }
        whole.then_some(Self(named))
    }
    fn absent() -> Option<Self> {
        Some(Self(Vec::new()))
    }
    fn section() -> Option<&'static str> {
        T::section()
    }
    fn document(docs: &mut Docs) {
        T::document(docs);
    }
}

/// Tables by name that someone else reads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawTables(pub Vec<(At<String>, Table)>);

impl ReadValue for RawTables {
    fn expected() -> String {
        "named tables".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let mut tables = Vec::new();
        for entry in entries_of(value, reader, &Self::expected())? {
            let Kind::Table(table) = &entry.value.kind else {
                let message = format!(
                    "expected the settings of the technique `{}`, found {}",
                    entry.name,
                    entry.value.found()
                );
                let help = format!("write [technique.{}] and the settings below it", entry.name);
                reader.report(Problem::new(&entry.value.origin, message).help(help));
                continue;
            };
            tables.push((At { origin: entry.key.clone(), value: entry.name.clone() }, table.clone()));
        }
        Some(Self(tables))
    }
    fn absent() -> Option<Self> {
        Some(Self(Vec::new()))
    }
}

/// The page `docs/scene-format.md`: every table and key of a scene file, made from the types that read them.
pub fn scene_format_markdown() -> String {
    let mut docs = Docs::new();
    <SceneSpec as ReadValue>::document(&mut docs);
    <TransformSpec as ReadValue>::document(&mut docs);
    format!("{INTRODUCTION}\n{}", docs.markdown())
}

const INTRODUCTION: &str = r##"# The scene format

<!-- Made from the types in crates/scene/src/spec by `cargo run -p halflight-scene --example scene_format`. -->

A scene is a [TOML](https://toml.io) file. A small one:

```toml
[image]
size = [640, 480]

[camera]
origin = [3, 2, 5]
target = [0, 0.5, 0]
vertical_fov_degrees = 30

[environment]
file = "hall.hdr"

[material.clay]
type = "diffuse"
albedo = [0.7, 0.5, 0.4]

[[shape]]
type = "mesh"
file = "bunny.ply"
material = "clay"
transform = { scale = 10, translate = [0, -0.33, 0] }

[[shape]]
type = "plane"
material = { type = "diffuse", albedo = 0.5 }
```

Unknown keys, wrong types, missing files and impossible values are errors that point at the line and offer the nearest
name. A file whose name ends in `.xz` is unpacked while it is read. Any key can be set from the command line, as in
`--set camera.aperture_radius=0.05` or `--set shape.bunny.material=clay` (an element of a list goes by its `name`, or by
its place counted from 0).
"##;

/// Reads a scene file's table.
pub(crate) fn read_spec(table: &Table) -> Result<SceneSpec, crate::schema::Problems> {
    crate::schema::read::<SceneSpec>(table)
}
