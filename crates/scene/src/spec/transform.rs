//! `transform` and `keyframes`: where things stand, and how they move.

use glam::{Affine3A, Mat3, Mat4, Quat, Vec3};

use crate::schema::{At, Kind, Problem, ReadValue, Reader, Value};
use crate::{choices, record};

/// One number, or one for each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale(pub Vec3);

impl ReadValue for Scale {
    fn expected() -> String {
        "a number other than 0, or three of them".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let scale = match &value.kind {
            Kind::Integer(_) | Kind::Float(_) => Vec3::splat(f32::read_value(value, reader)?),
            Kind::List(items) if items.len() == 3 => Vec3::read_value(value, reader)?,
            _ => {
                reader.mistaken(value, &Self::expected());
                return None;
            }
        };
        // Below and above these a determinant under- or overflows.
        if scale.abs().min_element() < 1e-9 || scale.abs().max_element() > 1e9 {
            reader.report(
                Problem::new(&value.origin, "a scale must be between 1e-9 and 1e9 in size")
                    .help("a scale of 0 would flatten the shape to nothing"),
            );
            return None;
        }
        Some(Self(scale))
    }
    fn written(&self) -> String {
        if self.0 == Vec3::splat(self.0.x) { self.0.x.written() } else { self.0.written() }
    }
}

/// A rotation: `[x, y, z]` about these axes in turn, or `{ axis, angle }`, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation(pub Quat);

record! {
    /// A rotation about an axis through the origin, counter-clockwise when the axis points at the viewer.
    pub struct AxisAngle, "an axis and an angle" {
        /// The axis, of any length above 0.
        #[example = "[0, 1, 0]"]
        axis: At<Vec3>,
        /// The angle.
        #[unit = "degrees"]
        #[example = "45"]
        angle: f32,
    }
}

impl ReadValue for Rotation {
    fn expected() -> String {
        "`[x, y, z]` degrees about the x, then the y, then the z axis, or `{ axis = [x, y, z], angle = degrees }`".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        match &value.kind {
            Kind::List(items) if items.len() == 3 => {
                let angles = Vec3::read_value(value, reader)?.as_dvec3();
                let [x, y, z] = angles.to_array().map(|a| (a % 360.0).to_radians() as f32);
                Some(Self(Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x)))
            }
            Kind::Table(_) => {
                let turn = AxisAngle::read_value(value, reader)?;
                match turn.axis.try_normalize() {
                    Some(axis) => {
                        let angle = (f64::from(turn.angle) % 360.0).to_radians() as f32;
                        Some(Self(Quat::from_axis_angle(axis, angle)))
                    }
                    None => {
                        reader.report(
                            Problem::new(&turn.axis.origin, "this axis points nowhere")
                                .help("give it a length above 0"),
                        );
                        None
                    }
                }
            }
            _ => {
                reader.mistaken(value, &Self::expected());
                None
            }
        }
    }
}

/// A 3 × 4 or 4 × 4 matrix, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixRows(pub Affine3A);

impl ReadValue for MatrixRows {
    fn expected() -> String {
        "three or four rows of four numbers".into()
    }
    fn read_value(value: &Value, reader: &mut Reader) -> Option<Self> {
        let Kind::List(items) = &value.kind else {
            reader.mistaken(value, &Self::expected());
            return None;
        };
        if !matches!(items.len(), 3 | 4) {
            reader.mistaken(value, &Self::expected());
            return None;
        }
        let mut rows = [[0.0_f32; 4], [0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, 1.0]];
        for (row, item) in rows.iter_mut().zip(items) {
            *row = <[f32; 4]>::read_value(item, reader)?;
        }
        if rows[3] != [0.0, 0.0, 0.0, 1.0] {
            reader.report(Problem::new(&value.origin, "the last row of a transform must be 0, 0, 0, 1"));
            return None;
        }
        let matrix = Affine3A::from_mat4(Mat4::from_cols_array_2d(&rows).transpose());
        let determinant = Mat3::from(matrix.matrix3).as_dmat3().determinant();
        if determinant == 0.0
            || !determinant.is_finite()
            || determinant.abs() > 1e27
            || determinant.abs() < 1e-27
        {
            reader.report(Problem::new(
                &value.origin,
                "this matrix flattens or blows up what it is applied to",
            ));
            return None;
        }
        Some(Self(matrix))
    }
}

record! {
    /// From a shape's own space to the world: scaled first, then rotated, then moved; or by a matrix.
    pub struct TransformSpec, "transform" {
        /// Where the origin goes.
        #[unit = "metres"]
        #[example = "[0, 1, 0]"]
        translate: Vec3 = Vec3::ZERO,
        /// Degrees about the x axis, then the y axis, then the z axis; or an axis and an angle.
        #[unit = "degrees"]
        #[example = "[0, 45, 0]"]
        rotate_degrees: Option<Rotation>,
        /// Factor for all axes, or one for each; negative mirrors.
        #[example = "10"]
        scale: Option<Scale>,
        /// Instead of the other keys: the rows of a 3 × 4 or 4 × 4 matrix that multiplies column vectors.
        #[example = "[[10, 0, 0, 0.2], [0, 10, 0, -0.3], [0, 0, 10, 0]]"]
        matrix: Option<At<MatrixRows>>,
    }
}

impl TransformSpec {
    /// The transform, or a problem if it says a matrix and something else.
    pub fn resolve(&self) -> Result<Affine3A, Problem> {
        let Some(matrix) = &self.matrix else {
            let rotation = self.rotate_degrees.map_or(Quat::IDENTITY, |r| r.0);
            let scale = self.scale.map_or(Vec3::ONE, |s| s.0);
            return Ok(Affine3A::from_scale_rotation_translation(scale, rotation, self.translate));
        };
        if self.translate != Vec3::ZERO || self.rotate_degrees.is_some() || self.scale.is_some() {
            let problem = Problem::new(
                &matrix.origin,
                "a transform is either a matrix or made of the other keys, not both",
            );
            return Err(problem.help("put the matrix alone, or leave it out"));
        }
        Ok(matrix.value.0)
    }
}

choices! {
    /// What happens after the last keyframe and before the first.
    pub enum Ease, "repetition" {
        /// The shape stays where the nearest keyframe puts it.
        "hold" => Hold,
        /// The motion begins again; the last keyframe should be like the first.
        "loop" => Loop,
    }
}

record! {
    /// Where a shape is at one time. Between keyframes places are mixed linearly, rotations along the shortest
    /// arc, scales linearly. Applied after the shape's `transform`.
    pub struct TransformKey, "a keyframe" {
        /// When.
        #[unit = "seconds"]
        #[example = "0.5"]
        time: f64,
        /// Where the origin goes.
        #[unit = "metres"]
        #[example = "[0, 1, 0]"]
        translate: Vec3 = Vec3::ZERO,
        /// As in `transform`; turns of more than half a turn need a keyframe in between.
        #[unit = "degrees"]
        #[example = "[0, 90, 0]"]
        rotate_degrees: Option<Rotation>,
        /// As in `transform`.
        #[example = "1.5"]
        scale: Option<Scale>,
    }
}
