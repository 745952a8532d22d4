//! A transform over the shutter interval.

use glam::Affine3A;

/// A transform at the opening and at the closing of the shutter; between them it is interpolated component by
/// component, so that every point moves along a straight line at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// From geometry to world when the shutter opens (time 0).
    pub open: Affine3A,
    /// From geometry to world when the shutter closes (time 1).
    pub close: Affine3A,
}

impl Motion {
    /// Stays where it is.
    pub const IDENTITY: Motion = Motion { open: Affine3A::IDENTITY, close: Affine3A::IDENTITY };

    /// The same transform throughout.
    #[must_use]
    pub fn fixed(transform: Affine3A) -> Motion {
        Motion { open: transform, close: transform }
    }

    /// From one transform to another.
    #[must_use]
    pub fn between(open: Affine3A, close: Affine3A) -> Motion {
        Motion { open, close }
    }

    /// Whether the two ends differ.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.open != self.close
    }

    /// The transform at a time from 0 to 1; exact at both ends.
    #[inline]
    #[must_use]
    pub fn at(&self, time: f32) -> Affine3A {
        let time = time.clamp(0.0, 1.0);
        let before = 1.0 - time;
        Affine3A {
            matrix3: self.open.matrix3 * before + self.close.matrix3 * time,
            translation: self.open.translation * before + self.close.translation * time,
        }
    }
}

impl From<Affine3A> for Motion {
    fn from(transform: Affine3A) -> Motion {
        Motion::fixed(transform)
    }
}
