//! How finely surfaces shine: ν_s of a local light around one of its points, in cycles per metre on the light.
//!
//! ```text
//! ν_s = √((2/w)² + t²)
//! ```
//!
//! 2/w is the outline: 95 % of the power of a plain strip of width w lies below it. w is √(12 λ), λ the variance of the light's
//! area along its second widest axis (of a rectangle its shorter side, of any polygon or mesh the side of the rectangle that is
//! spread alike), but at most the square root of the area; all triangles of one instance are one light. t is the picture on it
//! around the point, by wavelets, [`TextureBandwidth`](halflight_frequency::mapping::TextureBandwidth), through the mapping
//! of its texture coordinates. A picture seen through an outline is their product, its spectrum the two convolved: variances add.
//!
//! Source: `[001]` §2.3, local light sources. Pictures are analysed when they change.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec3, Vec2, Vec3};
use halflight_frequency::bandwidth::{UNLIMITED, bounded};
use halflight_material::Material;
use halflight_scene::lights::{Emitter, EmitterShape};

use super::paint::Paint;

/// Pictures on lights, analysed, by the material that they belong to.
#[derive(Default)]
pub(super) struct LampPictures(Mutex<Vec<Analysed>>);

/// A material, and the picture that shines on it.
type Analysed = (Arc<Material>, Option<Arc<Paint>>);

impl LampPictures {
    /// Of these materials, new ones made where needed; those of others are dropped.
    fn of(&self, materials: Vec<&Arc<Material>>) -> Vec<Analysed> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let made: Vec<_> = materials
            .into_iter()
            .map(|material| match known.iter().find(|(other, _)| Arc::ptr_eq(other, material)) {
                Some(known) => known.clone(),
                None => {
                    let picture = material.emission.as_ref().and_then(Paint::of_light);
                    (Arc::clone(material), picture.map(Arc::new))
                }
            })
            .collect();
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&made);
        made
    }
}

/// What is known of the shining surfaces of a frame, by their numbers.
pub(super) struct Lamps {
    /// 2/w.
    outlines: Vec<f32>,
    pictures: Vec<Option<Arc<Paint>>>,
}

impl Lamps {
    pub(super) fn new(emitters: &[Emitter], cache: &LampPictures) -> Self {
        let mut materials: Vec<&Arc<Material>> = Vec::new();
        for emitter in emitters {
            // Those of a mesh stand together.
            if !materials.iter().rev().any(|known| Arc::ptr_eq(known, &emitter.material)) {
                materials.push(&emitter.material);
            }
        }
        let made = cache.of(materials);
        let picture = |emitter: &Emitter| {
            let found = made.iter().find(|(material, _)| Arc::ptr_eq(material, &emitter.material));
            found.and_then(|(_, picture)| picture.clone())
        };
        let mut spreads: HashMap<u32, Spread> = HashMap::new();
        for emitter in emitters {
            spreads.entry(emitter.instance).or_default().add(emitter);
        }
        let widths: HashMap<u32, f32> = spreads.into_iter().map(|(i, spread)| (i, spread.width())).collect();
        let outline = |emitter: &Emitter| {
            let width = widths.get(&emitter.instance).copied().unwrap_or(0.0);
            if width > 0.0 { bounded(2.0 / width) } else { UNLIMITED }
        };
        Self {
            outlines: emitters.iter().map(outline).collect(),
            pictures: emitters.iter().map(picture).collect(),
        }
    }

    /// ν_s of light `index` of `emitters`, those it was made of, around the texture coordinates `uv`.
    pub(super) fn at(&self, emitters: &[Emitter], index: u32, uv: Vec2) -> f32 {
        let index = index as usize;
        let outline = self.outlines[index];
        let picture = self.pictures[index].as_ref().zip(emitters[index].derivatives(uv));
        let picture = picture.map_or(0.0, |(picture, derivatives)| picture.per_metre(uv, derivatives));
        outline.hypot(picture).min(UNLIMITED)
    }
}

