//! Keyframes: the value of one property of one node as a function of time.
//!
//! - `Step`: the value of the last key at or before t.
//! - `Linear`: v = (1 − s) v₀ + s v₁ with s = (t − t₀)/(t₁ − t₀); rotations along the shorter great arc.
//! - `CubicSpline`: Hermite, with tangents in units per second (glTF 2.0, appendix C.5):
//!   v = (2s³ − 3s² + 1) v₀ + d (s³ − 2s² + s) b₀ + (3s² − 2s³) v₁ + d (s³ − s²) a₁, d = t₁ − t₀;
//!   rotations are normalised afterwards.
//!
//! Before the first key and after the last the curve stays where it is.

use glam::{Quat, Vec3};

/// A named set of curves that play together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelAnimation {
    /// Its name in the file; may be empty.
    pub name: String,
    /// The curves.
    pub channels: Vec<ModelChannel>,
    /// Time of the last key of all, in seconds.
    pub duration: f32,
}

/// One property of one node.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelChannel {
    /// The node.
    pub node: usize,
    /// The property.
    pub property: ModelProperty,
    /// Its value over time.
    pub track: ModelTrack,
}

/// What a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelProperty {
    /// The translation: 3 numbers.
    Translation,
    /// The rotation: the 4 numbers x, y, z, w of a quaternion.
    Rotation,
    /// The scale: 3 numbers.
    Scale,
    /// The weights of the morph targets: one number each.
    MorphWeights,
}

/// How values between keys come about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines; great arcs for rotations.
    #[default]
    Linear,
    /// The last key holds.
    Step,
    /// Cubic Hermite splines.
    CubicSpline,
}

/// Keys of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelTrack {
    /// Between keys.
    pub interpolation: Interpolation,
    /// Times in seconds, not descending, at least one.
    pub times: Vec<f32>,
    /// Numbers per value.
    pub width: usize,
    /// `width` numbers a key; for cubic splines three times that: incoming tangent, value, outgoing tangent.
    pub values: Vec<f32>,
}

impl ModelTrack {
    /// The curve at `time`, as a vector.
    pub(super) fn vec3(&self, time: f32) -> Vec3 {
        let mut value = [0.0; 3];
        self.sample(time, &mut value);
        Vec3::from(value)
    }

    /// The curve at `time`, as a rotation.
    pub(super) fn quat(&self, time: f32) -> Quat {
        let (key, s) = self.locate(time);
        if self.interpolation == Interpolation::Linear && s > 0.0 {
            let at = |key: usize| {
                let v = &self.values[4 * key..4 * key + 4];
                Quat::from_xyzw(v[0], v[1], v[2], v[3])
            };
            return normalized(at(key).slerp(at(key + 1), s));
        }
        let mut value = [0.0; 4];
        self.sample(time, &mut value);
        normalized(Quat::from_array(value))
    }

    /// The curve at `time`, number by number.
    pub(super) fn sample(&self, time: f32, value: &mut [f32]) {
        let (key, s) = self.locate(time);
        let width = self.width.min(value.len());
        match self.interpolation {
            Interpolation::CubicSpline => {
                // A key is three rows: 0 incoming tangent, 1 value, 2 outgoing tangent.
                let row = |key: usize, part: usize, i: usize| self.values[(3 * key + part) * self.width + i];
                for i in 0..width {
                    value[i] = row(key, 1, i);
                    if s > 0.0 {
                        let d = self.times[key + 1] - self.times[key];
                        let (s2, s3) = (s * s, s * s * s);
                        value[i] = (2.0 * s3 - 3.0 * s2 + 1.0) * row(key, 1, i)
                            + d * (s3 - 2.0 * s2 + s) * row(key, 2, i)
                            + (3.0 * s2 - 2.0 * s3) * row(key + 1, 1, i)
                            + d * (s3 - s2) * row(key + 1, 0, i);
                    }
                }
            }
            Interpolation::Linear if s > 0.0 => {
                for i in 0..width {
                    let (from, to) =
                        (self.values[key * self.width + i], self.values[(key + 1) * self.width + i]);
                    value[i] = (1.0 - s) * from + s * to;
                }
            }
            Interpolation::Linear | Interpolation::Step => {
                value[..width].copy_from_slice(&self.values[key * self.width..][..width]);
            }
        }
    }

