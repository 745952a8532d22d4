//! `[environment]` and `[[light]]`.

use glam::{Vec2, Vec3};

use super::material::ColorSetting;
use crate::schema::{
    At, Color, Docs, FilePath, Kind, NoKeys, Problem, ReadValue, Reader, Record, Table, Tagged,
};
use crate::schema::{Value, Variants, at_least, fraction, positive, within};
use crate::{choices, record, variants};

choices! {
    /// How the sphere of directions lies in the picture of an environment.
    pub enum MapLayout, "map layout" {
        /// Latitude–longitude: the centre column looks along −z, +x lies to its right, the top row is +y.
        "latlong" => LatLong,
        /// Angular map (light probe): −z in the middle of a disk, +z all along its rim, radius proportional to the angle.
        "angular" => Angular,
    }
}

record! {
    /// Keys of every environment.
    pub struct EnvironmentCommon, "environment keys" {
        /// Turns the environment about the vertical, counter-clockwise seen from above.
        #[unit = "degrees"]
        #[example = "90"]
        rotation_degrees: f32 = 0.0,
        /// Multiplies the light; a colour tints it.
        #[example = "2.5"]
        intensity: Color = Color::grey(1.0) => at_least(0.0),
        /// Keeps only so many bands of spherical harmonics, softened until nothing is negative: the light that
        /// techniques of a few bands see, to compare them with path tracing under the same light.
        #[example = "4"]
        bands: Option<u32> => within(1.0, 8.0),
    }
}

record! {
    /// A picture.
    pub struct ImageEnvironment, "environment image" {
        /// `.exr`, `.hdr`, or as a last resort `.png` or `.jpg` (whose values end at 1).
        #[example = "\"hall.hdr\""]
        file: FilePath,
        /// How directions lie in it.
        #[example = "\"angular\""]
        layout: MapLayout = MapLayout::LatLong,
    }
}

record! {
    /// One colour.
    pub struct ConstantEnvironment, "constant environment" {
        /// Radiance from every direction.
        #[unit = "radiance"]
        #[example = "[0.4, 0.6, 1.0]"]
        color: Color = Color::grey(1.0) => at_least(0.0),
    }
}

record! {
    /// A clear sky with its sun.
    pub struct SkySpec, "sky" {
        /// Height of the sun above the horizon.
        #[unit = "degrees"]
        #[example = "15"]
        sun_elevation_degrees: f32 = 43.0 => within(1.0, 90.0),
        /// Where the sun stands: 0 is −z, 90 is +x.
        #[unit = "degrees"]
        #[example = "120"]
        sun_azimuth_degrees: f32 = -40.0,
        /// Haze: 2 is very clear, 10 is hazy.
        #[example = "5"]
        turbidity: f32 = 3.0 => within(1.7, 10.0),
        /// What the ground below the horizon gives back.
        #[example = "0.3"]
        ground_albedo: f32 = 0.2 => fraction(),
    }
}

variants! {
    /// The light from all around. `environment = "studio"` and `environment = "hall.hdr"` are short for a table.
    pub enum EnvironmentKind, "[environment]" {
        /// A picture of light; a table with `file` and no `type` is one.
        "image" => Image(ImageEnvironment) if "file",
        /// Built in: a clear sky with the sun.
        "sky" => Sky(SkySpec) if "sun_elevation_degrees",
        /// Built in: a photographer's studio with soft boxes.
        "studio" => Studio(NoKeys),
        /// The same from every direction; a table with `color` and no `type` is one.
        "constant" => Constant(ConstantEnvironment) if "color",
        /// No light from around.
        "black" => Black(NoKeys),
    }
}

/// An environment: a table, a word, or the name of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentSpec(pub Tagged<EnvironmentCommon, EnvironmentKind>);

impl ReadValue for EnvironmentSpec {
    fn expected() -> String {
        "a table, a file, or one of `\"studio\"`, `\"sky\"`, `\"black\"`".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let Kind::Text(text) = &value.kind else {
            return Tagged::read_value(value, reader).map(Self);
        };
        let names = <EnvironmentKind as Variants>::names();
        let common = EnvironmentCommon::read_keys(&Table::empty(), "", &mut Reader::new())?;
        let kind = if names.contains(&text.as_str()) {
            return Tagged::read_value(value, reader).map(Self);
        } else if let Some(color) = Color::from_hex(text) {
            EnvironmentKind::Constant(ConstantEnvironment { color })
        } else if halflight_file::extension(std::path::Path::new(text)).is_empty() {
            let problem =
                Problem::new(&value.origin, format!("expected an environment, found the text {text:?}"));
            reader.report(
                problem.offer(text, names.iter().copied()).help("or name a picture: `.exr`, `.hdr`, `.png`"),
            );
            return None;
        } else {
            let file = FilePath::read_value(value, reader)?;
            EnvironmentKind::Image(ImageEnvironment { file, layout: MapLayout::LatLong })
        };
        Some(Self(Tagged { origin: value.origin.clone(), common, kind }))
    }
    fn section() -> Option<&'static str> {
        Some(EnvironmentKind::TITLE)
    }
    fn document(docs: &mut Docs) {
        Tagged::<EnvironmentCommon, EnvironmentKind>::document(docs);
    }
}

