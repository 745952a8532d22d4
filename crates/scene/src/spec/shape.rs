//! `[[shape]]`.

use glam::{Vec2, Vec3};

use super::height::HeightKind;
use super::material::MaterialSpec;
use super::transform::{Ease, TransformKey, TransformSpec};
use crate::schema::{
    At, Docs, FilePath, Kind, NoKeys, ReadValue, Reader, Tagged, Value, at_least, positive, within,
};
use crate::{choices, record, variants};

choices! {
    /// Which normals shade a surface.
    pub enum Shading, "shading" {
        /// Those of the triangles: facets show.
        "flat" => Flat,
        /// Interpolated between the vertices; computed where the file has none.
        "smooth" => Smooth,
    }
}

/// A material by its name, or its table.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialReference {
    /// The name of a `[material.NAME]`.
    Named(At<String>),
    /// The material itself.
    Inline(Box<MaterialSpec>),
}

impl ReadValue for MaterialReference {
    fn expected() -> String {
        "the name of a material, or a material's table".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::Text(_) => At::read_value(value, reader).map(Self::Named),
            Kind::Table(_) => {
                MaterialSpec::read_value(value, reader).map(|spec| Self::Inline(Box::new(spec)))
            }
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
    fn section() -> Option<&'static str> {
        MaterialSpec::section()
    }
    fn document(docs: &mut Docs) {
        MaterialSpec::document(docs);
    }
}

record! {
    /// Keys of every shape.
    pub struct ShapeCommon, "shape keys" {
        /// A name, for messages and for `--set shape.NAME.key=value`.
        #[example = "\"bunny\""]
        name: Option<At<String>>,
        /// What it is made of. Without it: what the file says, else a light grey diffuse material.
        #[example = "\"clay\""]
        material: Option<MaterialReference>,
        /// From its own space to the world.
        #[example = "{ translate = [0, 1, 0], scale = 2 }"]
        transform: Option<TransformSpec>,
        /// Its motion, applied after `transform`.
        #[example = "[{ time = 0 }, { time = 1, translate = [1, 0, 0] }]"]
        keyframes: Vec<At<TransformKey>>,
        /// What happens before the first and after the last keyframe.
        #[example = "\"loop\""]
        repeat: Ease = Ease::Hold,
        /// Places where copies stand instead of the one; each is applied after `transform` and before `keyframes`.
        #[example = "[{ translate = [-1, 0, 0] }, { translate = [1, 0, 0] }]"]
        instances: Vec<TransformSpec>,
    }
}

record! {
    /// A mesh from a file.
    pub struct MeshSpec, "mesh" {
        /// `.ply`, `.obj`, `.gltf` or `.glb`; glTF brings its own hierarchy, materials,
        /// animation and lights (their candela count as radiance × m², their lux as irradiance).
        #[example = "\"bunny.ply\""]
        file: FilePath,
        /// Which normals shade it. Without it: those of the file, or flat if it has none.
        #[example = "\"flat\""]
        shading: Option<Shading>,
        /// Seconds of the file's animation per second.
        #[example = "0.5"]
        animation_speed: f64 = 1.0,
        /// Time in the file's animation at time 0.
        #[unit = "seconds"]
        #[example = "0.25"]
        animation_start: f64 = 0.0,
        /// Whether the animation begins again after its end.
        #[example = "false"]
        animation_loop: bool = true,
        /// A field that was learned from the mesh (`halflight ddf train`) and answers rays in its place.
        #[example = "\"bunny.ddf\""]
        field: Option<FilePath>,
        /// Whether the mesh is asked wherever the field is in doubt, and confirms its hits.
        #[example = "true"]
        field_fallback: bool = false,
    }
}

record! {
    /// A learned field of directed distances.
    pub struct FieldSpec, "field" {
        /// What `halflight ddf train` wrote.
        #[example = "\"bunny.ddf\""]
        file: FilePath,
        /// The mesh that it was learned from: it is asked wherever the field is in doubt, and confirms the field's hits.
        #[example = "\"bunny.ply\""]
        mesh: Option<FilePath>,
    }
}