    /// The last key at or before `time`, and how far time is towards the next, in [0, 1).
    fn locate(&self, time: f32) -> (usize, f32) {
        let key = self.times.partition_point(|t| *t <= time).saturating_sub(1);
        match self.times.get(key + 1) {
            Some(&next) if time > self.times[key] => {
                (key, (time - self.times[key]) / (next - self.times[key]))
            }
            _ => (key, 0.0),
        }
    }
}

/// A spline may pass through zero, where it has no direction.
fn normalized(q: Quat) -> Quat {
    let length = q.length();
    if length > 0.0 && length.is_finite() { q / length } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, width: usize, times: &[f32], values: &[f32]) -> ModelTrack {
        ModelTrack { interpolation, width, times: times.to_vec(), values: values.to_vec() }
    }

    #[test]
    fn curves_stay_where_they_are_outside_their_keys() {
        let line = track(Interpolation::Linear, 3, &[1.0, 3.0], &[0.0, 1.0, 2.0, 4.0, 5.0, 6.0]);
        assert_eq!(line.vec3(-5.0), Vec3::new(0.0, 1.0, 2.0));
        assert_eq!(line.vec3(2.0), Vec3::new(2.0, 3.0, 4.0));
        assert_eq!(line.vec3(99.0), Vec3::new(4.0, 5.0, 6.0));
        assert_eq!(line.vec3(f32::NAN), Vec3::new(0.0, 1.0, 2.0));
    }

    #[test]
    fn steps_hold_until_the_next_key() {
        let steps = track(Interpolation::Step, 1, &[0.0, 1.0, 2.0], &[5.0, 6.0, 7.0]);
        for (time, expected) in [(0.99, 5.0), (1.0, 6.0), (1.5, 6.0), (2.0, 7.0)] {
            let mut value = [0.0];
            steps.sample(time, &mut value);
            assert_eq!(value, [expected], "at {time}");
        }
    }

    #[test]
    fn a_spline_with_the_tangents_of_a_cubic_is_that_cubic() {
        // f(t) = t³ − t, f'(t) = 3t² − 1, with keys at 1 and 3.
        let f = |t: f32| t * t * t - t;
        let g = |t: f32| 3.0 * t * t - 1.0;
        let spline =
            track(Interpolation::CubicSpline, 1, &[1.0, 3.0], &[0.0, f(1.0), g(1.0), g(3.0), f(3.0), 0.0]);
        for time in [1.0, 1.25, 2.0, 2.75, 3.0] {
            let mut value = [0.0];
            spline.sample(time, &mut value);
            assert!((value[0] - f(time)).abs() < 1e-4, "at {time}: {value:?} {}", f(time));
        }
    }

    #[test]
    fn rotations_take_the_shorter_arc() {
        let (from, to) = (Quat::from_rotation_y(0.2), -Quat::from_rotation_y(1.0));
        let keys: Vec<f32> = from.to_array().into_iter().chain(to.to_array()).collect();
        let turn = track(Interpolation::Linear, 4, &[0.0, 1.0], &keys);
        assert!(turn.quat(0.5).angle_between(Quat::from_rotation_y(0.6)) < 1e-3);
    }

    #[test]
    fn keys_at_the_same_time_jump() {
        let jump = track(Interpolation::Linear, 1, &[0.0, 1.0, 1.0, 2.0], &[0.0, 1.0, 5.0, 6.0]);
        let mut value = [0.0];
        jump.sample(1.0, &mut value);
        assert_eq!(value, [5.0]);
        jump.sample(1.5, &mut value);
        assert_eq!(value, [5.5]);
    }
}
