//! `[material.NAME]`.

use glam::{Vec2, Vec3};
use halflight_material::{metal, metal_names};

use super::MaterialReference;
use crate::schema::{At, Color, Docs, FilePath, Kind, Problem, ReadValue, Reader, Tagged, Value};
use crate::schema::{at_least, between, fraction, within};
use crate::{choices, record, variants};

choices! {
    /// What a texture shows beyond its borders.
    pub enum WrapName, "texture border" {
        /// The picture again.
        "repeat" => Repeat,
        /// The nearest texel of the border.
        "clamp" => Clamp,
        /// The picture turned over, then again as it was.
        "mirror" => Mirror,
    }
}

choices! {
    /// How the bytes of a texture relate to light.
    pub enum SpaceName, "colour space" {
        /// Encoded with the sRGB curve: colours.
        "srgb" => Srgb,
        /// As they are: data.
        "linear" => Linear,
    }
}

record! {
    /// A picture on a surface. A text alone is its file.
    pub struct TextureSpec, "texture" {
        /// `.png`, `.jpg`, `.exr`, `.hdr` or `.tif`.
        #[example = "\"wood.png\""]
        file: FilePath,
        /// Multiplies the picture.
        #[example = "[1, 0.9, 0.8]"]
        factor: Color = Color::grey(1.0) => at_least(0.0),
        /// Repetitions over the texture coordinates, across and down.
        #[example = "[4, 4]"]
        repeat: Vec2 = Vec2::ONE,
        /// Shift, in pictures.
        #[example = "[0.5, 0]"]
        offset: Vec2 = Vec2::ZERO,
        /// Rotation of the texture coordinates.
        #[unit = "degrees"]
        #[example = "90"]
        rotation_degrees: f32 = 0.0,
        /// What is seen beyond its borders.
        #[example = "\"clamp\""]
        wrap: WrapName = WrapName::Repeat,
        /// How its bytes relate to light. Without it: sRGB for colours, linear for everything else.
        #[example = "\"linear\""]
        space: Option<SpaceName>,
        /// Which channel gives the number, where one number is needed: 0 red, 1 green, 2 blue, 3 alpha.
        #[example = "1"]
        channel: Option<u32> => within(0.0, 3.0),
    }
}

fn texture(value: &Value, reader: &mut Reader) -> Option<TextureSpec> {
    if let Kind::Text(_) = value.kind {
        let file = FilePath::read_value(value, reader)?;
        let defaults = Color::grey(1.0);
        return Some(TextureSpec {
            file,
            factor: defaults,
            repeat: Vec2::ONE,
            offset: Vec2::ZERO,
            rotation_degrees: 0.0,
            wrap: WrapName::Repeat,
            space: None,
            channel: None,
        });
    }
    TextureSpec::read_value(value, reader)
}

/// A colour, or a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorSetting {
    /// The same everywhere.
    Constant(Color),
    /// From a picture.
    Texture(TextureSpec),
}

impl ColorSetting {
    /// The same amount of red, green and blue everywhere.
    pub const fn grey(x: f32) -> Self {
        Self::Constant(Color::grey(x))
    }
}

impl ReadValue for ColorSetting {
    fn expected() -> String {
        "a colour (`[r, g, b]`, one number, `\"#rrggbb\"`), a picture's file, or a table (texture)".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Text(text) if text.starts_with('#') => Color::read_value(value, reader).map(Self::Constant),
            Kind::Text(_) | Kind::Table(_) => texture(value, reader).map(Self::Texture),
            Kind::Integer(_) | Kind::Float(_) => Color::read_value(value, reader).map(Self::Constant),
            Kind::List(items) if items.len() == 3 => Color::read_value(value, reader).map(Self::Constant),
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn written(&self) -> String {
        match self {
            Self::Constant(color) => color.written(),
            Self::Texture(_) => String::new(),
        }
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        if let Self::Constant(color) = self {
            color.numbers(visit);
        }
    }
    fn section() -> Option<&'static str> {
        TextureSpec::section()
    }
    fn document(docs: &mut Docs) {
        TextureSpec::document(docs);
    }
}

/// A number, or one channel of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarSetting {
    /// The same everywhere.
    Constant(f32),
    /// From a picture.
    Texture(TextureSpec),
}

