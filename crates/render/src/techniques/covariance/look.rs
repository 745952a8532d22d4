//! What the picture shows through the middle of its lens: depths, normals, velocities, and how far the next edge is.
//!
//! Two rays a pixel: to what it shows, and from there to the narrowest light. An edge lies between two pixels that show
//! different things: another shape, a fold, a step in depth, another colour, or the light on one side of a shadow's border,
//! which is as wide as that light makes it. Each pixel is told the edge that limits its filter most: that of the least d² + b²,
//! d its distance in the picture and b what lens, shutter and light blur it by, both in pixels. A near miss counts as a near hit.
//! Edges are spread by sweeps of vector distances (Danielsson 1980).

use glam::{Vec2, Vec3};
use halflight_scene::Frame;
use halflight_scene::lights::DeltaLight;
use halflight_trace::Hit;
use rayon::prelude::*;

use super::film_axes::{FilmAxes, pinhole};
use crate::vertex::Vertex;

/// What one pixel shows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// Instance + 1; 0 for nothing.
    pub(super) what: u32,
    /// Along the viewing direction.
    pub(super) depth: f32,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) albedo: f32,
    /// Metres a shutter.
    pub(super) velocity: Vec3,
    /// Whether the narrowest light reaches it.
    pub(super) lit: bool,
    /// How wide the border of the shadow is, metres, where it does not.
    pub(super) penumbra: f32,
}

/// The edge that limits a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// From the pixel to the edge, in pixels.
    pub(super) offset: Vec2,
    /// Depth of what ends there.
    pub(super) depth: f32,
    pub(super) velocity: Vec3,
    /// b².
    blur: f32,
}

impl Edge {
    const NONE: Self = Self { offset: Vec2::splat(1e4), depth: 1.0, velocity: Vec3::ZERO, blur: 0.0 };

    /// Whether it is nearer than so many pixels and deviations of what blurs it.
    pub(super) fn is_within(&self, pixels: f32, deviations: f32) -> bool {
        self.offset.length_squared() < pixels * pixels + deviations * deviations * self.blur
    }

    fn rank(&self) -> f32 {
        self.offset.length_squared() + self.blur
    }
}

/// A picture of them.
pub(super) struct Look {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) seen: Vec<Seen>,
    pub(super) edges: Vec<Edge>,
}

/// The cosine between normals below which there is a fold.
const FOLD: f32 = 0.9;
/// The step of an albedo that is an edge, relative to the brighter one.
const STEP: f32 = 0.1;

impl Look {
    pub(super) fn new(frame: &Frame, axes: &FilmAxes, width: usize, height: usize) -> Self {
        let seen = see(frame, axes, width, height);
        let mut look = Self { width, height, seen, edges: Vec::new() };
        look.edges = look.find_edges(axes);
        look.sweep();
        look
    }

    fn find_edges(&self, axes: &FilmAxes) -> Vec<Edge> {
        let (width, height) = (self.width, self.height);
        let mut edges = vec![Edge::NONE; width * height];
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                for (dx, dy) in [(1, 0), (0, 1)] {
                    if x + dx >= width || y + dy >= height {
                        continue;
                    }
                    let j = (y + dy) * width + x + dx;
                    let (a, b) = (&self.seen[i], &self.seen[j]);
                    if !differ(a, b, axes.pixel) {
                        continue;
                    }
                    let near = if b.what == 0 || (a.what != 0 && a.depth <= b.depth) { a } else { b };
                    let streak = axes.streak(near.velocity, near.depth).length_squared() / 12.0;
                    let mut blur = axes.blur(near.depth) + streak;
                    if a.lit != b.lit && a.what == b.what {
                        // Of a shadow's border: as wide as its light makes it.
                        let wide = a.penumbra.max(b.penumbra) / (near.depth * axes.pixel);
                        blur += wide * wide / 12.0;
                    }
                    let half = Vec2::new(dx as f32, dy as f32) * 0.5;
                    for (place, offset) in [(i, half), (j, -half)] {
                        let edge = Edge { offset, depth: near.depth, velocity: near.velocity, blur };
                        if edge.rank() < edges[place].rank() {
                            edges[place] = edge;
                        }
                    }
                }
            }
        }
        edges
    }

    /// Spreads edges over the picture: two sweeps down and up, each right and left.
    fn sweep(&mut self) {
        let (width, height) = (self.width, self.height);
        for _ in 0..2 {
            for row in 0..2 * height {
                let down = row < height;
                let y = if down { row } else { 2 * height - 1 - row };
                let before = if down { y.checked_sub(1) } else { (y + 1 < height).then_some(y + 1) };
                if let Some(from) = before {
                    for x in 0..width {
                        self.take(y * width + x, from * width + x, Vec2::new(0.0, from as f32 - y as f32));
                    }
                }
                for x in 1..width {
                    self.take(y * width + x, y * width + x - 1, Vec2::new(-1.0, 0.0));
                }
                for x in (0..width.saturating_sub(1)).rev() {
                    self.take(y * width + x, y * width + x + 1, Vec2::new(1.0, 0.0));
                }
            }
        }
    }

    #[inline]
    fn take(&mut self, to: usize, from: usize, step: Vec2) {
        let edge = Edge { offset: self.edges[from].offset + step, ..self.edges[from] };
        if edge.rank() < self.edges[to].rank() {
            self.edges[to] = edge;
        }
    }
}

