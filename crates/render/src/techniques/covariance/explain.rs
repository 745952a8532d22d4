//! Why a pixel is sampled and filtered as it is: the chain of its strongest path, in words.

use std::fmt::Write;

use halflight_frequency::covariance::Steps;
use halflight_scene::Frame;

use super::film_axes::FilmAxes;
use super::lamps::Lamps;
use super::look::Look;
use super::pilot::{Found, Group, Pilots, forecast};
use super::reconstruct::Shape;
use super::settings::Method;
use super::trail::edge;
use super::{Covariance, photons};
use crate::camera_sample::CameraSampler;
use crate::techniques::path::integrator::Integrator;
use crate::tracking::Passage;

/// Paths that an explanation looks at.
const PATHS: u32 = 16;

/// A pixel explained.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// In words.
    pub text: String,
    /// The events of the path that brings most, with the matrix after each.
    pub steps: Steps<5>,
}

impl Covariance {
    /// The chain of the pixel in column `x` and row `y` of a picture of `width` × `height`, and what follows from all its
    /// paths; `None` if there is no such pixel.
    pub fn explain(
        &self,
        frame: &Frame,
        [width, height]: [usize; 2],
        [x, y]: [usize; 2],
    ) -> Option<Explanation> {
        if x >= width || y >= height {
            return None;
        }
        let axes = FilmAxes::new(frame, width, height);
        let look = Look::new(frame, &axes, width, height);
        let integrator = Integrator::new(frame, self.settings.of_paths());
        let lamps = Lamps::new(frame);
        let pilots = Pilots { integrator, axes: &axes, lamps: &lamps, carry: true };
        let camera = CameraSampler::new(frame, width, height, 0);
        let (mut found, mut group) = (Found::default(), Group::default());
        let mut strongest = (0.0, Steps::default());
        for sample in 0..PATHS {
            let (ray, mut sampler) = camera.ray(x, y, sample);
            pilots.trace(ray, &mut sampler, &mut group, Some(&mut strongest));
            pilots.walk(&mut group, &mut found);
        }
        let mut text = format!("pixel {x},{y} of {width} x {height}, {PATHS} paths\n");
        let seen = &look.seen[y * width + x];
        if seen.what > 0 {
            let name = frame.shape_name(seen.what - 1);
            let _ = writeln!(text, "the middle of the lens sees {name} at depth {:.3} m", seen.depth);
        }
        let steps = strongest.1;
        if steps.events.is_empty() {
            text += "no light reaches it\n";
            return Some(Explanation { text, steps });
        }
        text += "\nthe path that brings most, from light to film (cycles per metre, radian, shutter; at the film pixel, lens metre, shutter):\n";
        let _ = write!(text, "{steps}");
        let limit = &look.edges[y * width + x];
        let shading = found.covariance.covariance();
        let edge = edge(limit, axes.direction(x, y), &axes);
        let covariance = found.beside(&edge);
        let forecast = forecast(&found, &edge, &axes);
        let shape = Shape::new(forecast.precision, self.settings.widest_filter);
        let mut mean = Steps::default();
        text.push('\n');
        mean.note("all paths together, weighted by what they bring, at the film", &shading);
        mean.note(
            format!("and the edge {:.1} pixels away, at depth {:.3} m", limit.offset.length(), limit.depth),
            &covariance,
        );
        let _ = write!(text, "{mean}");
        let _ = writeln!(
            text,
            "\nspatial density                     {:>10.4} samples a pixel (√det of the spatial block)",
            forecast.density
        );
        let _ = writeln!(
            text,
            "samples over lens, over shutter     {:>10.2}, {:.2} (√det of 1 + 4π² W Σ of each)",
            forecast.lens, forecast.shutter
        );
        let _ = writeln!(
            text,
            "samples of pixel, lens, shutter vary {:>9.1} % of the light's square",
            100.0 * forecast.varies
        );
        let _ = writeln!(
            text,
            "widest filter                       {:>10.2} x {:.2} pixels standard deviation (at most {})",
            shape.deviations[0], shape.deviations[1], self.settings.widest_filter
        );
        if self.settings.method == Method::Photons {
            return Some(self.explain_photons(frame, [width, height], [x, y], text, steps));
        }
        Some(Explanation { text, steps })
    }

    /// What photons bring to a pixel: the way of the one that brings most, and how wide their kernels are.
    fn explain_photons(
        &self,
        frame: &Frame,
        [width, height]: [usize; 2],
        [x, y]: [usize; 2],
        mut text: String,
        steps: Steps<5>,
    ) -> Explanation {
        /// Passes that are looked at.
        const PASSES: u32 = 4;
        let axes = FilmAxes::new(frame, width, height);
        let method = photons::Method::new(frame, self.settings, &axes, 0);
        let view = frame.camera.view(width, height);
        let mut strongest: Option<(f32, u32, u32, f32)> = None;
        let (mut sum, mut radii, mut count) = (0.0f32, 0.0f32, 0u32);
        for pass in 0..PASSES {
            let photons = method.photons(pass);
            let mut passage = Passage::default();
            let seen = method.look(&photons, &view, [x, y], pass, &mut passage, |number, radius, brought| {
                count += 1;
                if strongest.is_none_or(|(most, ..)| brought > most) {
                    strongest = Some((brought, pass, number, radius));
                }
            });
            sum += seen.of_photons;
            radii += seen.radii;
        }
        let Some((brought, pass, number, radius)) = strongest else {
            text += "\nno photon reaches it\n";
            return Explanation { text, steps };
        };
        let steps = method.steps(pass, number);
        let _ = write!(text, "\nthe photon that brings most, from its light to its last event:\n{steps}");
        let _ = writeln!(
            text,
            "\nphotons that reach the pixel            {:>10.1} a pass, of {}",
            f64::from(count) / f64::from(PASSES),
            self.settings.photons
        );
        let _ = writeln!(
            text,
            "radius of that photon's kernel          {radius:>10.4} m in pass {}, for {brought:.4} of luminance",
            pass + 1
        );
        let _ = writeln!(text, "mean radius, by what they bring         {:>10.4} m", radii / sum.max(1e-20));
        Explanation { text, steps }
    }
}
