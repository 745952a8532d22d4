//! The light of a shining height field: sampled as a light, found by chance, and by both, it is the same.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use halflight_scene::lights::Arrival;
use halflight_scene::{Frame, LoadOptions, Scene};
use halflight_trace::Ray;

/// Glowing waves, tilted and mirrored; still, or flowing while the shutter is open.
fn frame(speed: f32) -> Frame {
    let text = format!(
        r#"
[camera]
shutter = [0, 0.5]
[[shape]]
type = "height-field"
extent = [4, 3]
posts = [14, 11]
heights = {{ type = "sum-of-sines", waves = [
    {{ amplitude = 0.3, kx = 3, kz = 1, angular_speed = {speed} }},
    {{ amplitude = 0.2, kx = -1, kz = 4, angular_speed = {speed} }},
] }}
transform = {{ scale = [1, 1.4, -0.8], rotate_degrees = [25, 0, 0] }}
material = {{ type = "emissive", radiance = [3, 2, 1], two_sided = false }}
"#
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("the scene is written");
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    scene.at(0.0).expect("a frame")
}

/// The irradiance at a place by sampling the light, by sampling directions, and by both with the balance heuristic.
fn irradiance(frame: &Frame, at: Vec3, normal: Vec3, count: u32) -> [f64; 3] {
    let lights = &frame.lights;
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let mut sums = [0.0f64; 3];
    for i in 0..count {
        let number = |step: f64, shift: f64| (f64::from(i) * step + shift).fract() as f32;
        let (time, choice) = (number(0.554_958_13, 0.1), number(0.307_978_53, 0.4));
        let u = Vec2::new(number(0.856_674_9, 0.0), number(0.733_891_85, 0.5));
        if let Some(sample) = lights.sample(at, choice, u, time) {
            let Arrival::From { radiance, point: Some(point) } = sample.arrival else {
                panic!("no environment")
            };
            let cosine = normal.dot(sample.direction).max(0.0);
            let ray =
                Ray { origin: at, direction: sample.direction, t_max: 0.999 * at.distance(point), time };
            if cosine > 0.0 && !frame.world.occluded(&ray) {
                let value = f64::from(radiance.x * cosine / sample.pdf);
                sums[0] += value;
                sums[2] += value * f64::from(sample.pdf / (sample.pdf + cosine / PI));
            }
        }
        let v = Vec2::new(number(0.569_840_3, 0.3), number(0.324_717_96, 0.6));
        let (radius, (sin, cos)) = (v.x.sqrt(), (2.0 * PI * v.y).sin_cos());
        let cosine = (1.0 - v.x).sqrt();
        let direction = radius * (cos * tangent + sin * bitangent) + cosine * normal;
        let ray = Ray { origin: at, direction, t_max: f32::INFINITY, time };
        let Some(hit) = frame.world.closest(&ray) else { continue };
        let surface = frame.world.surface(&ray, &hit);
        let emitter = lights.emitter_of(hit.instance, hit.primitive).expect("every facet is a light");
        let radiance =
            lights.emitters()[emitter as usize].radiance(surface.uv, surface.geometric_normal, -direction);
        let value = f64::from(radiance.x * PI);
        let pdf = lights.emitter_pdf(emitter, at, surface.position, surface.geometric_normal, time);
        sums[1] += value;
        sums[2] += value * f64::from((cosine / PI) / (cosine / PI + pdf));
    }
    sums.map(|sum| sum / f64::from(count))
}

#[test]
fn light_sampling_direction_sampling_and_both_agree() {
    for speed in [0.0, 4.0] {
        let frame = frame(speed);
        assert_eq!(frame.lights.emitters().len(), 2 * 13 * 10);
        for (at, normal) in [
            (Vec3::new(0.3, 2.5, -0.2), Vec3::NEG_Y),
            (Vec3::new(-1.5, 1.0, 2.5), Vec3::new(0.3, -0.4, -0.8).normalize()),
        ] {
            let [light, chance, both] = irradiance(&frame, at, normal, 120_000);
            assert!(light > 0.3, "{light}");
            assert!(
                (light - chance).abs() < 0.02 * light,
                "speed {speed}: {light} sampled, {chance} by chance"
            );
            assert!((light - both).abs() < 0.01 * light, "speed {speed}: {light} sampled, {both} by both");
        }
    }
}