impl ReadValue for ScalarSetting {
    fn expected() -> String {
        "a number, a picture's file, or a table (texture)".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Text(_) | Kind::Table(_) => texture(value, reader).map(Self::Texture),
            Kind::Integer(_) | Kind::Float(_) => f32::read_value(value, reader).map(Self::Constant),
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn written(&self) -> String {
        match self {
            Self::Constant(x) => x.written(),
            Self::Texture(_) => String::new(),
        }
    }
    fn numbers(&self, visit: &mut dyn FnMut(f64)) {
        if let Self::Constant(x) = self {
            visit(f64::from(*x));
        }
    }
    fn section() -> Option<&'static str> {
        TextureSpec::section()
    }
    fn document(docs: &mut Docs) {
        TextureSpec::document(docs);
    }
}

record! {
    /// Small bumps. A text alone is its file.
    pub struct NormalMapTable, "normal map" {
        /// The picture: (r, g, b) means the normal (2r − 1, 2g − 1, 2b − 1), +y up as in OpenGL and glTF.
        #[example = "\"bricks_normal.png\""]
        file: FilePath,
        /// Multiplies the slopes.
        #[example = "0.5"]
        scale: f32 = 1.0,
        /// Repetitions over the texture coordinates, across and down.
        #[example = "[4, 4]"]
        repeat: Vec2 = Vec2::ONE,
        /// What is seen beyond its borders.
        #[example = "\"clamp\""]
        wrap: WrapName = WrapName::Repeat,
    }
}

/// A normal map: a table, or a file alone.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMapSpec(pub NormalMapTable);

impl ReadValue for NormalMapSpec {
    fn expected() -> String {
        "a picture's file, or a table (normal map)".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        if let Kind::Text(_) = value.kind {
            let file = FilePath::read_value(value, reader)?;
            return Some(Self(NormalMapTable {
                file,
                scale: 1.0,
                repeat: Vec2::ONE,
                wrap: WrapName::Repeat,
            }));
        }
        NormalMapTable::read_value(value, reader).map(Self)
    }
    fn section() -> Option<&'static str> {
        NormalMapTable::section()
    }
    fn document(docs: &mut Docs) {
        NormalMapTable::document(docs);
    }
}

record! {
    /// Moves the vertices of a mesh along their normals, by a picture.
    pub struct DisplacementSpec, "displacement" {
        /// The picture; its red channel counts.
        #[example = "\"rocks_height.png\""]
        file: FilePath,
        /// Height of the value 1.
        #[unit = "metres, in the shape's own space"]
        #[example = "0.05"]
        scale: f32,
        /// The value that stays where it is.
        #[example = "0.5"]
        middle: f32 = 0.0,
        /// What counts beyond the picture's borders. Without it: "clamp" where all texture coordinates of the mesh are
        /// from 0 to 1, so that opposite borders do not mix, and "repeat" elsewhere.
        #[example = "\"repeat\""]
        wrap: Option<WrapName>,
        /// Longest edge after the mesh has been cut finer for it. Without it, a hundredth of the mesh's diagonal.
        #[unit = "metres, in the shape's own space"]
        #[example = "0.01"]
        edge: Option<f32> => crate::schema::positive(),
    }
}

record! {
    /// Keys of every material.
    pub struct MaterialCommon, "material keys" {
        /// Radiance that it emits beside what it scatters: a colour, or a texture.
        #[unit = "radiance"]
        #[example = "[5, 4, 3]"]
        emission: Option<ColorSetting> => at_least(0.0),
        /// Whether it scatters (and shines) from behind as from the front. Without it: yes.
        #[example = "false"]
        two_sided: Option<bool>,
        /// Small bumps, as a picture of normals.
        #[example = "\"bricks_normal.png\""]
        normal_map: Option<NormalMapSpec>,
        /// How much of it is there, from 0 to 1; light goes straight through the rest. Of a texture the alpha channel
        /// counts unless it says otherwise. Shadows have the same holes; a passage counts as no scattering. Layers and
        /// techniques other than `path` show it as if it were solid.
        #[example = "\"leaf.png\""]
        opacity: Option<ScalarSetting> => fraction(),
        /// Instead of letting a part through: there, wholly, where the opacity is at least this, else not at all.
        #[example = "0.5"]
        opacity_cutoff: Option<f32> => fraction(),
        /// Large bumps, which move the vertices of shapes with this material. Those of `spheres` and height fields stay
        /// where they are.
        #[example = "{ file = \"rocks.png\", scale = 0.05 }"]
        displacement: Option<DisplacementSpec>,
    }
}