/// The area of a light, and how it lies.
#[derive(Default)]
struct Spread {
    area: f64,
    first: DVec3,
    /// Σ x x, y y, z z and y z, z x, x y.
    second: [DVec3; 2],
}

impl Spread {
    fn point(&mut self, p: Vec3, area: f64) {
        let p = p.as_dvec3();
        self.area += area;
        self.first += area * p;
        self.second[0] += area * p * p;
        self.second[1] += area * DVec3::new(p.y * p.z, p.z * p.x, p.x * p.y);
    }

    /// Adds a surface by points that have the moments of its area.
    fn add(&mut self, emitter: &Emitter) {
        let area = f64::from(emitter.area());
        let place = |p: Vec3| emitter.pose[0].transform_point3(p);
        match &emitter.shape {
            // The middles of the edges: exact to the second degree.
            EmitterShape::Triangle { corners: [[a, b, c], _], .. } => {
                for p in [a + b, b + c, c + a] {
                    self.point(place(0.5 * p), area / 3.0);
                }
            }
            EmitterShape::Rectangle | EmitterShape::Disk => {
                let variance = if matches!(emitter.shape, EmitterShape::Disk) { 0.25 } else { 1.0 / 3.0 };
                let reach = (2.0f32 * variance).sqrt();
                for axis in [Vec3::X, Vec3::Y] {
                    self.point(place(reach * axis), area / 4.0);
                    self.point(place(-reach * axis), area / 4.0);
                }
            }
            EmitterShape::Sphere { center, radius } => {
                for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                    self.point(place(*center + *radius * axis), area / 6.0);
                    self.point(place(*center - *radius * axis), area / 6.0);
                }
            }
        }
    }

    /// w in metres; 0 for what has no area.
    fn width(&self) -> f32 {
        if !(self.area > 0.0 && self.area.is_finite()) {
            return 0.0;
        }
        let mean = self.first / self.area;
        let straight = self.second[0] / self.area - mean * mean;
        let mixed = DVec3::new(mean.y * mean.z, mean.z * mean.x, mean.x * mean.y);
        let spread = (12.0 * second_largest(straight, self.second[1] / self.area - mixed).max(0.0)).sqrt();
        spread.min(self.area.sqrt()) as f32
    }
}

