//! The way of a path's light, walked from the light to the eye, with the covariance after each event.
//!
//! Paths are found from the eye, but covariance is carried from the light: its operators are those of light on its way, and
//! no operator has to be inverted. So a path remembers its vertices, and each time it finds light the walk begins there. Axes
//! across a ray are (x, y) with x × y along the eye's ray, until a reflection mirrors them; they are turned into the plane of
//! incidence at each event by the vectors themselves.

use glam::Vec3;
use halflight_frequency::covariance::{
    Covariance5, Interface, Steps, henyey_greenstein_peak, lobe_from_log_hessian,
};
use halflight_material::MaterialKind;
use halflight_scene::Frame;
use halflight_scene::lights::luminance;
use halflight_trace::Hit;

use super::film_axes::FilmAxes;
use super::look::{Edge, velocity};
use super::pilot::bend;
use super::products::{absorbed, facet_slopes, painted};
use crate::vertex::Vertex;

/// Vertices that a path remembers; light from further away begins at the last of them.
pub(super) const MOST: usize = 16;
/// The step of the differences that a lobe is measured by, radians.
const LOBE_STEP: f32 = 0.02;
/// Lobes wider than this (variance, radians²) leave no trace of curvature.
pub(super) const DULL: f64 = 0.15;

/// The share of the way to an edge that a window's deviation is.
const SHARE: f32 = 0.33;

/// A vertex on the way.
#[derive(Clone, Copy)]
pub(super) struct Node<'a> {
    pub(super) vertex: Vertex<'a>,
    /// To the vertex before, or to the lens.
    pub(super) distance: f32,
    /// Of the ray that found it; none in a medium.
    pub(super) hit: Option<Hit>,
    pub(super) time: f32,
    /// Of a point in a medium.
    pub(super) anisotropy: Option<f32>,
    /// n beyond over n of the eye's side, where light may come through.
    pub(super) ratio: Option<f32>,
    pub(super) delta: bool,
}

/// Light at the beginning of a walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Towards it, from the last vertex.
    pub(super) direction: Vec3,
    /// Steradians that it fills from there.
    pub(super) solid_angle: f32,
    /// How far it is; infinite for the environment.
    pub(super) distance: f32,
    /// Cycles per radian that the picture of it holds, for the environment.
    pub(super) bandwidth: f32,
}

/// The spectrum of light while it travels.
pub(super) struct Beam {
    pub(super) covariance: Covariance5,
    pub(super) axes: [Vec3; 2],
}

impl Beam {
    /// Turns the first axis towards a direction.
    pub(super) fn turned(&mut self, towards: Vec3) {
        let [x, y] = self.axes;
        let (cos, sin) = (x.dot(towards), y.dot(towards));
        let length = (cos * cos + sin * sin).sqrt();
        if length < 1e-6 {
            return;
        }
        let (cos, sin) = (cos / length, sin / length);
        self.covariance = self.covariance.rotate_by(f64::from(cos), f64::from(sin));
        self.axes = [cos * x + sin * y, cos * y - sin * x];
    }
}

/// Remembers steps, or does not.
pub(super) type Note<'n> = Option<&'n mut Steps<5>>;

pub(super) fn note(steps: &mut Note, covariance: &Covariance5, name: impl FnOnce() -> String) {
    if let Some(steps) = steps {
        steps.note(name(), covariance);
    }
}

/// Past a vertex; `pixel` is how wide a pixel is there.
fn past(frame: &Frame, mut beam: Beam, node: &Node, incoming: Vec3, pixel: f32, steps: &mut Note) -> Beam {
    match node.anisotropy {
        Some(g) => scatter_to(&mut beam, incoming, node.vertex.towards_eye, g, steps),
        None => surface(frame, &mut beam, node, incoming, pixel, steps),
    }
    beam
}

