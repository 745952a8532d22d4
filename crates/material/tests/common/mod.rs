//! The materials that every test goes through.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use glam::Vec3;
use halflight_image::{Texels, TextureImage};
use halflight_material::{
    ColorInput, Lookup, Material, MaterialKind, MeasuredBrdf, Opacity, ScalarInput, SurfaceInput, Texture,
    merl_bytes,
};

/// Analytic materials, by the lines that describe them.
pub(crate) const SPECS: [&str; 24] = [
    "diffuse:0.8,0.4,0.2",
    "phong:0.3,0.2,0.1,specular=0.5,exponent=30",
    "phong:0,specular=0.9,exponent=2000",
    "conductor:gold,roughness=0.05",
    "conductor:silver,roughness=0.3",
    "conductor:0.9,0.5,0.3,roughness=0.7",
    "conductor:1,roughness=1",
    "conductor:copper,roughness=0.4,anisotropy=0.9",
    "conductor:chromium,roughness=0.3,anisotropy=-0.7",
    "mirror",
    "mirror:0.9,0.8,0.7",
    "glass",
    "glass:1.33,tint=0.9,1,0.8",
    "glass:1.5,roughness=0.1",
    "glass:1.5,roughness=0.5",
    "glass:1.05,roughness=0.8",
    "glass:2.4,roughness=0.9,tint=1,0.5,0.2",
    "glass:0.7,roughness=0.4",
    "metallic-roughness:0.8,0.2,0.1,roughness=0.5",
    "metallic-roughness:1,metallic=1,roughness=0.2",
    "metallic-roughness:1,metallic=0.5,roughness=0",
    "metallic-roughness:0.9,0.9,0.5,roughness=0.3,transmission=0.6",
    "metallic-roughness:0,metallic=0,roughness=1",
    "black",
];

/// Index of refraction of the inside, for what is a border.
pub(crate) fn ior(spec: &str) -> f32 {
    match spec.strip_prefix("glass") {
        Some(rest) => {
            rest.trim_start_matches(':').split(',').next().and_then(|n| n.parse().ok()).unwrap_or(1.5)
        }
        None => 1.0,
    }
}

/// A table made from an analytic material, both ways to read it.
pub(crate) fn synthetic(spec: &str, lookup: Lookup) -> Arc<MeasuredBrdf> {
    let source = Material::from_spec(spec).expect("a known material");
    let bsdf = source.bsdf(&SurfaceInput::default());
    let bytes = merl_bytes(|wo, wi| bsdf.eval(wo, wi) / wi.z);
    Arc::new(MeasuredBrdf::decode(&bytes, Path::new(spec), lookup).expect("what was written is read"))
}

pub(crate) fn measured_materials() -> &'static [(String, Material)] {
    static MATERIALS: LazyLock<Vec<(String, Material)>> = LazyLock::new(|| {
        [
            ("conductor:gold,roughness=0.25", Lookup::Nearest),
            ("conductor:gold,roughness=0.25", Lookup::Interpolated),
            ("phong:0.3,0.2,0.1,specular=0.3,exponent=300", Lookup::Interpolated),
            ("diffuse:0.7", Lookup::Nearest),
        ]
        .into_iter()
        .map(|(spec, lookup)| {
            let brdf = synthetic(spec, lookup);
            (format!("measured {spec} {lookup:?}"), Material::new(spec, MaterialKind::Measured(brdf)))
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

/// A file of the shared data, or `None` with a note.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: there is no {}", path.display());
    None
}
