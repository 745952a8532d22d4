//! What multiplies light on its way beside windows: pictures on surfaces, and media that absorb unevenly.
//!
//! A picture's spectrum at a place is that of its relative slopes there: light times ρ(x) has Σ = Σ₀ + 2⟨∇ρ ∇ρᵀ⟩/(4π² ⟨ρ⟩²), twice the
//! second moment of |ρ̂|² as for all fields that are not Gaussian. ρ is what the material scatters from the light's direction
//! to the eye's, differences are taken over the width of a pixel there, and the mean is that over pilots.
//!
//! A medium whose optical depth τ bends by H across a ray is a window exp(−½ xᵀ H x), in the middle of the way.

use std::f32::consts::PI;

use glam::Vec3;
use halflight_material::{Material, MaterialKind, ScalarInput, SurfaceInput};
use halflight_scene::Frame;
use halflight_scene::lights::luminance;
use halflight_scene::media::Media;

use super::trail::Node;

/// Points on each of a ray's neighbours at which a medium is asked for its density.
const STEPS: usize = 12;

/// The spectrum of what is painted on a surface, as the vectors whose sum of squares it is, in cycles per metre.
pub(super) fn painted(frame: &Frame, node: &Node, incoming: Vec3, pixel: f32) -> Option<[Vec3; 2]> {
    let vertex = &node.vertex;
    let material = vertex.material;
    if node.anisotropy.is_some() || node.delta || material.is_uniform() {
        return None;
    }
    let gradients = frame.world.gradients(node.hit.as_ref()?, node.time, &vertex.surface)?;
    let (wi, wo) = (vertex.to_local(incoming), vertex.wo);
    let (surface, step) = (&vertex.surface, 0.5 * pixel.max(1e-6));
    let value = |offset: Vec3| {
        let uv = surface.uv + glam::Vec2::new(gradients.u.dot(offset), gradients.v.dot(offset));
        luminance(material.bsdf(&SurfaceInput { uv, color: surface.color }).eval(wo, wi))
    };
    let middle = value(Vec3::ZERO);
    let (x, y) = surface.geometric_normal.any_orthonormal_pair();
    // Over steps in two pairs of directions: an edge may lie along one of them.
    let diagonal = [(x + y) * 0.5f32.sqrt(), (x - y) * 0.5f32.sqrt()];
    let slope = |axis: Vec3| {
        let (a, b) = (value(step * axis), value(-step * axis));
        let mean = 0.25 * (a + b + 2.0 * middle);
        if mean > 0.0 { axis * ((a - b) / (2.0 * step * mean)) } else { Vec3::ZERO }
    };
    let (straight, leaning) = (slope(x) + slope(y), slope(diagonal[0]) + slope(diagonal[1]));
    // The mean of both squares, twice that for the spectrum.
    let found = [straight / (2.0 * PI), leaning / (2.0 * PI)];
    (found.iter().all(|v| v.is_finite()) && found != [Vec3::ZERO; 2]).then_some(found)
}

/// The variance of slopes of the facets that refract at a rough interface: α²/2. `None` for what is no such interface.
pub(super) fn facet_slopes(material: &Material, uv: glam::Vec2) -> Option<f64> {
    let roughness = match &material.kind {
        MaterialKind::Dielectric { roughness, .. } | MaterialKind::MetallicRoughness { roughness, .. } => {
            roughness
        }
        _ => return None,
    };
    let roughness = match roughness {
        ScalarInput::Constant(value) => *value,
        textured @ ScalarInput::Textured { .. } => textured.at(uv),
    };
    let alpha = f64::from(roughness.clamp(0.0, 1.0)).powi(2);
    Some(0.5 * alpha * alpha)
}

/// [xx, xy, yy] of the second derivatives of optical depth across a way of `length` metres from a point, on these axes; `None`
/// where media are even.
pub(super) fn absorbed(
    media: &Media,
    from: Vec3,
    direction: Vec3,
    length: f32,
    axes: [Vec3; 2],
) -> Option<[f64; 3]> {
    let uneven = media.volumes().iter().filter(|volume| volume.density.is_some());
    let mut sum = [0.0f64; 3];
    let mut any = false;
    for volume in uneven {
        let Some([enter, leave]) = volume.region.interval(from, direction, length) else { continue };
        let (low, high) = volume.region.bounds();
        // About as far as a density is known to vary.
        let step = 0.05 * (high - low).min_element();
        if !(step > 0.0 && leave.is_finite()) {
            continue;
        }
        let extinction = luminance(volume.extinction());
        let depth = |offset: Vec3| {
            let each = (leave - enter) / STEPS as f32;
            let at = |i: usize| from + direction * (enter + (i as f32 + 0.5) * each) + offset;
            let inside = |point: Vec3| point.clamp(low, high);
            f64::from(extinction * each * (0..STEPS).map(|i| volume.density_at(inside(at(i)))).sum::<f32>())
        };
        let [x, y] = axes.map(|axis| axis * step);
        let middle = depth(Vec3::ZERO);
        let area = f64::from(step * step);
        sum[0] += (depth(x) + depth(-x) - 2.0 * middle) / area;
        sum[2] += (depth(y) + depth(-y) - 2.0 * middle) / area;
        sum[1] += 0.25 * (depth(x + y) + depth(-x - y) - depth(x - y) - depth(y - x)) / area;
        any = true;
    }
    (any && sum.iter().all(|v| v.is_finite())).then_some(sum)
}