/// Over a way that begins at a point, through what media there are.
pub(super) fn travel(
    frame: &Frame,
    beam: &mut Beam,
    (from, direction): (Vec3, Vec3),
    distance: f32,
    end: &str,
    steps: &mut Note,
) {
    let whole = f64::from(distance);
    match absorbed(&frame.media, from, direction, distance, beam.axes) {
        None => {
            beam.covariance = beam.covariance.travel(whole);
            note(steps, &beam.covariance, || format!("travel {distance:.3} m{end}"));
        }
        Some(bends) => {
            beam.covariance = beam.covariance.travel(0.5 * whole).absorb(bends).travel(0.5 * whole);
            note(steps, &beam.covariance, || {
                let [xx, xy, yy] = bends;
                format!(
                    "travel {distance:.3} m{end}, absorbed by a depth that bends {xx:.3} {xy:.3} {yy:.3} 1/m²"
                )
            });
        }
    }
}

impl Source {
    /// Its light where it arrives.
    fn beam(&self, frame: &Frame, to: Vec3, steps: &mut Note) -> Beam {
        let x = self.direction.any_orthonormal_vector();
        let axes = [x, self.direction.cross(x)];
        // A disc of this solid angle has Ω/4π of variance per axis.
        let spread = f64::from(self.solid_angle.clamp(1e-7, 12.6)) / (4.0 * std::f64::consts::PI);
        let distance = f64::from(self.distance);
        let (s, nothing) = (spread.sqrt(), f64::INFINITY);
        let mut covariance = if distance.is_finite() {
            Covariance5::of_window([s * distance, s * distance, nothing, nothing, nothing])
        } else {
            Covariance5::of_window([nothing, nothing, s, s, nothing])
        };
        // The bandwidth of a map holds most of its energy: two standard deviations.
        let own = f64::from(0.25 * self.bandwidth * self.bandwidth);
        for axis in 2..4 {
            covariance.rows[axis][axis] += own;
        }
        note(steps, &covariance, || match (self.distance.is_finite(), self.solid_angle > 0.0) {
            (true, true) => format!("light: {:.4} sr, {:.3} m away", self.solid_angle, self.distance),
            (true, false) => format!("light: a point, {:.3} m away", self.distance),
            (false, true) => format!("light: the sky, {:.3} cycles per radian there", self.bandwidth),
            (false, false) => "light: from one direction".into(),
        });
        let mut beam = Beam { covariance, axes };
        if distance.is_finite() {
            travel(frame, &mut beam, (to, self.direction), self.distance, "", steps);
        }
        beam
    }
}

/// From the source over the vertices, the last of which it lights, to the film: one contribution alone, for explanations. `ray` is the direction of the eye's first ray.
pub(super) fn carried(
    frame: &Frame,
    nodes: &[Node],
    source: &Source,
    ray: Vec3,
    axes: &FilmAxes,
    mut steps: Note,
) -> Covariance5 {
    let lit = nodes.last().map_or(Vec3::ZERO, |node| node.vertex.surface.position);
    let mut beam = source.beam(frame, lit, &mut steps);
    let mut incoming = source.direction;
    let mut way: f32 = nodes.iter().map(|node| node.distance).sum();
    for (number, node) in nodes.iter().enumerate().rev() {
        beam = past(frame, beam, node, incoming, axes.pixel * way, &mut steps);
        incoming = -node.vertex.towards_eye;
        way -= node.distance;
        if number > 0 {
            let begin = (node.vertex.surface.position, node.vertex.towards_eye);
            travel(frame, &mut beam, begin, node.distance, "", &mut steps);
        }
    }
    to_film(frame, beam, nodes, ray, axes, steps)
}