/// The second largest eigenvalue of the symmetric matrix with this diagonal and (y z, z x, x y) beside it, by the cubic's
/// trigonometric solution (Smith 1961).
fn second_largest(diagonal: DVec3, beside: DVec3) -> f64 {
    let mean = diagonal.element_sum() / 3.0;
    let d = diagonal - mean;
    let size = ((d.length_squared() + 2.0 * beside.length_squared()) / 6.0).sqrt();
    if size <= 1e-12 * mean.abs() || size == 0.0 {
        return mean;
    }
    let (d, b) = (d / size, beside / size);
    let determinant =
        d.x * (d.y * d.z - b.x * b.x) - b.z * (b.z * d.z - b.x * b.y) + b.y * (b.z * b.x - d.y * b.y);
    let angle = (0.5 * determinant).clamp(-1.0, 1.0).acos() / 3.0;
    let largest = mean + 2.0 * size * angle.cos();
    let least = mean + 2.0 * size * (angle + std::f64::consts::TAU / 3.0).cos();
    3.0 * mean - largest - least
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use halflight_frequency::measured;
    use halflight_image::{Plane, RgbImage};
    use halflight_scene::lights::luminance;
    use halflight_scene::{LoadOptions, Scene};

    use super::super::*;
    use super::*;
    use crate::technique::Quiet;

    /// A floor that mirrors a wide panel behind it.
    const HALL: &str = r#"
[image]
size = [96, 96]
[camera]
origin = [0, 1.2, 3]
target = [0, 0, 0.1]
vertical_fov_degrees = 50
[[shape]]
type = "plane"
half_extent = 8
material = { type = "phong", diffuse = 0, specular = 0.9, exponent = 400 }
[[light]]
type = "rectangle"
position = [0, 1.6, -1.5]
target = [0, 1.6, 0]
size = [5, 3]
"#;

    /// Waves over five metres.
    const WAVES: f32 = 12.0;

    fn hall(radiance: &str) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let wave = |x: usize| 1.0 + 0.9 * (std::f32::consts::TAU * WAVES * (x as f32 + 0.5) / 512.0).cos();
        let stripes = RgbImage::from_fn(512, 64, |x, _| [wave(x); 3]);
        halflight_image::save_hdr(&folder.path().join("stripes.hdr"), &stripes).unwrap();
        let even = RgbImage::from_fn(64, 64, |_, _| [1.0; 3]);
        halflight_image::save_hdr(&folder.path().join("even.hdr"), &even).unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, format!("{HALL}radiance = {radiance}\n")).unwrap();
        Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn film(scene: &Scene, settings: BandwidthSettings) -> Film {
        let technique = BandwidthTechnique::new(settings);
        let mut film = Film::new(96, 96);
        let budget = Budget { samples: Some(1), ..Budget::default() };
        technique.render(&scene.at(0.0).unwrap(), &mut film, &budget, &Quiet).unwrap();
        film
    }

    #[test]
    fn a_picture_of_one_colour_on_a_light_is_as_none_and_stripes_are_as_fine_as_they_are() {
        let at = |radiance: &str| {
            let frame = hall(radiance).at(0.0).unwrap();
            let lamps = Lamps::new(frame.lights.emitters(), &LampPictures::default());
            [0.2, 0.5, 0.71].map(|u| lamps.at(frame.lights.emitters(), 0, Vec2::new(u, 0.4)))
        };
        let (plain, even, striped) = (at("1"), at("\"even.hdr\""), at("\"stripes.hdr\""));
        assert!(plain.iter().all(|b| (b - 2.0 / 3.0).abs() < 1e-4), "{plain:?}");
        assert_eq!(plain, even);
        for found in striped {
            // Wavelets tell octaves: one wave alone is told as up to an octave and the slope of the filter finer.
            let ratio = found / (WAVES / 5.0);
            assert!(ratio > 1.0 && ratio < 2.7, "{found}: {ratio} times");
        }
        // As often again through a transform of the picture.
        let twice = at("{ file = \"stripes.hdr\", repeat = [2, 1] }");
        let ratio = twice[1] / striped[1];
        assert!((1.8..2.1).contains(&ratio), "{ratio}");
    }

    /// What a point sends to the eye of the panel, summed over points of it.
    fn exact(frame: &Frame, point: &SurfacePoint) -> f32 {
        const POINTS: [usize; 2] = [160, 64];
        let emitter = &frame.lights.emitters()[0];
        let (bsdf, axes) = (point.bsdf(frame), point.axes());
        let normal = emitter.pose[0].transform_vector3(Vec3::Z).normalize();
        let mut sum = 0.0;
        for i in 0..POINTS[0] * POINTS[1] {
            let uv = Vec2::new(
                ((i % POINTS[0]) as f32 + 0.5) / POINTS[0] as f32,
                ((i / POINTS[0]) as f32 + 0.5) / POINTS[1] as f32,
            );
            let local = Vec3::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0);
            let to = emitter.pose[0].transform_point3(local) - point.position;
            let direction = to.normalize();
            let radiance = luminance(emitter.radiance(uv, normal, -direction));
            let share = normal.dot(direction).abs() / to.length_squared();
            sum += bsdf.eval(point.view(), axes.map(|axis| axis.dot(direction)).into()).x * radiance * share;
        }
        sum * emitter.area() / (POINTS[0] * POINTS[1]) as f32
    }

    #[test]
    fn stripes_on_a_light_are_predicted_as_finely_as_they_are_seen() {
        let median = |mut values: Vec<f32>| {
            values.sort_by(f32::total_cmp);
            values[values.len() / 2]
        };
        // Windows that show nothing but the panel's mirror image.
        let middle: Vec<[usize; 2]> =
            (0..5).flat_map(|y| (0..9).map(move |x| [32 + 4 * x, 48 + 4 * y])).collect();
        let mut told = Vec::new();
        for radiance in ["1", "\"stripes.hdr\""] {
            let scene = hall(radiance);
            let frame = scene.at(0.0).unwrap();
            let surfaces = Surfaces::look(&frame, [96, 96], Vec2::splat(0.5), Vec::new());
            let is_looked_at = |i: usize| (16..81).contains(&(i % 96)) && (32..81).contains(&(i / 96));
            let value = |i: usize| if is_looked_at(i) { exact(&frame, &surfaces.points[i]) } else { 0.0 };
            let values = (0..96 * 96).into_par_iter().map(value).collect();
            let plane = Plane { width: 96, height: 96, values };
            let found = film(&scene, BandwidthSettings { mode: Mode::Plain, ..BandwidthSettings::default() });
            let predicted = |[x, y]: [usize; 2]| found.layers["bandwidth"][y * 96 + x];
            let measured = |[x, y]: [usize; 2]| measured::windowed_bandwidth(&plane, x, y);
            let ratio = median(middle.iter().map(|&p| predicted(p) / measured(p).max(1e-3)).collect());
            let (bandwidth, seen) = (
                median(middle.iter().map(|&p| predicted(p)).collect()),
                median(middle.iter().map(|&p| measured(p)).collect()),
            );
            eprintln!("{radiance}: predicted {bandwidth:.3}, measured {seen:.3}, ratio {ratio:.2}");
            told.push((bandwidth, ratio));
        }
        assert!(told[1].0 > 1.5 * told[0].0 && told[1].1 > 0.8 && told[1].1 < 3.0, "{told:?}");
    }

    #[test]
    fn a_light_of_any_form_is_as_wide_as_its_narrower_side() {
        let light = |shape: &str| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("scene.toml");
            let text = format!(
                "[material.lamp]\ntype = \"emissive\"\n[[shape]]\nmaterial = \"lamp\"\n\
                 transform = {{ rotate_degrees = [20, 50, 70], translate = [3, 2, 1] }}\n{shape}\n"
            );
            std::fs::write(&path, text).unwrap();
            let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
            let frame = scene.at(0.0).unwrap();
            let lamps = Lamps::new(frame.lights.emitters(), &LampPictures::default());
            2.0 / lamps.at(frame.lights.emitters(), 0, Vec2::ZERO)
        };
        for (shape, width) in [
            // A strip of two triangles, and the same cut otherwise.
            (
                "type = \"triangles\"\npositions = [[0,0,0],[4,0,0],[4,0.5,0],[0,0.5,0]]\ntriangles = [[0,1,2],[0,2,3]]",
                0.5,
            ),
            (
                "type = \"triangles\"\npositions = [[0,0,0],[1,0,0],[4,0,0],[4,0.5,0],[0,0.5,0]]\ntriangles = [[0,1,4],[1,2,3],[1,3,4]]",
                0.5,
            ),
            ("type = \"disk\"\nradius = 0.5", 0.75f32.sqrt()),
            // Of a sphere 2 r.
            ("type = \"sphere\"\nradius = 0.3", 0.6),
            // Panels far from each other are no wider than together.
            (
                "type = \"triangles\"\npositions = [[0,0,0],[1,0,0],[0,1,0],[9,9,0],[10,9,0],[9,10,0],[-9,9,0],[-8,9,0],[-9,10,0]]\ntriangles = [[0,1,2],[3,4,5],[6,7,8]]",
                1.5f32.sqrt(),
            ),
        ] {
            let found = light(shape);
            assert!((found - width).abs() < 2e-3 * width, "{shape}: {found}, not {width}");
        }
    }
}