record! {
    /// Triangles written in the scene file.
    pub struct TrianglesSpec, "triangles" {
        /// The vertices.
        #[unit = "metres"]
        #[example = "[[0, 0, 0], [1, 0, 0], [0, 1, 0]]"]
        positions: At<Vec<Vec3>>,
        /// Three vertices each, counted from 0, counter-clockwise seen from the front.
        #[example = "[[0, 1, 2]]"]
        triangles: At<Vec<[u32; 3]>>,
        /// A normal for each vertex; without them the triangles are flat.
        #[example = "[[0, 0, 1], [0, 0, 1], [0, 0, 1]]"]
        normals: Option<At<Vec<Vec3>>>,
        /// Texture coordinates for each vertex, v downwards from the top of the picture.
        #[example = "[[0, 1], [1, 1], [0, 0]]"]
        uvs: Option<At<Vec<Vec2>>>,
    }
}

record! {
    /// A sphere.
    pub struct SphereSpec, "sphere" {
        /// Its middle.
        #[unit = "metres"]
        #[example = "[0, 0.5, 0]"]
        center: Vec3 = Vec3::ZERO,
        /// Its radius.
        #[unit = "metres"]
        #[example = "0.5"]
        radius: f32 = 1.0 => positive(),
    }
}

record! {
    /// Spheres.
    pub struct SpheresSpec, "spheres" {
        /// For each its middle and its radius.
        #[unit = "metres"]
        #[example = "[[0, 0.5, 0, 0.5], [1, 0.2, 0, 0.2]]"]
        spheres: Option<At<Vec<[f32; 4]>>>,
        /// Instead of them: a `.gltf` or `.glb` whose nodes without children are the spheres, about their origins and with
        /// their scales as radii. They move with its animation, which plays once; an open shutter does not blur them.
        #[example = "\"marbles.glb\""]
        file: Option<FilePath>,
    }
}

record! {
    /// A rectangle.
    pub struct RectangleSpec, "rectangle" {
        /// Sizes along x and y.
        #[unit = "metres"]
        #[example = "[2, 1]"]
        size: Vec2 = Vec2::splat(1.0) => positive(),
    }
}

record! {
    /// A disk.
    pub struct DiskSpec, "disk" {
        /// Its radius.
        #[unit = "metres"]
        #[example = "0.5"]
        radius: f32 = 1.0 => positive(),
    }
}

record! {
    /// The ground.
    pub struct PlaneSpec, "plane" {
        /// Its height.
        #[unit = "metres"]
        #[example = "-0.5"]
        y: f32 = 0.0,
        /// How far it reaches from its middle along x and z.
        #[unit = "metres"]
        #[example = "100"]
        half_extent: f32 = 10.0 => positive(),
    }
}

record! {
    /// A box.
    pub struct BoxSpec, "box" {
        /// Sizes along x, y and z.
        #[unit = "metres"]
        #[example = "[1, 2, 1]"]
        size: Vec3 = Vec3::ONE => positive(),
        /// Radius of rounded edges, at most half of the least size; 0 for sharp edges.
        #[unit = "metres"]
        #[example = "0.05"]
        rounding: At<f32> = At { origin: crate::schema::Origin::nowhere(), value: 0.0 } => at_least(0.0),
    }
}

/// Where the heights come from, as a value.
pub type HeightsSpec = Tagged<NoKeys, HeightKind>;

record! {
    /// A height field.
    pub struct HeightFieldSpec, "height-field" {
        /// Where the heights come from; see [heights](#heights).
        #[example = "{ type = \"fractal\", seed = 7 }"]
        heights: HeightsSpec,
        /// Sizes along x and z, about the origin. Without it: as the file says (GeoTIFF), else 1 metre per post for pictures and 10 × 10 otherwise.
        #[unit = "metres"]
        #[example = "[12, 12]"]
        extent: Option<Vec2> => positive(),
        /// Posts along x and z, for heights that are no picture.
        #[example = "[1024, 1024]"]
        posts: [u32; 2] = [512, 512] => within(2.0, 16384.0),
        /// Which normals shade it.
        #[example = "\"flat\""]
        shading: Shading = Shading::Smooth,
    }
}