record! {
    /// Lambert's surface.
    pub struct DiffuseSpec, "diffuse" {
        /// The part of the light it gives back.
        #[example = "[0.7, 0.5, 0.4]"]
        albedo: ColorSetting = ColorSetting::grey(0.7) => fraction(),
    }
}

record! {
    /// A shining lobe.
    pub struct PhongSpec, "phong" {
        /// Albedo of the diffuse part.
        #[example = "[0.2, 0.05, 0.05]"]
        diffuse: ColorSetting = ColorSetting::grey(0.5) => fraction(),
        /// What the lobe reflects at normal incidence.
        #[example = "0.4"]
        specular: ColorSetting = ColorSetting::grey(0.3) => fraction(),
        /// Power of the cosine: larger is sharper.
        #[example = "100"]
        exponent: ScalarSetting = ScalarSetting::Constant(40.0) => within(0.0, 1e6),
    }
}

/// A metal whose complex index of refraction is built in.
#[derive(Clone, Debug, PartialEq)]
pub struct Metal {
    /// Real part of the index at red, green and blue.
    pub eta: Vec3,
    /// Imaginary part.
    pub k: Vec3,
}

impl ReadValue for Metal {
    fn expected() -> String {
        let names: Vec<String> = metal_names().map(|name| format!("`\"{name}\"`")).collect();
        format!("a metal: {}", names.join(", "))
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let name = String::read_value(value, reader)?;
        match metal(&name) {
            Some((eta, k)) => Some(Self { eta, k }),
            None => {
                let problem = Problem::new(&value.origin, format!("the metal \"{name}\" is not built in"));
                let problem = problem.offer(&name, metal_names());
                reader.report(problem.help("others can be given by `color`, or by `eta` and `k`"));
                None
            }
        }
    }
}

record! {
    /// Metal.
    pub struct ConductorSpec, "conductor" {
        /// What a flat piece reflects at normal incidence. Without it and the other keys of colour: 0.9.
        #[example = "[1.0, 0.78, 0.34]"]
        color: Option<ColorSetting> => fraction(),
        /// Instead of a colour: a metal by name.
        #[example = "\"gold\""]
        metal: Option<Metal>,
        /// Instead of a colour, with `k`: the real part of the index of refraction at red, green and blue.
        #[example = "[0.2, 0.92, 1.1]"]
        eta: Option<At<Color>> => at_least(0.0),
        /// With `eta`: the imaginary part.
        #[example = "[3.91, 2.45, 2.14]"]
        k: Option<At<Color>> => at_least(0.0),
        /// 0 is a mirror, 1 is dull; the width of the GGX distribution is α = roughness².
        #[example = "0.1"]
        roughness: ScalarSetting = ScalarSetting::Constant(0.3) => fraction(),
        /// Stretches highlights along the tangent (above 0) or across it (below 0).
        #[example = "0.8"]
        anisotropy: f32 = 0.0 => within(-1.0, 1.0),
    }
}

record! {
    /// Glass.
    pub struct DielectricSpec, "dielectric" {
        /// Index of refraction: 1.33 for water, 1.5 for glass, 2.4 for diamond.
        #[example = "1.33"]
        ior: f32 = 1.5 => within(0.1, 10.0),
        /// 0 is clear, 1 is frosted; α = roughness².
        #[example = "0.4"]
        roughness: ScalarSetting = ScalarSetting::Constant(0.0) => fraction(),
        /// Multiplies what goes through, at each border.
        #[example = "[0.9, 1, 0.95]"]
        tint: ColorSetting = ColorSetting::grey(1.0) => fraction(),
    }
}

record! {
    /// glTF's metallic-roughness model.
    pub struct MetallicRoughnessSpec, "metallic-roughness" {
        /// Albedo of the dielectric, reflectance of the metal.
        #[example = "\"robot_color.png\""]
        base_color: ColorSetting = ColorSetting::grey(0.8) => fraction(),
        /// 0 is a dielectric (paint, plastic), 1 is a metal. Of a texture: its blue channel, unless it says otherwise.
        #[example = "1"]
        metallic: ScalarSetting = ScalarSetting::Constant(0.0) => fraction(),
        /// 0 is smooth, 1 is dull; α = roughness². Of a texture: its green channel, unless it says otherwise.
        #[example = "0.2"]
        roughness: ScalarSetting = ScalarSetting::Constant(0.5) => fraction(),
        /// The part of the diffuse light that goes straight through, as through a thin wall.
        #[example = "0.5"]
        transmission: ScalarSetting = ScalarSetting::Constant(0.0) => fraction(),
        /// Index of refraction of the dielectric.
        #[example = "1.4"]
        ior: f32 = 1.5 => between(1.0, 10.0),
    }
}

