//! The loop of the seed at every visible point: U ← O_self; in order of distance U ← U ⊗ O_J; B ← ⟨S, U⟩.
//!
//! U starts as what the material makes of light (cosine, or cosine ⊗ lobe) times what the object leaves of it. When a
//! lamp's turn comes, B ← B + ⟨S_J, U⟩ with its own radiance S_J: what is farther does not shadow it. The environment comes
//! last. Products are truncated and so not associative: the order is part of the definition. Sixteen points go
//! side by side, each with its own order.
//!
//! Left out are entities wholly below the tangent plane. Distances are those of centres; a plane
//! counts as just beyond the farthest lamp on the same side of it, or as nearest of all where there is none; a height field
//! always as nearest.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_sh::batch::{self, Lanes, WIDTH};
use halflight_sh::{Sh, Simd, Zh};
use rayon::prelude::*;

use super::flat::FlatTable;
use super::pose::{Owner, Stage};
use crate::gbuffer::{GBuffer, Visible, VisiblePoint};
use crate::sh_light::{Colors, axes};

/// Rows of pixels that one thread takes at a time.
const ROWS: usize = 8;

/// What all points of a frame share.
pub(super) struct Shader<'a, const ORDER: usize> {
    pub(super) simd: Simd,
    pub(super) stage: &'a Stage<'a, ORDER>,
    pub(super) flats: &'a FlatTable<ORDER>,
    pub(super) environment: Option<&'a Colors<ORDER>>,
    pub(super) frame: &'a Frame,
}

/// Which part of a material a lane is for.
#[derive(Clone, Copy)]
enum Scattering {
    Diffuse,
    Lobe,
}

/// A lane: a point, the pixel it belongs to, the part of its material.
#[derive(Clone, Copy)]
struct Job {
    pixel: usize,
    point: VisiblePoint,
    scattering: Scattering,
}

/// What may come between a point and the light.
#[derive(Clone, Copy, Debug)]
enum Between {
    Entity(u32),
    Flat(u32),
    Relief(u32),
}

/// Room for sixteen lanes.
struct Room<const ORDER: usize> {
    jobs: Vec<Job>,
    lists: [Vec<(f32, Between)>; WIDTH],
    left: [Sh<ORDER, Lanes>; 1],
    factor: [Sh<ORDER, Lanes>; 1],
    product: [Sh<ORDER, Lanes>; 1],
}

/// The radiance of every pixel.
pub(super) fn shade<const ORDER: usize>(shader: &Shader<ORDER>, view: &GBuffer) -> Vec<Vec3> {
    let mut picture = vec![Vec3::ZERO; view.width * view.height];
    let band = view.width * ROWS;
    picture.par_chunks_mut(band).enumerate().for_each(|(number, picture)| {
        let mut room = Room::new();
        for pixel in 0..picture.len() {
            let point = match view.at(number * band + pixel) {
                Visible::Nothing(direction) => {
                    picture[pixel] = shader.frame.lights.escaped(direction);
                    continue;
                }
                Visible::Point(point) => point,
            };
            picture[pixel] = point.emitted;
            let material = &point.material;
            for (scattering, albedo) in
                [(Scattering::Diffuse, material.diffuse), (Scattering::Lobe, material.specular)]
            {
                if albedo != Vec3::ZERO {
                    room.jobs.push(Job { pixel, point, scattering });
                    if room.jobs.len() == WIDTH {
                        room.solve(shader, picture);
                    }
                }
            }
        }
        room.solve(shader, picture);
    });
    picture
}

impl<const ORDER: usize> Room<ORDER> {
    fn new() -> Self {
        Self {
            jobs: Vec::with_capacity(WIDTH),
            lists: std::array::from_fn(|_| Vec::new()),
            left: [Sh::zero()],
            factor: [Sh::zero()],
            product: [Sh::zero()],
        }
    }

