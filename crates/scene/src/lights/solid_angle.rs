//! Uniform sampling of the solid angle of a rectangle.
//!
//! Source: Ureña, Fajardo, King, *An Area-Preserving Parametrization for Spherical Rectangles*, EGSR 2013.

use glam::{Affine3A, DVec3, Vec2, Vec3};

/// Least solid angle drawn this way: below it the angles are lost to rounding and area sampling is as good.
const MIN_SOLID_ANGLE: f64 = 1e-3;

/// The square [−1, 1]² of a transform's xy-plane as seen from a point. In f64, as its angles are differences of nearly
/// equal numbers.
pub(super) struct SphericalRectangle {
    from: DVec3,
    axes: [DVec3; 3],
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    b: [f64; 2],
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// `None` where the transform shears the square, or where it is seen under too small an angle.
    pub(super) fn seen_from(pose: &Affine3A, from: Vec3) -> Option<Self> {
        let [ex, ey] = [pose.matrix3.x_axis, pose.matrix3.y_axis].map(|a| Vec3::from(a).as_dvec3());
        let (width, height) = (ex.length(), ey.length());
        if ex.dot(ey).abs() > 1e-5 * width * height || width == 0.0 || height == 0.0 {
            return None;
        }
        let from = from.as_dvec3();
        let corner = Vec3::from(pose.translation).as_dvec3() - ex - ey;
        let (ex, ey) = (ex / width, ey / height);
        let mut ez = ex.cross(ey);
        let d = corner - from;
        let mut z = d.dot(ez);
        // The rectangle lies at negative z of the local frame.
        if z > 0.0 {
            ez = -ez;
            z = -z;
        }
        let (x0, y0) = (d.dot(ex), d.dot(ey));
        let (x1, y1) = (x0 + 2.0 * width, y0 + 2.0 * height);
        if z > -1e-6 * (width + height) {
            return None;
        }
        // Normals of the four planes through the point and an edge; only one component of each is not trivial.
        let n = [-y0 / y0.hypot(z), x1 / x1.hypot(z), y1 / y1.hypot(z), -x0 / x0.hypot(z)];
        let angle = |a: f64, b: f64| (-a * b).clamp(-1.0, 1.0).acos();
        let g = [angle(n[0], n[1]), angle(n[1], n[2]), angle(n[2], n[3]), angle(n[3], n[0])];
        let k = std::f64::consts::TAU - g[2] - g[3];
        let solid_angle = g[0] + g[1] - k;
        (solid_angle > MIN_SOLID_ANGLE).then_some(Self {
            from,
            axes: [ex, ey, ez],
            x: [x0, x1],
            y: [y0, y1],
            z,
            b: [n[0], n[2]],
            k,
            solid_angle,
        })
    }

    pub(super) fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// A point of the rectangle in the world and on the square.
    pub(super) fn sample(&self, u: Vec2) -> Option<(Vec3, Vec2)> {
        let au = f64::from(u.x) * self.solid_angle + self.k;
        let (sin, cos) = au.sin_cos();
        let fu = (cos * self.b[0] - self.b[1]) / sin;
        let cu = (fu.signum() / (fu * fu + self.b[0] * self.b[0]).sqrt()).clamp(-1.0, 1.0);
        let x = (-(cu * self.z) / (1.0 - cu * cu).max(1e-300).sqrt()).clamp(self.x[0], self.x[1]);
        let d = x.hypot(self.z);
        let h0 = self.y[0] / self.y[0].hypot(d);
        let h1 = self.y[1] / self.y[1].hypot(d);
        let h = h0 + f64::from(u.y) * (h1 - h0);
        let y = if h * h < 1.0 - 1e-12 { h * d / (1.0 - h * h).sqrt() } else { self.y[1] };
        let y = y.clamp(self.y[0], self.y[1]);
        let point = self.from + x * self.axes[0] + y * self.axes[1] + self.z * self.axes[2];
        let share = |v: f64, range: [f64; 2]| (2.0 * (v - range[0]) / (range[1] - range[0]) - 1.0) as f32;
        let local = Vec2::new(share(x, self.x), share(y, self.y));
        point.is_finite().then_some((point.as_vec3(), local))
    }
}
