//! A pyramid of 385 cannonballs, struck by a wrecking ball on a chain of 16 links: 402 spheres.
//!
//! The pendulum swings by its own law, too heavy to be slowed. The cannonballs are moved by positions (Müller et al.
//! 2007): predicted, pushed out of each other, of the wrecking ball and of the ground, their speeds what is left of
//! that. They sleep until they are struck or lose what they rest on.

use glam::{Vec2, Vec3};
use halflight_shape::procedural::SineTerm;
use halflight_shape::procedural::mesh::ico_sphere;

use crate::glb::{Body, Node, Scene};

/// Keys a second, and how many.
const RATE: usize = 15;
const KEYS: usize = 31;
/// Steps of the motion between keys.
const STEPS: usize = 64;
/// Times that contacts are gone through in a step.
const ROUNDS: usize = 3;
const GRAVITY: f32 = 9.81;

/// Balls along a side of the lowest layer.
const SIDE: usize = 10;
const RADIUS: f32 = 0.17;
/// Where the middle of the pyramid stands.
const PILE: Vec2 = Vec2::new(1.75, 0.0);

/// The wrecking ball, its pivot, the length of its chain to the middle of the ball.
const BALL: f32 = 0.8;
const PIVOT: Vec3 = Vec3::new(-0.7, 6.5, 0.0);
const LENGTH: f32 = 6.02;
/// Angle from the vertical and its speed at the start.
const ANGLE: f32 = -0.50;
const SPEED: f32 = 0.75;
const LINKS: usize = 16;
const LINK: f32 = 0.11;

/// Where something is at rising times.
pub(crate) type Path = Vec<(f32, Vec3)>;

/// The cannonballs, the wrecking ball with its chain, and the path of that ball.
pub(crate) fn scenes() -> (Scene, Scene, Path) {
    let interval = 1.0 / RATE as f32;
    let (path, wrecker) = pendulum();
    let tracks = cannonballs(&path);
    let pile = tracks.into_iter().enumerate().map(|(i, track)| {
        let moves = track.iter().any(|p| p.distance(track[0]) > 1e-3);
        Node {
            name: format!("cannonball {}", i + 1),
            rest: track[0],
            scale: Some(RADIUS),
            translations: if moves { track } else { Vec::new() },
            ..Node::default()
        }
    });
    let sphere = ico_sphere(1.0, 2);
    let scene = |nodes| Scene { nodes, interval, body: Body::Everywhere(sphere.clone()) };
    (scene(pile.collect()), scene(wrecker), path)
}

/// The path of the ball, twice as fine as the keys, and the nodes of ball and chain.
fn pendulum() -> (Path, Vec<Node>) {
    let place = |angle: f32, along: f32| PIVOT + along * Vec3::new(angle.sin(), -angle.cos(), 0.0);
    let (mut angle, mut speed) = (ANGLE, SPEED);
    let mut angles = Vec::new();
    let dt = 1.0 / (RATE * STEPS) as f32;
    for step in 0..=(KEYS - 1) * STEPS {
        if step % (STEPS / 2) == 0 {
            angles.push(angle);
        }
        speed -= GRAVITY / LENGTH * angle.sin() * dt;
        angle += speed * dt;
    }
    let path = angles
        .iter()
        .enumerate()
        .map(|(i, &angle)| (i as f32 / (2 * RATE) as f32, place(angle, LENGTH)))
        .collect();
    let node = |name: String, radius: f32, along: f32| {
        let track: Vec<Vec3> = angles.iter().step_by(2).map(|&angle| place(angle, along)).collect();
        Node { name, rest: track[0], scale: Some(radius), translations: track, ..Node::default() }
    };
    let mut nodes = vec![node("ball".into(), BALL, LENGTH)];
    for link in 0..LINKS {
        let along = LENGTH - BALL - 0.05 - 0.19 * link as f32;
        nodes.push(node(format!("link {}", link + 1), LINK, along));
    }
    (path, nodes)
}

struct Pile {
    at: Vec<Vec3>,
    before: Vec<Vec3>,
    speed: Vec<Vec3>,
    awake: Vec<bool>,
    start: Vec<Vec3>,
    /// The balls that each rests on or touches at the start.
    neighbours: Vec<Vec<usize>>,
}

/// Where each cannonball is at each key.
fn cannonballs(path: &Path) -> Vec<Vec<Vec3>> {
    let mut pile = Pile::stacked();
    let mut tracks: Vec<Vec<Vec3>> = pile.at.iter().map(|&p| vec![p]).collect();
    let dt = 1.0 / (RATE * STEPS) as f32;
    for key in 1..KEYS {
        for step in 0..STEPS {
            let time = ((key - 1) * STEPS + step + 1) as f32 * dt;
            if step % 16 == 0 {
                pile.wake_unsupported();
            }
            pile.step(dt, ball_at(path, time));
        }
        tracks.iter_mut().zip(&pile.at).for_each(|(track, &p)| track.push(p));
    }
    tracks
}

fn ball_at(path: &Path, time: f32) -> Vec3 {
    let after = path.partition_point(|(t, _)| *t <= time).clamp(1, path.len() - 1);
    let ((t0, a), (t1, b)) = (path[after - 1], path[after]);
    a.lerp(b, (time - t0) / (t1 - t0))
}