    /// Adds what the waiting points scatter to their pixels, and lets them go.
    fn solve(&mut self, shader: &Shader<ORDER>, picture: &mut [Vec3]) {
        if self.jobs.is_empty() {
            return;
        }
        self.begin(shader);
        let mut light = [Vec3::ZERO; WIDTH];
        let longest = self.lists[..self.jobs.len()].iter().map(Vec::len).max().unwrap_or(0);
        for step in 0..longest {
            self.factor[0] = Sh::one();
            for lane in 0..self.jobs.len() {
                let Some(&(_, between)) = self.lists[lane].get(step) else { continue };
                let point = self.jobs[lane].point.position;
                let hidden = match between {
                    Between::Entity(number) => {
                        let posed = &shader.stage.entities[number as usize];
                        if let Some(colors) = posed.shining(point) {
                            let left = batch::lane(&self.left[0], lane);
                            light[lane] += Vec3::from_array(colors.map(|color| color.dot(&left)));
                        }
                        posed.hidden(point)
                    }
                    Between::Flat(number) => shader.stage.flats[number as usize].hidden(shader.flats, point),
                    Between::Relief(number) => {
                        let (relief, carried) = &shader.stage.reliefs[number as usize];
                        carried.turned(&relief.at(carried.back(point)))
                    }
                };
                batch::set_lane(&mut self.factor[0], lane, &(Sh::one() - hidden));
            }
            self.multiply(shader.simd);
        }
        if let Some(environment) = shader.environment {
            for (color, light_color) in environment.iter().enumerate() {
                self.factor[0] = light_color.map(Lanes::splat);
                let mut sums = [Lanes::default()];
                batch::dot(shader.simd, &self.left, &self.factor, &mut sums);
                for (light, sum) in light.iter_mut().zip(sums[0].0) {
                    light[color] += sum;
                }
            }
        }
        for (job, light) in self.jobs.drain(..).zip(light) {
            // Band-limited light may be a little negative: cut after the integral, never before.
            picture[job.pixel] += job.albedo() * light.max(Vec3::ZERO);
        }
    }

    /// U ← scattering ⊗ O_self, and the order of what comes between.
    fn begin(&mut self, shader: &Shader<ORDER>) {
        let cosine = Zh::<ORDER>::clamped_cosine();
        let mut lobes = false;
        self.factor[0] = Sh::one();
        for (lane, job) in self.jobs.iter().enumerate() {
            batch::set_lane(&mut self.left[0], lane, &cosine.to_direction(axes(job.point.normal)));
            if let Scattering::Lobe = job.scattering {
                lobes = true;
                batch::set_lane(&mut self.factor[0], lane, &job.lobe());
            }
        }
        if lobes {
            self.multiply(shader.simd);
            self.factor[0] = Sh::one();
        }
        let mut hides = false;
        for (lane, job) in self.jobs.iter().enumerate() {
            if let Some(hidden) = shader.stage.own(shader.frame, &job.point) {
                hides = true;
                batch::set_lane(&mut self.factor[0], lane, &(Sh::one() - hidden));
            }
        }
        if hides {
            self.multiply(shader.simd);
        }
        for (list, job) in self.lists.iter_mut().zip(&self.jobs) {
            shader.order(&job.point, list);
        }
    }

    fn multiply(&mut self, simd: Simd) {
        batch::product(simd, &self.left, &self.factor, &mut self.product);
        std::mem::swap(&mut self.left, &mut self.product);
    }
}

impl Job {
    /// The lobe about the mirror direction, of integral 1.
    fn lobe<const ORDER: usize>(&self) -> Sh<ORDER> {
        let point = &self.point;
        let mirrored = 2.0 * point.normal.dot(point.towards_eye) * point.normal - point.towards_eye;
        Zh::<ORDER>::phong(f64::from(point.material.exponent)).to_direction(axes(mirrored))
    }

    fn albedo(&self) -> Vec3 {
        let material = &self.point.material;
        match self.scattering {
            Scattering::Diffuse => material.diffuse * std::f32::consts::FRAC_1_PI,
            Scattering::Lobe => material.specular * ((material.exponent + 2.0) / (material.exponent + 1.0)),
        }
    }
}

impl<const ORDER: usize> Shader<'_, ORDER> {
    /// What comes between a point and the light, nearest first.
    fn order(&self, point: &VisiblePoint, list: &mut Vec<(f32, Between)>) {
        let owner = self.stage.owners[point.hit.instance as usize];
        let (position, normal) = (point.position, point.normal);
        list.clear();
        for (number, posed) in self.stage.entities.iter().enumerate() {
            let own = matches!(owner, Owner::Entity { number: n, .. } if n as usize == number);
            let to = posed.center - position;
            if !own && normal.dot(to) > -posed.radius {
                list.push((to.length(), Between::Entity(number as u32)));
            }
        }
        for (number, flat) in self.stage.flats.iter().enumerate() {
            if owner != Owner::Flat(number as u32) && !flat.is_behind(position, normal) {
                let side = flat.height(position);
                let lamps = self.stage.entities.iter().filter(|posed| posed.entity.radiance.is_some());
                let same_side = lamps.filter(|lamp| flat.height(lamp.center) * side > 0.0);
                let farthest = same_side.map(|lamp| lamp.center.distance(position)).fold(0.0, f32::max);
                list.push((farthest.next_up(), Between::Flat(number as u32)));
            }
        }
        for number in 0..self.stage.reliefs.len() as u32 {
            if owner != Owner::Relief(number) {
                list.push((0.0, Between::Relief(number)));
            }
        }
        // Stable, so that equal distances keep the order of the scene.
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
}