choices! {
    /// Meshes that the program makes by itself.
    pub enum GeneratedName, "generated mesh" {
        /// A ring of `radius` (to the middle of its tube) and `tube`, about the y axis.
        "torus" => Torus,
        /// A torus knot of `p` and `q` windings, `radius` and `tube`, about the origin.
        "knot" => Knot,
        /// A ball of nearly equal triangles of `radius`, about the origin.
        "ico-sphere" => IcoSphere,
        /// A cylinder of `radius` and `height`, on y = 0.
        "cylinder" => Cylinder,
        /// A cone of `radius` and `height`, on y = 0.
        "cone" => Cone,
        /// A slender vase, 1 m tall, on y = 0.
        "vase" => Vase,
        /// A round pot with a lid, 0.8 m tall, on y = 0.
        "pot" => Pot,
        /// A tall slab with soft edges, on y = 0.
        "monolith" => Monolith,
        /// A pebble of about `radius`, one for each `seed`, on y = 0.
        "blob" => Blob,
        /// A ball to judge materials by, 1.25 m tall, on y = 0.
        "shader-ball" => ShaderBall,
        /// A standing figure of capsules, `height` tall, facing +z.
        "figure" => Figure,
        /// A sitting rabbit with uneven fur, `height` tall, facing +z, on y = 0.
        "rabbit" => Rabbit,
        /// A robed figure that sits on a round base, `height` tall, facing +z, on y = 0.
        "seated" => Seated,
        /// A winding dragon with scales and spikes, `height` tall, its head at +x, on y = 0.
        "dragon" => Dragon,
        /// A small car, `height` tall, its nose at +z, on y = 0.
        "car" => Car,
    }
}

record! {
    /// A generated mesh.
    pub struct GeneratedSpec, "generated" {
        /// Which.
        #[example = "\"vase\""]
        mesh: GeneratedName,
        /// A mesh, as in `"mesh"`, that takes its place: scaled to its height, its middle where the other's is.
        #[example = "\"bunny.ply\""]
        file: Option<FilePath>,
        /// A radius, for those that have one.
        #[unit = "metres"]
        #[example = "0.5"]
        radius: f32 = 0.5 => positive(),
        /// Radius of the tube of a torus or knot.
        #[unit = "metres"]
        #[example = "0.1"]
        tube: f32 = 0.15 => positive(),
        /// A height, for those that have one.
        #[unit = "metres"]
        #[example = "1.8"]
        height: f32 = 1.0 => positive(),
        /// Windings of a knot around the axis.
        #[example = "3"]
        p: u32 = 2 => within(1.0, 64.0),
        /// Windings of a knot around its ring.
        #[example = "4"]
        q: u32 = 3 => within(1.0, 64.0),
        /// Which of all blobs.
        #[example = "5"]
        seed: u32 = 1,
        /// Pieces around; finer is smoother.
        #[example = "256"]
        detail: u32 = 128 => within(3.0, 2048.0),
        /// Which normals shade it.
        #[example = "\"flat\""]
        shading: Shading = Shading::Smooth,
    }
}

variants! {
    /// What there is to be seen.
    pub enum ShapeKind, "[[shape]]" {
        /// A mesh, or a whole scene graph, from a file.
        "mesh" => Mesh(MeshSpec),
        /// A field of directed distances that was learned from a mesh, and stands where the mesh would.
        "field" => Field(FieldSpec),
        /// Triangles written in the scene file itself.
        "triangles" => Triangles(TrianglesSpec),
        /// An exact sphere.
        "sphere" => Sphere(SphereSpec),
        /// Many spheres at once.
        "spheres" => Spheres(SpheresSpec),
        /// A rectangle about the origin in the plane z = 0, facing +z.
        "rectangle" => Rectangle(RectangleSpec),
        /// A disk about the origin in the plane z = 0, facing +z.
        "disk" => Disk(DiskSpec),
        /// A square of ground, facing +y.
        "plane" => Plane(PlaneSpec),
        /// A box that stands on y = 0 about the y axis, with sharp or rounded edges.
        "box" => Box(BoxSpec),
        /// Heights over a grid in x and z, traced as they are: the top row of a picture lies at the least z. One that
        /// shines is sampled as a light up to 360 × 360 posts; a larger one is found by chance alone, which is noisy.
        "height-field" => HeightField(HeightFieldSpec),
        /// A mesh that the program makes by itself.
        "generated" => Generated(GeneratedSpec),
    }
}

/// A shape.
pub type ShapeSpec = Tagged<ShapeCommon, ShapeKind>;
