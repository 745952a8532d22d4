//! The materials that every test goes through.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use glam::Vec3;
use halflight_image::{Texels, TextureImage};
use halflight_material::{
    ColorInput, ConductorColor, Lookup, Material, MaterialKind, MeasuredBrdf, Opacity, ScalarInput,
    SurfaceInput, Texture, merl_bytes,
};

/// A material of the tests: what it is called, and the index of refraction of its inside (1 for what is no border).
pub(crate) struct Known {
    pub(crate) name: &'static str,
    pub(crate) ior: f32,
    pub(crate) material: Material,
}

/// Analytic materials of every kind.
pub(crate) fn analytic() -> Vec<Known> {
    let entry = |name, material| Known { name, ior: 1.0, material };
    let border = |name, ior, material| Known { name, ior, material };
    vec![
        entry("diffuse", Material::diffuse(Vec3::new(0.8, 0.4, 0.2))),
        entry("phong", Material::phong(Vec3::new(0.3, 0.2, 0.1), Vec3::splat(0.5), 30.0)),
        entry("sharp phong", Material::phong(Vec3::ZERO, Vec3::splat(0.9), 2000.0)),
        entry("nearly smooth gold", metal("gold", 0.05, 0.0)),
        entry("silver", metal("silver", 0.3, 0.0)),
        entry("coloured metal", colored_metal(Vec3::new(0.9, 0.5, 0.3), 0.7)),
        entry("rough white metal", colored_metal(Vec3::ONE, 1.0)),
        entry("brushed copper", metal("copper", 0.4, 0.9)),
        entry("chromium brushed across", metal("chromium", 0.3, -0.7)),
        entry("mirror", Material::mirror()),
        entry("coloured mirror", colored_mirror(Vec3::new(0.9, 0.8, 0.7))),
        border("glass", 1.5, Material::glass(1.5)),
        border("tinted glass like water", 1.33, glass(1.33, 0.0, Vec3::new(0.9, 1.0, 0.8))),
        border("slightly rough glass", 1.5, glass(1.5, 0.1, Vec3::ONE)),
        border("rough glass", 1.5, glass(1.5, 0.5, Vec3::ONE)),
        border("glass that hardly bends", 1.05, glass(1.05, 0.8, Vec3::ONE)),
        border("tinted glass like diamond", 2.4, glass(2.4, 0.9, Vec3::new(1.0, 0.5, 0.2))),
        border("glass turned inside out", 0.7, glass(0.7, 0.4, Vec3::ONE)),
        entry("plastic", metallic_roughness(Vec3::new(0.8, 0.2, 0.1), 0.0, 0.5, 0.0)),
        entry("glTF metal", metallic_roughness(Vec3::ONE, 1.0, 0.2, 0.0)),
        entry("smooth half metal", metallic_roughness(Vec3::ONE, 0.5, 0.0, 0.0)),
        entry("thin wall", metallic_roughness(Vec3::new(0.9, 0.9, 0.5), 0.0, 0.3, 0.6)),
        entry("black plastic", metallic_roughness(Vec3::ZERO, 0.0, 1.0, 0.0)),
        entry("black", Material::new("black", MaterialKind::Black)),
    ]
}

pub(crate) fn metal(name: &str, roughness: f32, anisotropy: f32) -> Material {
    let (eta, k) = halflight_material::metal(name).expect("a known metal");
    let color = ConductorColor::Complex { eta, k };
    Material::new(name, MaterialKind::Conductor { color, roughness: roughness.into(), anisotropy })
}

pub(crate) fn colored_metal(color: Vec3, roughness: f32) -> Material {
    let color = ConductorColor::Normal(color.into());
    Material::new("metal", MaterialKind::Conductor { color, roughness: roughness.into(), anisotropy: 0.0 })
}

fn colored_mirror(color: Vec3) -> Material {
    let color = ConductorColor::Constant(color.into());
    Material::new("mirror", MaterialKind::Conductor { color, roughness: 0.0.into(), anisotropy: 0.0 })
}

pub(crate) fn glass(ior: f32, roughness: f32, tint: Vec3) -> Material {
    Material::new("glass", MaterialKind::Dielectric { ior, roughness: roughness.into(), tint: tint.into() })
}

fn metallic_roughness(base_color: Vec3, metallic: f32, roughness: f32, transmission: f32) -> Material {
    let (base_color, metallic, roughness) = (base_color.into(), metallic.into(), roughness.into());
    let transmission = transmission.into();
    let kind = MaterialKind::MetallicRoughness { base_color, metallic, roughness, transmission, ior: 1.5 };
    Material::new("metallic-roughness", kind)
}

/// A table made from an analytic material.
pub(crate) fn synthetic(source: &Material, lookup: Lookup) -> Arc<MeasuredBrdf> {
    let bsdf = source.bsdf(&SurfaceInput::default());
    let bytes = merl_bytes(|wo, wi| bsdf.eval(wo, wi) / wi.z);
    Arc::new(MeasuredBrdf::decode(&bytes, Path::new(&source.name), lookup).expect("what was written is read"))
}