choices! {
    /// How a measured table is looked up.
    pub enum Interpolation, "look-up" {
        /// The nearest entry, as the MERL database's own reader does.
        "nearest" => Nearest,
        /// Interpolated between entries.
        "linear" => Linear,
    }
}

record! {
    /// Measured reflectance.
    pub struct MeasuredSpec, "measured" {
        /// A MERL `.binary` file.
        #[example = "\"gold-paint.binary\""]
        file: FilePath,
        /// How it is looked up.
        #[example = "\"nearest\""]
        interpolation: Interpolation = Interpolation::Linear,
    }
}

record! {
    /// Light alone.
    pub struct EmissiveSpec, "emissive" {
        /// Radiance: a colour, or a texture.
        #[unit = "radiance"]
        #[example = "[17, 12, 4]"]
        radiance: ColorSetting = ColorSetting::grey(1.0) => at_least(0.0),
    }
}

record! {
    /// Two materials on one surface.
    pub struct MixSpec, "mix" {
        /// What there is where the mask is 0: a material by name, or its table. Only how it scatters counts.
        #[example = "\"red paint\""]
        first: MaterialReference,
        /// What there is where the mask is 1. Either may be a mix itself, for more than two.
        #[example = "\"blue paint\""]
        second: MaterialReference,
        /// The share of the second: one for all of the surface, or from a picture, whose red channel counts unless it says
        /// otherwise.
        #[example = "{ file = \"checker.png\", repeat = [4, 4] }"]
        mask: ScalarSetting = ScalarSetting::Constant(0.5) => fraction(),
    }
}

record! {
    /// A mirror.
    pub struct MirrorSpec, "mirror" {
        /// What it reflects.
        #[example = "0.9"]
        color: ColorSetting = ColorSetting::grey(1.0) => fraction(),
    }
}

variants! {
    /// What surfaces are made of. A shape names its material, or holds the table itself.
    pub enum MaterialKindSpec, "[material.NAME]" {
        /// Lambert's surface: plaster, clay, paper.
        "diffuse" => Diffuse(DiffuseSpec),
        /// A diffuse part and a normalised power-cosine lobe about the mirror direction: old-fashioned plastic.
        "phong" => Phong(PhongSpec),
        /// Metal: a rough GGX surface with the Fresnel reflectance of a complex index of refraction, or of a colour.
        "conductor" => Conductor(ConductorSpec),
        /// Glass, water: reflects and refracts, smooth or rough.
        "dielectric" => Dielectric(DielectricSpec),
        /// glTF 2.0's model: paint, plastic, wood, metal.
        "metallic-roughness" => MetallicRoughness(MetallicRoughnessSpec),
        /// A table of measurements in the layout of the MERL database.
        "measured" => Measured(MeasuredSpec),
        /// Two materials of any kind on one surface, by a mask: f = (1 − mask) first + mask second. What they have beside how
        /// they scatter (emission, bumps, opacity) belongs to the mix.
        "mix" => Mix(MixSpec),
        /// An ideal mirror.
        "mirror" => Mirror(MirrorSpec),
        /// Shines, and scatters nothing. One-sided unless it says otherwise.
        "emissive" => Emissive(EmissiveSpec),
    }
}

/// A material.
pub type MaterialSpec = Tagged<MaterialCommon, MaterialKindSpec>;

/// A material of the given kind with its other keys absent.
pub(crate) fn plain(kind: MaterialKindSpec, value: &Value) -> MaterialSpec {
    let common = MaterialCommon {
        emission: None,
        two_sided: None,
        normal_map: None,
        opacity: None,
        opacity_cutoff: None,
        displacement: None,
    };
    Tagged { origin: value.origin.clone(), common, kind }
}

/// The keys of materials, for the reader of `--material`.
pub(crate) fn measured(file: FilePath) -> MaterialKindSpec {
    MaterialKindSpec::Measured(MeasuredSpec { file, interpolation: Interpolation::Linear })
}