/// The last way, and through the lens.
fn to_film(
    frame: &Frame,
    mut beam: Beam,
    nodes: &[Node],
    ray: Vec3,
    axes: &FilmAxes,
    mut steps: Note,
) -> Covariance5 {
    let [right, down] = axes.across(ray);
    beam.turned(right);
    if beam.axes[1].dot(down) < 0.0 {
        // An odd number of reflections: the picture's y is the other way round.
        beam.covariance = beam.covariance.scaled(1, -1.0).scaled(3, -1.0);
        beam.axes[1] = -beam.axes[1];
    }
    if let Some(node) = nodes.first() {
        let begin = (node.vertex.surface.position, node.vertex.towards_eye);
        travel(frame, &mut beam, begin, node.distance, ", to the lens", &mut steps);
    }
    if let Some((lens, focus)) = axes.lens(ray, &beam.covariance) {
        note(&mut steps, &lens, || format!("lens, focused at {focus:.3} m"));
    }
    let film = axes.film(ray, &beam.covariance);
    note(&mut steps, &film, || "film: x, y in pixels, lens in metres, shutter".into());
    film
}

/// What the edge that limits a pixel adds at the film: a window at its depth that moves with it. Its deviation is a share of the
/// way to the edge, so small that a filter of two and a half of them does not reach it, and twice that along the edge,
/// which may bend. Operators from there on are linear, so that it is a term of its own: for the least of rays, that of the pixel's middle.
pub(super) fn edge(edge: &Edge, ray: Vec3, axes: &FilmAxes) -> Covariance5 {
    let radius = edge.offset.length() * axes.pixel * edge.depth;
    let velocity = axes.across(ray).map(|axis| f64::from(edge.velocity.dot(axis)));
    let angle = f64::from(edge.offset.y.atan2(edge.offset.x));
    let cos = ray.dot(axes.ahead).max(0.1);
    let light = Covariance5::ZERO
        .occlude_towards(angle, f64::from(SHARE * radius))
        .occlude_towards(angle + std::f64::consts::FRAC_PI_2, f64::from(2.0 * SHARE * radius))
        .out_of_motion(velocity, [0.0; 2])
        .travel(f64::from(edge.depth / cos));
    axes.film(ray, &light)
}

/// What light does at a surface.
pub(super) struct Meeting<'m> {
    pub(super) name: &'m str,
    /// On either side.
    pub(super) normal: Vec3,
    /// Towards where the light comes from, and where it goes.
    pub(super) incoming: Vec3,
    pub(super) outgoing: Vec3,
    pub(super) velocity: Vec3,
    /// n of the light's side over n of the other, where light goes through.
    pub(super) ratio: Option<f32>,
    pub(super) delta: bool,
    /// The spectrum of what is painted there, as a sum of squares.
    pub(super) painted: Option<[Vec3; 2]>,
    /// The variance of slopes of facets that refract.
    pub(super) facets: Option<f64>,
}

/// Reflection or refraction at a surface.
fn surface(frame: &Frame, beam: &mut Beam, node: &Node, incoming: Vec3, pixel: f32, steps: &mut Note) {
    let vertex = &node.vertex;
    let instance = vertex.surface.instance;
    let meeting = Meeting {
        name: &vertex.material.name,
        normal: vertex.shading_normal(),
        incoming,
        outgoing: vertex.towards_eye,
        velocity: velocity(frame, instance, vertex.surface.position, node.time),
        ratio: node.ratio,
        delta: node.delta,
        painted: painted(frame, node, incoming, pixel),
        facets: facet_slopes(vertex.material, vertex.surface.uv),
    };
    let bend = node.hit.as_ref().and_then(|hit| bend(frame, vertex, hit, node.time, node.distance));
    let normal = vertex.shading_normal();
    let lobe = |axes| {
        if matches!(vertex.material.kind, MaterialKind::Diffuse { .. }) {
            return lobe_from_log_hessian([0.0; 3]);
        }
        // The cosine is an event of its own.
        let scattered = |d: Vec3| {
            let value = luminance(vertex.bsdf.eval(vertex.wo, vertex.to_local(d)));
            value / d.dot(normal).abs().max(1e-3)
        };
        lobe(incoming, axes, scattered)
    };
    meet(beam, &meeting, bend.as_ref(), lobe, steps);
}