pub(crate) fn measured_materials() -> &'static [(String, Material)] {
    static MATERIALS: LazyLock<Vec<(String, Material)>> = LazyLock::new(|| {
        [
            (metal("gold", 0.25, 0.0), Lookup::Nearest),
            (metal("gold", 0.25, 0.0), Lookup::Interpolated),
            (Material::phong(Vec3::new(0.3, 0.2, 0.1), Vec3::splat(0.3), 300.0), Lookup::Interpolated),
            (Material::diffuse(Vec3::splat(0.7)), Lookup::Nearest),
        ]
        .into_iter()
        .map(|(source, lookup)| {
            let brdf = synthetic(&source, lookup);
            let name = format!("measured {} {lookup:?}", source.name);
            (name, Material::new(source.name, MaterialKind::Measured(brdf)))
        })
        .collect()
    });
    &MATERIALS
}

/// Materials whose every parameter comes from a picture.
pub(crate) fn textured() -> Vec<(String, Material)> {
    let image = TextureImage {
        width: 2,
        height: 2,
        texels: Texels::Floats(vec![
            [0.9, 0.1, 0.3, 1.0],
            [0.2, 0.8, 0.5, 1.0],
            [0.4, 0.4, 0.9, 1.0],
            [0.0, 1.0, 0.0, 1.0],
        ]),
    };
    let texture = Arc::new(Texture::new(Arc::new(image)));
    let color = || ColorInput::Textured { texture: texture.clone(), factor: Vec3::splat(0.9) };
    let scalar = |channel| ScalarInput::Textured { texture: texture.clone(), channel, factor: 0.7 };
    vec![
        ("textured diffuse".into(), Material::new("a", MaterialKind::Diffuse { albedo: color() })),
        (
            "textured phong".into(),
            Material::new(
                "b",
                MaterialKind::Phong {
                    diffuse: color(),
                    specular: color(),
                    exponent: ScalarInput::Constant(20.0),
                },
            ),
        ),
        (
            "textured metallic-roughness".into(),
            Material::new(
                "c",
                MaterialKind::MetallicRoughness {
                    base_color: color(),
                    metallic: scalar(2),
                    roughness: scalar(1),
                    transmission: 0.0.into(),
                    ior: 1.5,
                },
            ),
        ),
        (
            "textured glass".into(),
            Material::new("d", MaterialKind::Dielectric { ior: 1.5, roughness: scalar(0), tint: color() }),
        ),
        ("gauze".into(), {
            let gauze = Opacity { amount: 0.3.into(), cutoff: None };
            Material { opacity: Some(gauze), ..Material::diffuse(Vec3::splat(0.8)) }
        }),
        ("leaf".into(), {
            let leaf = Opacity { amount: scalar(1), cutoff: Some(0.4) };
            let kind = MaterialKind::Phong { diffuse: color(), specular: color(), exponent: 9.0.into() };
            Material { opacity: Some(leaf), ..Material::new("leaf", kind) }
        }),
    ]
}

/// Mixes of pairs of every kind, by numbers and by a picture.
pub(crate) fn mixed() -> Vec<(String, Material)> {
    let image = TextureImage {
        width: 2,
        height: 1,
        texels: Texels::Floats(vec![[0.0, 0.0, 0.0, 1.0], [1.0, 1.0, 1.0, 1.0]]),
    };
    let texture = Arc::new(Texture::new(Arc::new(image)));
    let picture = || ScalarInput::Textured { texture: texture.clone(), channel: 0, factor: 1.0 };
    let mix = |first: &Material, second: &Material, mask: ScalarInput| {
        let parts = Arc::new([first.clone(), second.clone()]);
        Material::new("mix", MaterialKind::Mix { parts, mask })
    };
    let (clay, gold) = (Material::diffuse(Vec3::new(0.8, 0.4, 0.2)), metal("gold", 0.3, 0.0));
    let plastic = Material::phong(Vec3::new(0.3, 0.2, 0.1), Vec3::splat(0.5), 30.0);
    let measured = measured_materials();
    let half = mix(&clay, &gold, 0.5.into());
    let front = |material: &Material| Material { two_sided: false, ..material.clone() };
    vec![
        ("clay and gold".into(), half.clone()),
        ("clay and a little gold".into(), mix(&clay, &gold, 0.02.into())),
        ("black and plastic".into(), mix(&Material::diffuse(Vec3::ZERO), &plastic, 0.4.into())),
        ("clay and a mirror".into(), mix(&clay, &Material::mirror(), 0.6.into())),
        ("measured: two tables".into(), mix(&measured[1].1, &measured[2].1, picture())),
        ("measured: a table and clay".into(), mix(&measured[1].1, &clay, 0.7.into())),
        ("three".into(), mix(&half, &plastic, picture())),
        ("thin wall and clay".into(), {
            let wall = metallic_roughness(Vec3::new(0.9, 0.9, 0.5), 0.0, 0.3, 0.6);
            mix(&wall, &clay, 0.5.into())
        }),
        ("clay from the front, gold from both sides".into(), mix(&front(&clay), &gold, 0.5.into())),
        ("one side only".into(), front(&half)),
    ]
}

/// A file of the shared data, or `None` with a note.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: there is no {}", path.display());
    None
}
