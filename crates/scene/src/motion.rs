//! Keyframed motion: places mixed linearly, rotations along the shortest arc, scales linearly.

use glam::{Affine3A, Quat, Vec3};

use crate::schema::{At, Problem};
use crate::spec::{Ease, TransformKey};

/// A keyframed transform.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    /// At least one, times rising.
    keys: Vec<Key>,
    looped: bool,
}

#[derive(Clone, Copy, Debug)]
struct Key {
    time: f64,
    translation: Vec3,
    rotation: Quat,
    scale: Vec3,
}

impl Track {
    /// The motion of a shape; `None` if it has no keyframes.
    ///
    /// # Errors
    /// If times do not rise.
    pub(crate) fn new(keys: &[At<TransformKey>], repeat: Ease) -> Result<Option<Self>, Problem> {
        rising(keys, |key| key.time)?;
        let key = |key: &At<TransformKey>| Key {
            time: key.time,
            translation: key.translate,
            rotation: key.rotate_degrees.map_or(Quat::IDENTITY, |r| r.0),
            scale: key.scale.map_or(Vec3::ONE, |s| s.0),
        };
        let keys: Vec<Key> = keys.iter().map(key).collect();
        Ok((!keys.is_empty()).then_some(Self { keys, looped: repeat == Ease::Loop }))
    }

    /// Whether anything moves.
    pub(crate) fn moves(&self) -> bool {
        self.keys.len() > 1
    }

    /// The time of the last keyframe.
    pub(crate) fn end(&self) -> f64 {
        self.keys.last().map_or(0.0, |key| key.time)
    }

    /// The transforms when the shutter opens and closes. A loop that ends in between is held at its end.
    pub(crate) fn over(&self, times: [f64; 2]) -> [Affine3A; 2] {
        let (first, last) = (self.keys[0].time, self.end());
        let mut times = times;
        if self.looped && last > first {
            let open = first + (times[0] - first).rem_euclid(last - first);
            times = [open, (open + times[1] - times[0]).clamp(first, last)];
        }
        times.map(|time| self.at(time))
    }

    fn at(&self, time: f64) -> Affine3A {
        let after = self.keys.partition_point(|key| key.time <= time);
        let (a, b) = match (after.checked_sub(1).map(|i| &self.keys[i]), self.keys.get(after)) {
            (Some(a), Some(b)) => (a, b),
            (Some(only), None) | (None, Some(only)) => (only, only),
            (None, None) => return Affine3A::IDENTITY,
        };
        let span = b.time - a.time;
        let part = if span > 0.0 { ((time - a.time) / span) as f32 } else { 0.0 };
        Affine3A::from_scale_rotation_translation(
            a.scale.lerp(b.scale, part),
            a.rotation.slerp(b.rotation, part),
            a.translation.lerp(b.translation, part),
        )
    }
}

/// Refuses keyframes whose times do not rise.
pub(crate) fn rising<T>(keys: &[At<T>], time: impl Fn(&T) -> f64) -> Result<(), Problem> {
    for pair in keys.windows(2) {
        let (before, after) = (time(&pair[0].value), time(&pair[1].value));
        if after <= before {
            let message = format!("the times of keyframes must rise: {after} comes after {before}");
            return Err(Problem::new(&pair[1].origin, message));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::Origin;
    use crate::spec::Rotation;

    fn key(time: f64, x: f32, turn: f32) -> At<TransformKey> {
        let rotate_degrees = Some(Rotation(Quat::from_rotation_y(turn)));
        let value = TransformKey { time, translate: Vec3::X * x, rotate_degrees, scale: None };
        At { origin: Origin::nowhere(), value }
    }

    fn track(repeat: Ease) -> Track {
        let keys = [key(0.0, 0.0, 0.0), key(2.0, 4.0, 1.0), key(3.0, 0.0, 0.0)];
        Track::new(&keys, repeat).ok().flatten().expect("the times rise")
    }

    #[test]
    fn a_motion_passes_through_its_keyframes_and_holds_its_ends() {
        let track = track(Ease::Hold);
        for (time, x, turn) in
            [(-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), (2.0, 4.0, 1.0), (9.0, 0.0, 0.0)]
        {
            let [open, _] = track.over([time; 2]);
            let wanted = Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), Vec3::X * x);
            assert!(open.abs_diff_eq(wanted, 1e-5), "{time}: {open:?}");
        }
    }

    #[test]
    fn a_looped_motion_begins_again_but_never_runs_backwards_within_a_shutter() {
        let track = track(Ease::Loop);
        assert!(track.over([4.0; 2])[0].abs_diff_eq(track.over([1.0; 2])[0], 1e-5));
        let [_, close] = track.over([2.9, 3.2]);
        assert!(close.abs_diff_eq(track.at(3.0), 1e-6));
    }

    #[test]
    fn keyframes_whose_times_do_not_rise_are_refused() {
        assert!(Track::new(&[key(1.0, 0.0, 0.0), key(1.0, 1.0, 0.0)], Ease::Hold).is_err());
    }
}