/// Light past a surface that reflects or refracts it. `bend` is as seen from the outgoing side, `lobe` gives the variance of what
/// is scattered about the direction of the light, on tangent axes.
pub(super) fn meet(
    beam: &mut Beam,
    meeting: &Meeting,
    bend: Option<&[[Vec3; 2]; 2]>,
    lobe: impl FnOnce([Vec3; 2]) -> [f64; 3],
    steps: &mut Note,
) {
    let Meeting { incoming, outgoing, .. } = *meeting;
    let normal = if meeting.normal.dot(outgoing) < 0.0 { -meeting.normal } else { meeting.normal };
    let passes = meeting.ratio.filter(|_| incoming.dot(normal) < 0.0);
    let (cos_in, cos_out) = (incoming.dot(normal).abs().max(0.02), outgoing.dot(normal).abs().max(0.02));
    let in_plane =
        |direction: Vec3, fallback: Vec3| (direction - normal * normal.dot(direction)).normalize_or(fallback);
    let tangent = in_plane(incoming, in_plane(beam.axes[0], normal.any_orthonormal_vector()));
    // Towards the light x looks along the tangent that the light comes from.
    let across = (tangent - incoming * incoming.dot(tangent)).normalize_or(tangent);
    beam.turned(across);
    let on = |v: Vec3, axes: [Vec3; 2]| axes.map(|axis| f64::from(v.dot(axis)));
    let moves = meeting.velocity != Vec3::ZERO;
    if moves {
        let velocity = on(meeting.velocity, beam.axes);
        beam.covariance = beam.covariance.into_motion(velocity, [0.0; 2]);
    }
    let mut c = beam.covariance.arrive(f64::from(cos_in));
    let b = beam.axes[1];
    let lobe = if meeting.delta { [0.0; 3] } else { lobe([tangent, b]) };
    let sharp = lobe[0].min(lobe[2]) < DULL;
    let k = if sharp { curvature(bend, [tangent, b]) } else { [0.0; 3] };
    let bent = k != [0.0; 3];
    let sign = if passes.is_some() { -1.0 } else { 1.0 };
    if bent {
        c = c.curve(k.map(|k| sign * k), f64::from(cos_in));
    }
    if let Some(painted) = meeting.painted {
        let on = painted.map(|p| [f64::from(p.dot(tangent)), f64::from(p.dot(b))]);
        let sum = |i: usize, k: usize| on[0][i] * on[0][k] + on[1][i] * on[1][k];
        let spectrum = [sum(0, 0), sum(0, 1), sum(1, 1)];
        c = c.texture(spectrum);
        note(steps, &c, || {
            format!(
                "texture of {}: {:.3} x {:.3} cycles per metre",
                meeting.name,
                sum(0, 0).sqrt(),
                sum(1, 1).sqrt()
            )
        });
    }
    if !meeting.delta {
        c = c.cosine(f64::from(cos_in));
        note(steps, &c, || format!("cosine {cos_in:.3}"));
    }
    if let Some(ratio) = passes {
        let interface = Interface { indices: [f64::from(ratio), 1.0], cos_in: f64::from(cos_in) };
        c = match meeting.facets.filter(|_| !meeting.delta) {
            Some(slopes) => c.refract_rough(&interface, slopes),
            // A lobe is measured where light comes from.
            None => c.reflect(lobe).refract(&interface),
        }
        .unwrap_or(c);
    } else if !meeting.delta {
        c = c.reflect(lobe);
    }
    if bent {
        c = c.curve(k, f64::from(cos_out));
    }
    // To the plane of the outgoing ray.
    let out = in_plane(outgoing, tangent);
    // Its tangent looks the way the light's does, as a mirror would send it.
    let out = if out.dot(tangent) < 0.0 { -out } else { out };
    let on_surface = Beam { covariance: c, axes: [tangent, b] };
    let mut turned = on_surface;
    turned.turned(out);
    let x = (turned.axes[0] - outgoing * outgoing.dot(turned.axes[0])).normalize_or(turned.axes[0]);
    beam.axes = [x, turned.axes[1]];
    beam.covariance = turned.covariance.leave(f64::from(cos_out));
    if moves {
        let velocity = on(meeting.velocity, beam.axes);
        beam.covariance = beam.covariance.out_of_motion(velocity, [0.0; 2]);
    }
    note(steps, &beam.covariance, || {
        let what = match (passes, meeting.delta) {
            (Some(_), true) => "refraction",
            (Some(_), false) => "rough refraction",
            (None, true) => "mirror",
            (None, false) => "reflection",
        };
        format!(
            "{what} by {}, cos {cos_in:.3} in, {cos_out:.3} out, lobe {:.4} x {:.4} rad, curvature {:.3} {:.3} {:.3} 1/m",
            meeting.name,
            lobe[0].sqrt(),
            lobe[2].sqrt(),
            k[0],
            k[1],
            k[2]
        )
    });
}

