//! The first set of random numbers of a sample: where on the pixel, where on the lens, and when.

use glam::Vec2;
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::Ray;

use crate::sampler::Sampler;

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
        let mut sampler = Sampler::new(self.seed, x as u32, y as u32, sample);
        let u = sampler.next_four();
        // A frame without duration spends no numbers on time.
        let time = if self.shutter_is_open { sampler.next_four()[0] } else { 0.0 };
        let pixel = Vec2::new(x as f32 + u[0], y as f32 + u[1]);
        (self.view.ray(pixel, Vec2::new(u[2], u[3]), time), sampler)
    }

    /// The camera in front of this film.
    pub fn view(&self) -> &View {
        &self.view
    }
}