/// The ground of `wrecking-ball.toml` before it is dented.
fn ground(place: Vec3) -> f32 {
    waves().iter().map(|w| w.amplitude * (w.kx * place.x + w.kz * place.z + w.phase).sin()).sum()
}

fn waves() -> [SineTerm; 3] {
    let wave = |amplitude, kx, kz, phase| SineTerm { amplitude, kx, kz, phase, angular_speed: 0.0 };
    [wave(0.06, 0.7, 0.5, 0.3), wave(0.04, -1.1, 1.4, 1.9), wave(0.02, 2.7, 1.0, 0.7)]
}

impl Pile {
    fn stacked() -> Self {
        let mut at = Vec::new();
        // The lowest layer stands on the lowest ground below it.
        let floor = ground(Vec3::new(PILE.x, 0.0, PILE.y)) + RADIUS;
        for layer in 0..SIDE {
            let side = SIDE - layer;
            for i in 0..side * side {
                let offset = |k: usize| 2.0 * RADIUS * (k as f32 - 0.5 * (side - 1) as f32);
                let height = floor + layer as f32 * RADIUS * std::f32::consts::SQRT_2;
                at.push(Vec3::new(PILE.x + offset(i % side), height, PILE.y + offset(i / side)));
            }
        }
        let touches = |a: usize, b: usize| a != b && at[a].distance(at[b]) < 2.05 * RADIUS;
        let neighbours = (0..at.len()).map(|a| (0..at.len()).filter(|&b| touches(a, b)).collect()).collect();
        let count = at.len();
        Self {
            before: at.clone(),
            start: at.clone(),
            at,
            speed: vec![Vec3::ZERO; count],
            awake: vec![false; count],
            neighbours,
        }
    }

    /// Wakes the balls whose neighbours have gone.
    fn wake_unsupported(&mut self) {
        let gone: Vec<bool> =
            self.at.iter().zip(&self.start).map(|(p, s)| p.distance(*s) > 0.4 * RADIUS).collect();
        for i in 0..self.at.len() {
            self.awake[i] |=
                self.neighbours[i].iter().any(|&n| gone[n] && self.start[n].y < self.start[i].y + 0.01);
        }
    }

    fn step(&mut self, dt: f32, ball: Vec3) {
        for i in 0..self.at.len() {
            self.before[i] = self.at[i];
            if self.awake[i] {
                self.speed[i].y -= GRAVITY * dt;
                self.at[i] += self.speed[i] * dt;
            }
        }
        let pairs = self.near();
        for _ in 0..ROUNDS {
            for &(a, b) in &pairs {
                self.separate(a, b, dt);
            }
            for i in 0..self.at.len() {
                let away = self.at[i] - ball;
                let depth = BALL + RADIUS - away.length();
                if depth > 0.0 {
                    self.awake[i] = true;
                    self.at[i] += away.normalize_or(Vec3::Y) * depth;
                }
                let below = ground(self.at[i]) + RADIUS - self.at[i].y;
                if self.awake[i] && below > 0.0 {
                    self.at[i].y += below;
                    // Rolling on soft ground slows down.
                    let slid = self.at[i] - self.before[i];
                    self.at[i] -= 0.012 * Vec3::new(slid.x, 0.0, slid.z);
                }
            }
        }
        for i in 0..self.at.len() {
            self.speed[i] = (self.at[i] - self.before[i]) / dt * 0.9995;
            // What the ball presses out of its way leaves at most a little faster than the ball.
            self.speed[i] = self.speed[i].clamp_length_max(6.5);
        }
    }

    fn separate(&mut self, a: usize, b: usize, dt: f32) {
        let away = self.at[b] - self.at[a];
        let depth = 2.0 * RADIUS - away.length();
        if depth <= 1e-5 {
            return;
        }
        // A sleeper wakes where it is struck at more than a tenth of a metre a second.
        let struck = depth > 0.1 * dt;
        for (one, other) in [(a, b), (b, a)] {
            if struck && self.awake[one] && !self.awake[other] {
                self.awake[other] = true;
            }
        }
        let share = match (self.awake[a], self.awake[b]) {
            (true, true) => [0.5, 0.5],
            (true, false) => [1.0, 0.0],
            (false, true) => [0.0, 1.0],
            (false, false) => return,
        };
        let normal = away.normalize_or(Vec3::Y);
        self.at[a] -= normal * (depth * share[0]);
        self.at[b] += normal * (depth * share[1]);
        // Rubbing takes a little of the motion along each other.
        let slide = (self.at[b] - self.before[b]) - (self.at[a] - self.before[a]);
        let along = slide - normal * slide.dot(normal);
        self.at[a] += along * (0.02 * share[0]);
        self.at[b] -= along * (0.02 * share[1]);
    }

    /// Pairs that may touch in a step.
    fn near(&self) -> Vec<(usize, usize)> {
        let reach = (2.1 * RADIUS).powi(2);
        let mut pairs = Vec::new();
        for a in 0..self.at.len() {
            for b in a + 1..self.at.len() {
                if (self.awake[a] || self.awake[b]) && self.at[a].distance_squared(self.at[b]) < reach {
                    pairs.push((a, b));
                }
            }
        }
        pairs
    }
}
