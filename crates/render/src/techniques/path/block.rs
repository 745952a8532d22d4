//! The paths of a block of pixels, advanced together: the estimator of [`alone`](super::alone), stage by stage.
//!
//! Each stage is one short loop over all paths that are left: what the rays found, light sought at every vertex, the
//! shadow rays, the next directions, the next rays. So random numbers and map look-ups are computed side by side in
//! vector registers, the texels that a stage will need are on their way while another works, and the processor
//! overlaps the paths of a loop where one path alone would wait. A path's random numbers and sums are the same as if it
//! were alone.

use glam::{Vec2, Vec3};
use halflight_scene::lights::LightSamples;
use halflight_scene::lights::environment::MapPoint;
use halflight_trace::{Hit, Ray};

use super::integrator::{Departure, Integrator, scattered, shadow_ray};
use super::shadows::{Shadow, Shadows};
use crate::samplers::{LANES, Numbers, Samplers};
use crate::vertex::Vertex;

/// Room for the paths of a block, kept from block to block.
pub(in crate::techniques) struct Block<'a> {
    /// The rays under way, and then what they met.
    pub(in crate::techniques) rays: [Ray; LANES],
    pub(in crate::techniques) hits: [Option<Hit>; LANES],
    /// What the paths have brought so far, by their place in the block.
    pub(in crate::techniques) radiance: [Vec3; LANES],
    paths: [Path; LANES],
    vertices: Vec<Vertex<'a>>,
    numbers: Numbers,
    /// The same for the way through media.
    passage: Numbers,
    lights: LightSamples,
    shadows: Shadows,
    blocked: [bool; LANES],
    directions: [Vec3; LANES],
    points: [MapPoint; LANES],
    /// What the environment shows there.
    found: [Vec3; LANES],
    /// Places of paths in the lists, for choosing among them.
    places: [u8; LANES],
}

/// A path that goes on: in the list of rays while one is under way, in the list of vertices when it has arrived.
#[derive(Clone, Copy)]
struct Path {
    /// Its place in the block.
    pixel: u8,
    time: f32,
    throughput: Vec3,
    /// None after the camera and after smooth surfaces: no light sampling could have found what is found then.
    departure: Option<Departure>,
}

impl Block<'_> {
    pub(in crate::techniques) fn new() -> Self {
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        let path = Path { pixel: 0, time: 0.0, throughput: Vec3::ONE, departure: None };
        Self {
            rays: [ray; LANES],
            hits: [None; LANES],
            radiance: [Vec3::ZERO; LANES],
            paths: [path; LANES],
            vertices: Vec::with_capacity(LANES),
            numbers: [[0.0; LANES]; 4],
            passage: [[0.0; LANES]; 4],
            lights: LightSamples::default(),
            shadows: Shadows::new(),
            blocked: [false; LANES],
            directions: [Vec3::Z; LANES],
            points: [MapPoint::default(); LANES],
            found: [Vec3::ZERO; LANES],
            places: [0; LANES],
        }
    }
}

impl<'a> Integrator<'a> {
    /// The radiance along the first `count` rays of a block. Adds the rays it traces to `rays`.
    pub(in crate::techniques) fn radiance_of_block(
        &self,
        block: &mut Block<'a>,
        count: usize,
        mut samplers: Samplers,
        rays: &mut u64,
    ) {
        self.frame.world.closest_packet(&block.rays[..count], &mut block.hits[..count]);
        *rays += count as u64;
        for (i, path) in block.paths[..count].iter_mut().enumerate() {
            let time = block.rays[i].time;
            *path = Path { pixel: i as u8, time, throughput: Vec3::ONE, departure: None };
        }
        block.radiance[..count].fill(Vec3::ZERO);
        let mut under_way = count;
        for depth in 0.. {
            let arrived = self.arrive(block, under_way, depth, &mut samplers);
            if depth >= self.settings.max_depth || arrived == 0 {
                return;
            }
            samplers.next_four(arrived, &mut block.numbers);
            if self.in_media {
                samplers.next_four(arrived, &mut block.passage);
            }
            self.seek_light(block, depth, rays);
            let u_lobe = block.numbers[3];
            samplers.next_four(arrived, &mut block.numbers);
            under_way = self.scatter(block, depth, &u_lobe, &mut samplers);
            *rays += under_way as u64;
            let nothing_shines =
                self.frame.lights.emitters().is_empty() && !self.cutouts.any && !self.in_media;
            if depth + 1 >= self.settings.max_depth && nothing_shines {
                return self.look_for_environment(block, under_way, depth + 1);
            }
            for (ray, hit) in block.rays[..under_way].iter().zip(&mut block.hits) {
                *hit = self.frame.world.closest(ray);
            }
        }
    }