/// Light past a point of a medium.
pub(super) fn scatter_to(beam: &mut Beam, incoming: Vec3, outgoing: Vec3, g: f32, steps: &mut Note) {
    let ahead = -outgoing;
    let cos = incoming.dot(ahead);
    let in_plane = (ahead - incoming * cos).normalize_or(beam.axes[0]);
    beam.turned(-in_plane);
    let variance = henyey_greenstein_peak(f64::from(g));
    beam.covariance = beam.covariance.scatter(f64::from(cos), variance);
    let x = (incoming - ahead * cos).normalize_or(beam.axes[0]);
    beam.axes = [x, beam.axes[1]];
    note(steps, &beam.covariance, || {
        format!("scattering, cos {cos:.3}, phase function {:.4} rad", variance.sqrt())
    });
}

/// The lobe about the direction that light came from, by differences of its logarithm along and across the plane.
pub(super) fn lobe(
    incoming: Vec3,
    [tangent, across]: [Vec3; 2],
    scattered: impl Fn(Vec3) -> f32,
) -> [f64; 3] {
    let value = |direction: Vec3| scattered(direction.normalize());
    let middle = value(incoming);
    let second = |axis: Vec3| {
        let axis = (axis - incoming * incoming.dot(axis)).normalize_or(axis);
        let (a, b) = (value(incoming + LOBE_STEP * axis), value(incoming - LOBE_STEP * axis));
        if a <= 0.0 || b <= 0.0 || middle <= 0.0 {
            return 0.0;
        }
        f64::from((a.ln() + b.ln() - 2.0 * middle.ln()) / (LOBE_STEP * LOBE_STEP))
    };
    lobe_from_log_hessian([second(tangent), 0.0, second(across)])
}

/// [K_xx, K_xy, K_yy] on tangent axes from how the normal turned over two steps.
fn curvature(bend: Option<&[[Vec3; 2]; 2]>, [x, y]: [Vec3; 2]) -> [f64; 3] {
    let Some(&[[p, n], [q, m]]) = bend else { return [0.0; 3] };
    let on = |v: Vec3| [f64::from(v.dot(x)), f64::from(v.dot(y))];
    let ([p, n], [q, m]) = ([on(p), on(n)], [on(q), on(m)]);
    let determinant = p[0] * q[1] - p[1] * q[0];
    let size = (p[0] * p[0] + p[1] * p[1]) * (q[0] * q[0] + q[1] * q[1]);
    if determinant * determinant <= 1e-6 * size || size <= 0.0 {
        return [0.0; 3];
    }
    // S [p q] = [n m].
    let s = |row: usize| {
        [(n[row] * q[1] - m[row] * p[1]) / determinant, (m[row] * p[0] - n[row] * q[0]) / determinant]
    };
    let (first, second) = (s(0), s(1));
    let k = [first[0], 0.5 * (first[1] + second[0]), second[1]];
    // Sharper than the steps: an edge, which others look after.
    let most = 2.0 / size.sqrt().sqrt();
    if k.iter().all(|k| k.is_finite()) { k.map(|k| k.clamp(-most, most)) } else { [0.0; 3] }
}
