//! The first set of random numbers of a sample: where on the pixel, where on the lens, and when.

use glam::Vec2;
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::{Ray, Simd};

use crate::sampler::Sampler;
use crate::samplers::{LANES, Samplers};

/// Camera rays of one frame on one film. Filter: a box of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct CameraSampler {
    view: View,
    seed: u64,
    shutter_is_open: bool,
}

impl CameraSampler {
    /// For a film of `width` × `height` pixels.
    pub fn new(frame: &Frame, width: usize, height: usize, seed: u64) -> Self {
        Self { view: frame.camera.view(width, height), seed, shutter_is_open: frame.shutter_is_open() }
    }

    /// The ray of sample `sample` of pixel (x, y), and the random numbers for what comes after it.
    #[inline]
    pub fn ray(&self, x: usize, y: usize, sample: u32) -> (Ray, Sampler) {
        let ((pixel, lens, time), sampler) = self.place(x, y, sample);
        (self.view.ray(pixel, lens, time), sampler)
    }

    /// The place on the film, the place on the lens as [`View::ray`] takes it, and the time of that ray.
    #[inline]
    pub(crate) fn place(&self, x: usize, y: usize, sample: u32) -> ((Vec2, Vec2, f32), Sampler) {
        let mut sampler = Sampler::new(self.seed, x as u32, y as u32, sample);
        let u = sampler.next_four();
        // A frame without duration spends no numbers on time.
        let time = if self.shutter_is_open { sampler.next_four()[0] } else { 0.0 };
        let pixel = Vec2::new(x as f32 + u[0], y as f32 + u[1]);
        ((pixel, Vec2::new(u[2], u[3]), time), sampler)
    }

    /// The rays of sample `sample` of some pixels, at most as many as there is room for, and the random numbers for what
    /// comes after them: those of [`CameraSampler::ray`] for each. Returns how many.
    pub fn rays(
        &self,
        pixels: impl Iterator<Item = [usize; 2]> + Clone,
        sample: u32,
        simd: Simd,
        rays: &mut [Ray; LANES],
    ) -> (usize, Samplers) {
        let seeded = pixels.clone().map(|[x, y]| [x as u32, y as u32]);
        let mut samplers = Samplers::new(self.seed, seeded, sample, simd);
        let count = pixels.clone().count().min(LANES);
        let mut numbers = [[0.0; LANES]; 4];
        samplers.next_four(count, &mut numbers);
        let u = numbers;
        if self.shutter_is_open {
            samplers.next_four(count, &mut numbers);
        }
        for (i, ([x, y], ray)) in pixels.zip(rays).enumerate() {
            let time = if self.shutter_is_open { numbers[0][i] } else { 0.0 };
            let pixel = Vec2::new(x as f32 + u[0][i], y as f32 + u[1][i]);
            *ray = self.view.ray(pixel, Vec2::new(u[2][i], u[3][i]), time);
        }
        (count, samplers)
    }

    /// The camera in front of this film.
    pub fn view(&self) -> &View {
        &self.view
    }
}
