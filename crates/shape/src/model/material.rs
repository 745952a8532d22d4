//! Materials as model files describe them: glTF's metallic-roughness model, to which OBJ's are converted.

use std::path::PathBuf;

use glam::{Affine2, Vec3, Vec4};

/// A material. Textures multiply the factors beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMaterial {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Linear colour and opacity.
    pub base_color: Vec4,
    /// sRGB colour and opacity.
    pub base_color_texture: Option<ModelTexture>,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: f32,
    /// Perceptual roughness: the GGX α is its square.
    pub roughness: f32,
    /// Linear: green is roughness, blue is metallic.
    pub metallic_roughness_texture: Option<ModelTexture>,
    /// A linear tangent-space normal map: red to the right, green up in the picture.
    pub normal_texture: Option<ModelTexture>,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
    /// A linear height map (OBJ's `map_bump`); many exporters store a normal map under that name, which its
    /// colours tell.
    pub bump_texture: Option<ModelTexture>,
    /// Height of a white texel of the bump map over a black one, as OBJ's `-bm` says it; 1 if it does not.
    pub bump_scale: f32,
    /// Linear radiance, with `KHR_materials_emissive_strength` multiplied in.
    pub emissive: Vec3,
    /// sRGB colour.
    pub emissive_texture: Option<ModelTexture>,
    /// The share of light that enters a dielectric instead of being scattered at its surface.
    pub transmission: f32,
    /// Index of refraction; 1 for a surface without highlight.
    pub ior: f32,
    /// Seen from behind too.
    pub double_sided: bool,
    /// `KHR_materials_unlit`: the base colour is what the eye sees, whatever the light.
    pub unlit: bool,
    /// What the opacity means.
    pub alpha_mode: AlphaMode,
    /// A linear picture whose red is the opacity, where it is not the alpha of the base colour's (OBJ's `map_d`).
    pub opacity_texture: Option<ModelTexture>,
    /// The file says nothing of this material: these values only stand in for it.
    pub stand_in: bool,
}

impl Default for ModelMaterial {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            bump_texture: None,
            bump_scale: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            transmission: 0.0,
            ior: 1.5,
            double_sided: false,
            unlit: false,
            alpha_mode: AlphaMode::Opaque,
            opacity_texture: None,
            stand_in: false,
        }
    }
}

impl ModelMaterial {
    /// The textures that are there.
    pub fn textures(&self) -> impl Iterator<Item = &ModelTexture> {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.bump_texture,
            &self.emissive_texture,
            &self.opacity_texture,
        ]
        .into_iter()
        .flatten()
    }
}

/// What the opacity of a material means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// Below the cutoff the surface is not there.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// The share of light that the surface stops.
    Blend,
}

/// A picture laid on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelTexture {
    /// Index into [`crate::Model::images`].
    pub image: usize,
    /// What happens beyond u = 0 and 1.
    pub wrap_u: Wrap,
    /// What happens beyond v = 0 and 1.
    pub wrap_v: Wrap,
    /// Texels are squares of one colour instead of being mixed with their neighbours.
    pub nearest: bool,
    /// Applied to the mesh's texture coordinates before the look-up (`KHR_texture_transform`).
    pub uv_transform: Affine2,
}

impl ModelTexture {
    /// A repeating texture without transform.
    pub fn new(image: usize) -> Self {
        let repeat = Wrap::Repeat;
        Self { image, wrap_u: repeat, wrap_v: repeat, nearest: false, uv_transform: Affine2::IDENTITY }
    }
}

/// What happens to texture coordinates outside the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture repeats.
    #[default]
    Repeat,
    /// The picture repeats, every second time mirrored.
    MirroredRepeat,
    /// The border goes on.
    ClampToEdge,
}

/// A picture that a texture refers to, not decoded yet.
#[derive(Clone, PartialEq)]
pub enum ModelImage {
    /// In the model file itself: the bytes of a PNG or JPEG file.
    Encoded {
        /// The file.
        bytes: Vec<u8>,
        /// For messages.
        name: String,
    },
    /// In a file of its own, which existed when the model was loaded.
    File(PathBuf),
}

impl std::fmt::Debug for ModelImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Encoded { bytes, name } => write!(f, "Encoded({name}, {} bytes)", bytes.len()),
            Self::File(path) => write!(f, "File({})", path.display()),
        }
    }
}