fn differ(a: &Seen, b: &Seen, pixel: f32) -> bool {
    if a.what != b.what || a.lit != b.lit {
        return true;
    }
    if a.what == 0 {
        return false;
    }
    let step = b.position - a.position;
    // Off the plane of the nearer one by more than a slant of 80 degrees across a pixel makes.
    let near = a.depth.min(b.depth);
    let fold = a.normal.dot(b.normal) < FOLD;
    let off = step.dot(a.normal).abs().min(step.dot(b.normal).abs()) > 6.0 * pixel * near;
    let step = (a.albedo - b.albedo).abs() > STEP * a.albedo.max(b.albedo);
    fold || off || step
}

/// The light whose shadows have the narrowest borders: a direction or a point, and the angle that it fills from afar.
#[derive(Clone, Copy)]
pub(super) enum Narrow {
    Direction(Vec3, f32),
    Point(Vec3, f32),
}

impl Narrow {
    /// Wider lights, in radians, cast no shadows with borders to look for.
    const WIDEST: f32 = 0.2;

    /// The strongest of few samples of the lights.
    pub(super) fn of(frame: &Frame) -> Option<Self> {
        let lights = &frame.lights;
        let near = lights
            .emitters()
            .iter()
            .map(|e| (e.strength(), e.center(), (e.area() / std::f32::consts::PI).sqrt()));
        let strongest = near.reduce(|a, b| if b.0 > a.0 { b } else { a });
        if let Some((_, center, radius)) = strongest {
            return Some(Self::Point(center, radius));
        }
        if let Some(light) = lights.deltas().first() {
            return Some(match *light {
                DeltaLight::Directional { towards, .. } => Self::Direction(towards, 0.0),
                DeltaLight::Point { position, .. } | DeltaLight::Spot { position, .. } => {
                    Self::Point(position[0], 0.0)
                }
            });
        }
        let environment = lights.environment()?;
        let samples = (0..64).map(|i| {
            let u = Vec2::new((i as f32 + 0.5) / 64.0, (i as f32 * 0.618_034).fract());
            let (direction, _, pdf) = environment.sample(u);
            (direction, pdf)
        });
        let (direction, pdf) = samples.reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let angle = 2.0 / (std::f32::consts::PI * pdf).sqrt();
        (angle < Self::WIDEST).then_some(Self::Direction(direction, angle))
    }

    /// Whether it reaches a point, and how wide the border of the shadow is if not.
    pub(super) fn reaches(self, frame: &Frame, vertex: &Vertex) -> (bool, f32) {
        let position = vertex.surface.position;
        let (ray, angle) = match self {
            Self::Direction(towards, angle) => (vertex.surface.spawn(towards, 0.5), angle),
            Self::Point(point, radius) => {
                let distance = point.distance(position);
                // Not the light's own surface.
                let end = position.lerp(point, 1.0 - (1.01 * radius / distance).min(0.9));
                (vertex.surface.spawn_to(end, 0.5), 2.0 * radius / distance.max(1e-6))
            }
        };
        if angle > Self::WIDEST
            || ray.direction.dot(vertex.surface.geometric_normal)
                * vertex.surface.geometric_normal.dot(vertex.towards_eye)
                <= 0.0
        {
            return (true, 0.0);
        }
        match frame.world.closest(&ray) {
            Some(hit) => (false, angle * hit.t),
            None => (true, 0.0),
        }
    }
}

fn see(frame: &Frame, axes: &FilmAxes, width: usize, height: usize) -> Vec<Seen> {
    let narrow = Narrow::of(frame);
    let view = pinhole(frame, width, height);
    let mut seen = vec![Seen::default(); width * height];
    seen.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let mut rays = Vec::with_capacity(width);
        rays.extend(
            (0..width).map(|x| view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::splat(0.5), 0.5)),
        );
        let mut hits: Vec<Option<Hit>> = vec![None; width];
        frame.world.closest_packet(&rays, &mut hits);
        for ((out, ray), hit) in row.iter_mut().zip(&rays).zip(&hits) {
            let Some(hit) = hit else { continue };
            let vertex = Vertex::new(frame, ray, hit);
            let facing = |n: Vec3| if n.dot(vertex.towards_eye) < 0.0 { -n } else { n };
            let position = vertex.surface.position;
            let (lit, penumbra) = narrow.map_or((true, 0.0), |light| light.reaches(frame, &vertex));
            *out = Seen {
                lit,
                penumbra,
                what: hit.instance + 1,
                depth: axes.view.depth(position, 0.5),
                position,
                normal: facing(vertex.shading_normal()),
                albedo: vertex.bsdf.albedo().element_sum() / 3.0 + vertex.emitted().element_sum(),
                velocity: velocity(frame, hit.instance, position, 0.5),
            };
        }
    });
    seen
}

/// How far a point of an instance goes while the shutter is open; what deforms is taken to stand still.
pub(super) fn velocity(frame: &Frame, instance: u32, point: Vec3, time: f32) -> Vec3 {
    let Some(instance) = frame.world.instances().get(instance as usize) else { return Vec3::ZERO };
    let motion = &instance.transform;
    if !motion.is_moving() {
        return Vec3::ZERO;
    }
    let local = motion.at(time).inverse().transform_point3(point);
    let moved = motion.at(1.0).transform_point3(local) - motion.at(0.0).transform_point3(local);
    if moved.is_finite() { moved } else { Vec3::ZERO }
}