    /// Makes vertices of the paths whose rays met something and adds what shines there; the others end in the
    /// environment. Returns how many vertices there are.
    fn arrive(&self, block: &mut Block<'a>, under_way: usize, depth: u32, samplers: &mut Samplers) -> usize {
        let frame = self.frame;
        block.vertices.clear();
        let mut escaped = 0;
        let mut arrived = [0; LANES];
        let mut ended = [block.paths[0]; LANES];
        if self.in_media {
            samplers.next_four(under_way, &mut block.passage);
        }
        for i in 0..under_way {
            let mut path = block.paths[i];
            let sent = block.rays[i];
            let hit = self.cutouts.stopping(frame, &mut block.rays[i], block.hits[i]);
            if self.in_media {
                let u = block.passage.map(|of_all| of_all[i]);
                let stopped = &block.rays[i];
                if let Some(at) = self.collision(&sent, stopped, hit.as_ref(), u, &mut path.throughput) {
                    let place = block.vertices.len();
                    block.vertices.push(Vertex::in_medium(frame, &sent, at.t, at.anisotropy));
                    (block.paths[place], arrived[place]) = (path, i as u8);
                    continue;
                }
            }
            let Some(hit) = &hit else {
                (ended[escaped], block.directions[escaped]) = (path, block.rays[i].direction);
                escaped += 1;
                continue;
            };
            let place = block.vertices.len();
            block.vertices.push(Vertex::stopped(frame, &block.rays[i], hit));
            (block.paths[place], arrived[place]) = (path, i as u8);
        }
        if escaped > 0
            && let Some(environment) = frame.lights.environment()
        {
            environment.locate_many(frame.world.simd(), &block.directions, escaped, &mut block.points);
            self.add_environment(block, &ended[..escaped], depth);
        }
        for (vertex, path) in block.vertices.iter().zip(&block.paths) {
            if vertex.material.is_emissive() {
                let found =
                    self.emitted_by(vertex, path.throughput, path.departure.as_ref(), path.time, depth);
                block.radiance[path.pixel as usize] += found;
            }
        }
        samplers.keep(&arrived[..block.vertices.len()]);
        block.vertices.len()
    }

    /// Light that comes straight to the vertices, from one sample of the lights for each.
    fn seek_light(&self, block: &mut Block<'a>, depth: u32, rays: &mut u64) {
        let (world, lights) = (&self.frame.world, &self.frame.lights);
        let (vertices, paths) = (&block.vertices, &block.paths);
        let point = |i: usize| (vertices[i].surface.position, paths[i].time);
        lights.sample_many(world.simd(), vertices.len(), point, &block.numbers, &mut block.lights);
        block.shadows.clear();
        for (i, vertex) in vertices.iter().enumerate() {
            if vertex.bsdf.is_delta_only() {
                continue;
            }
            let Some(light) = block.lights.get(i) else { continue };
            let Some((scattered, scale)) = scattered(vertex, light) else { continue };
            let shadow = Shadow { vertex: i as u8, scattered, scale, arrival: light.arrival, ray: 0 };
            block.shadows.push(shadow, shadow_ray(vertex, light, paths[i].time));
        }
        *rays += block.shadows.len() as u64;
        block.shadows.trace(self.frame, self.cutouts);
        let through = self.in_media.then(|| block.shadows.rays());
        for (shadow, radiance) in block.shadows.arriving(world.simd(), lights.environment()) {
            let path = &paths[shadow.vertex as usize];
            let mut direct = shadow.scattered * radiance * shadow.scale;
            if let Some(rays) = &through {
                let u = block.passage.map(|of_all| of_all[shadow.vertex as usize]);
                direct *= self.transmittance(&rays[shadow.ray as usize], u);
            }
            block.radiance[path.pixel as usize] += self.bounded(path.throughput * direct, depth + 1);
        }
    }

    /// The next rays of the paths that go on, by a sample of the material at each vertex. Returns how many.
    fn scatter(
        &self,
        block: &mut Block<'a>,
        depth: u32,
        u_lobe: &[f32; LANES],
        samplers: &mut Samplers,
    ) -> usize {
        let mut count = 0;
        for (i, vertex) in block.vertices.iter().enumerate() {
            let v = |dimension: usize| block.numbers[dimension][i];
            let mut path = block.paths[i];
            let next = self.next(vertex, u_lobe[i], Vec2::new(v(0), v(1)), v(2), depth, &mut path.throughput);
            let Some((direction, departure)) = next else { continue };
            path.departure = departure;
            block.paths[count] = path;
            block.rays[count] = vertex.surface.spawn(direction, path.time);
            block.places[count] = i as u8;
            count += 1;
        }
        samplers.keep(&block.places[..count]);
        count
    }

    /// The end of paths that only the environment can add to: whether anything is in the way is all that matters.
    fn look_for_environment(&self, block: &mut Block<'a>, under_way: usize, depth: u32) {
        let (world, lights) = (&self.frame.world, &self.frame.lights);
        let Some(environment) = lights.environment() else { return };
        for (direction, ray) in block.directions.iter_mut().zip(&block.rays[..under_way]) {
            *direction = ray.direction;
        }
        environment.locate_many(world.simd(), &block.directions, under_way, &mut block.points);
        world.occluded_scattered(&block.rays[..under_way], &mut block.blocked[..under_way]);
        let mut ended = [block.paths[0]; LANES];
        let mut free = 0;
        for i in (0..under_way).filter(|&i| !block.blocked[i]) {
            (ended[free], block.points[free]) = (block.paths[i], block.points[i]);
            free += 1;
        }
        self.add_environment(block, &ended[..free], depth);
    }

    /// What paths bring whose rays met the environment at the first of the block's points.
    fn add_environment(&self, block: &mut Block, ended: &[Path], depth: u32) {
        let (world, lights) = (&self.frame.world, &self.frame.lights);
        let Some(environment) = lights.environment() else { return };
        environment.radiance_many(world.simd(), &block.points, ended.len(), &mut block.found);
        for (path, found) in ended.iter().zip(block.points.iter().copied().zip(block.found)) {
            let contribution = self.escaped(path.throughput, path.departure.as_ref(), found, depth);
            block.radiance[path.pixel as usize] += contribution;
        }
    }
}
