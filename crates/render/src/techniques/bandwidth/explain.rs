//! Why a pixel is shaded as it is: the chain of its bandwidth step by step, in words.

use std::fmt::Write;

use glam::Vec2;
use halflight_frequency::bandwidth::{Bandwidth, Chain, UNLIMITED, pixel};
use halflight_scene::Frame;
use halflight_scene::lights::{Emitter, EmitterShape};

use super::BandwidthTechnique;
use super::curvature::{self, Bend};
use super::light::FrameLight;
use super::predict::{Buffer, Judge, turned};
use super::surface::{SurfacePoint, Surfaces};

impl BandwidthTechnique {
    /// What is predicted of the pixel in column `x` and row `y` of a picture of `width` × `height`, and from what; `None` if
    /// there is no such pixel.
    pub fn explain(&self, frame: &Frame, [width, height]: [usize; 2], [x, y]: [usize; 2]) -> Option<String> {
        if x >= width || y >= height {
            return None;
        }
        let lobes = self.lobes_of(frame);
        let light = FrameLight::new(frame, &self.light, self.settings.mode);
        let surfaces = Surfaces::look(frame, [width, height], Vec2::splat(0.5), Vec::new());
        let judge = Judge::new(frame, &light, &lobes, &self.settings, [width, height]);
        let buffer = Buffer::new(&judge, &surfaces);
        let point = surfaces.at(x, y);
        let mut text = format!("pixel {x}, {y} of {width} x {height}\n");
        if !point.is_there() {
            text += "shows nothing but the environment: it is looked up, not shaded\n";
            return Some(text);
        }
        let judged = judge.judge(&surfaces, [x, y]);
        let bend = curvature::measure(&surfaces, &lobes[point.material as usize], [x, y]);
        let predicted = &buffer.pixels[y * width + x];
        describe(&mut text, frame, point, &bend);
        chain(&mut text, &judge, point, &bend);
        let exit = Judge::exit(point, &bend);
        let _ = writeln!(
            text,
            "\naverage over {} directions, weighted by what they bring",
            self.settings.directions
        );
        let _ = writeln!(text, "  light that the lobe passes{:>10.3} cycles/rad", judged.limited);
        let _ = writeln!(text, "  x |2 c d'/cos + 1|        {:>10.3}", exit.magnification().abs());
        let _ = writeln!(text, "  x roundness               {:>10.3}", exit.roundness(bend.curvature[1]));
        if judged.mean[1] > 0.0 {
            let _ = writeln!(text, "  local lights, at the eye  {:>10.3} cycles/rad", judged.local);
        }
        let _ = writeln!(text, "  x pixel angle             {:>10.6} rad", judge.pixel_angle);
        let [shaded, painted] = bend.pictures;
        let _ = writeln!(text, "  + pictures, shaded        {:>10.3} cycles/pixel", shaded);
        let _ = writeln!(text, "  + pictures, multiplied in {:>10.3} cycles/pixel", painted);
        let _ = writeln!(text, "predicted bandwidth         {:>10.4} cycles/pixel", predicted.bandwidth);
        let _ = writeln!(
            text,
            "level                       {:>10} (one point in {} x {} pixels; Nyquist alone {})",
            predicted.level,
            1 << predicted.level.max(0),
            1 << predicted.level.max(0),
            pixel::level(predicted.bandwidth, -2, 9)
        );
        if predicted.detail < predicted.level {
            let _ = writeln!(text, "level of its pictures       {:>10}", predicted.detail);
        }
        let _ = writeln!(
            text,
            "luminance of environment and local lights {:.4} + {:.4}",
            judged.mean[0], judged.mean[1]
        );
        let _ =
            writeln!(text, "variance of one sample, at most {:>6.3} of the squared mean", predicted.variance);
        let _ = writeln!(
            text,
            "samples for an error of {:.1} %: {} of the environment, {} of local lights",
            100.0 * self.settings.target_error(),
            predicted.samples[0],
            predicted.samples[1]
        );
        Some(text)
    }
}

fn describe(text: &mut String, frame: &Frame, point: &SurfacePoint, bend: &Bend) {
    let p = point.position;
    let _ = writeln!(
        text,
        "shows {}, material {}, at ({:.3}, {:.3}, {:.3})",
        frame.shape_name(point.instance),
        frame.materials[point.material as usize].name,
        p.x,
        p.y,
        p.z
    );
    let _ = writeln!(
        text,
        "distance {:.3} m, cosine to the eye {:.3}, principal curvatures {:.3} and {:.3} 1/m",
        point.distance,
        point.cos_exit(),
        bend.curvature[0],
        bend.curvature[1]
    );
}

/// The chain of the direction that brings most.
fn chain(text: &mut String, judge: &Judge, point: &SurfacePoint, bend: &Bend) {
    let lobe = &judge.lobes[point.material as usize];
    let [x, y, z] = turned(point.axes(), point.view()).map(|axis| judge.light.to_map * axis);
    let brings = |probe: &super::lobes::Probe| {
        let direction = probe.direction.x * x + probe.direction.y * y + probe.direction.z * z;
        let brought = judge.light.brought(direction, probe.solid_angle);
        (probe.gain * brought.mean, brought.bandwidth)
    };
    let probes = lobe.probes(point.view().z).flatten();
    let strongest = probes.map(|probe| (brings(probe), probe)).max_by(|a, b| a.0.0.total_cmp(&b.0.0));
    if let Some(((weight, bandwidth), probe)) = strongest.filter(|s| s.0.0 > 0.0) {
        let _ = writeln!(text, "\nthe direction of the environment that brings most ({weight:.4}):");
        let chain = Chain::new(Bandwidth::distant(bandwidth))
            .reflect(
                probe.direction.z.abs(),
                bend.curvature[0],
                0.0,
                probe.lobe.min(UNLIMITED),
                point.cos_exit(),
            )
            .travel(point.distance);
        let _ = write!(text, "{chain}");
    }
    if judge.light.has_local() {
        let emitters = judge.light.local.emitters();
        if let Some(to) = emitters.first().map(|e| e.center() - point.position) {
            let direction = to.normalize_or(point.normal);
            let rho = lobe.bandwidth.at(glam::Vec3::new(0.0, 0.0, point.normal.dot(direction)), point.view());
            let _ = writeln!(text, "\nthe middle of the first local light:");
            let chain = Chain::new(Bandwidth::local(judge.light.lamps.at(emitters, 0, middle(&emitters[0]))))
                .travel(to.length())
                .reflect(point.normal.dot(direction).abs(), bend.curvature[0], 0.0, rho, point.cos_exit())
                .travel(point.distance);
            let _ = write!(text, "{chain}");
        }
    }
}

/// The texture coordinates in the middle of a shining surface.
fn middle(emitter: &Emitter) -> Vec2 {
    match &emitter.shape {
        EmitterShape::Triangle { uvs: [a, b, c], .. } => (a + b + c) / 3.0,
        _ => Vec2::splat(0.5),
    }
}