record! {
    /// Keys of every light.
    pub struct NamedLight, "light keys" {
        /// A name, for `--set light.NAME.key=value`.
        #[example = "\"key\""]
        name: Option<At<String>>,
    }
}

record! {
    /// A point.
    pub struct PointLightSpec, "point light" {
        /// Where it stands.
        #[unit = "metres"]
        #[example = "[0, 2, 0]"]
        position: Vec3,
        /// Radiant intensity: a surface at distance d that faces it receives intensity / d².
        #[unit = "radiance · m²"]
        #[example = "[10, 9, 8]"]
        intensity: Color => at_least(0.0),
    }
}

record! {
    /// Parallel light.
    pub struct DirectionalLightSpec, "directional light" {
        /// Where the light travels to.
        #[example = "[-1, -2, -1]"]
        direction: At<Vec3>,
        /// Irradiance of a surface that faces the light. A white diffuse surface then has radiance irradiance / π.
        #[unit = "radiance · sr"]
        #[example = "3"]
        irradiance: Color => at_least(0.0),
    }
}

record! {
    /// A shining rectangle.
    pub struct RectangleLightSpec, "rectangle light" {
        /// Its middle.
        #[unit = "metres"]
        #[example = "[0, 3, 0]"]
        position: Vec3,
        /// A point it faces. Only the side that faces it shines.
        #[unit = "metres"]
        #[example = "[0, 0, 0]"]
        target: At<Vec3>,
        /// Width and height.
        #[unit = "metres"]
        #[example = "[1, 0.5]"]
        size: Vec2 = Vec2::ONE => positive(),
        /// Radiance: a colour, or a texture.
        #[unit = "radiance"]
        #[example = "[17, 12, 4]"]
        radiance: ColorSetting => at_least(0.0),
        /// Whether both sides shine.
        #[example = "true"]
        two_sided: bool = false,
    }
}

record! {
    /// A shining disk.
    pub struct DiskLightSpec, "disk light" {
        /// Its middle.
        #[unit = "metres"]
        #[example = "[0, 3, 0]"]
        position: Vec3,
        /// A point it faces. Only the side that faces it shines.
        #[unit = "metres"]
        #[example = "[0, 0, 0]"]
        target: At<Vec3>,
        /// Radius.
        #[unit = "metres"]
        #[example = "0.25"]
        radius: f32 = 0.5 => positive(),
        /// Radiance: a colour, or a texture.
        #[unit = "radiance"]
        #[example = "20"]
        radiance: ColorSetting => at_least(0.0),
        /// Whether both sides shine.
        #[example = "true"]
        two_sided: bool = false,
    }
}

record! {
    /// A shining sphere.
    pub struct SphereLightSpec, "sphere light" {
        /// Its middle.
        #[unit = "metres"]
        #[example = "[0, 3, 0]"]
        position: Vec3,
        /// Radius.
        #[unit = "metres"]
        #[example = "0.1"]
        radius: f32 = 0.1 => positive(),
        /// Radiance: a colour, or a texture.
        #[unit = "radiance"]
        #[example = "30"]
        radiance: ColorSetting => at_least(0.0),
    }
}

variants! {
    /// Lights other than the environment. Any shape with an emissive material is a light too.
    pub enum LightKind, "[[light]]" {
        /// Shines from a point, the same in every direction.
        "point" => Point(PointLightSpec),
        /// Shines from infinitely far away, as the sun.
        "directional" => Directional(DirectionalLightSpec),
        /// A rectangle that shines to one side, and is seen by the camera.
        "rectangle" => Rectangle(RectangleLightSpec),
        /// A disk that shines to one side, and is seen by the camera.
        "disk" => Disk(DiskLightSpec),
        /// A sphere that shines outwards, and is seen by the camera.
        "sphere" => Sphere(SphereLightSpec),
    }
}

/// A light.
pub type LightSpec = Tagged<NamedLight, LightKind>;
