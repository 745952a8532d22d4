//! What the events of a path do, each by its definition in the primal domain.
//!
//! All take and give a value, so that chains read from left to right as light goes: `light.travel(2.0).arrive(0.8)`. Lengths
//! and frequencies of time follow the units that the caller has chosen; the tests use metres, radians, seconds.

use super::matrix::{Covariance, FOUR_PI_SQUARED, bounded};

/// Least cosine that is divided by: 0.06 degrees above the horizon.
pub(crate) const GRAZING: f64 = 1e-3;

/// A smooth interface between two media that light passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Index of refraction where light comes from and where it goes.
    pub indices: [f64; 2],
    /// Cosine of incidence.
    pub cos_in: f64,
}

impl Interface {
    /// Cosine of the refracted ray; `None` beyond the critical angle, or for indices that are not positive.
    #[must_use]
    pub fn cos_out(&self) -> Option<f64> {
        let [from, to] = self.indices;
        if !(from > 0.0 && to > 0.0 && from.is_finite() && to.is_finite()) {
            return None;
        }
        let sin = from / to * (1.0 - self.cos_in * self.cos_in).max(0.0).sqrt();
        (sin < 1.0).then(|| (1.0 - sin * sin).sqrt())
    }

    /// The variance of the window that the critical angle is, in radians² of the ray that leaves it: light comes from no
    /// further than the incident horizon or the critical angle, whichever is nearer, half of the way to it being one
    /// standard deviation. `None` where nothing cuts.
    #[must_use]
    pub fn critical_window(&self) -> Option<f64> {
        let [from, to] = self.indices;
        let cos_out = self.cos_out()?;
        // Into the thinner medium light arrives only from within asin(to/from); into the denser one it leaves within it.
        let critical = if from > to { to / from } else { from / to };
        let (sin, inside) = if from > to {
            ((1.0 - self.cos_in * self.cos_in).max(0.0).sqrt(), true)
        } else {
            ((1.0 - cos_out * cos_out).max(0.0).sqrt(), false)
        };
        if critical >= 1.0 {
            return None;
        }
        let margin = (critical.asin() - sin.min(critical).asin()).max(1e-6);
        // Told of the ray that leaves: angles grow by the inverse of g.
        let margin = if inside {
            margin * from * self.cos_in.max(GRAZING) / (to * cos_out.max(GRAZING))
        } else {
            margin
        };
        Some(0.25 * margin * margin)
    }
}

/// A thick lens, seen from where light comes: two spherical surfaces with glass in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Curvature of the first and the second surface in 1/m, each positive if convex from outside.
    pub curvatures: [f64; 2],
    /// Distance between them along the axis, metres.
    pub thickness: f64,
    /// Index of refraction of the glass, beside air.
    pub index: f64,
}

impl<const N: usize> Covariance<N> {
    const U: usize = N / 2;

    /// Travel over `distance` metres: l₁(x, u) = l₀(x + d u, u). `[003]` Travel, exact.
    #[inline]
    #[must_use]
    pub fn travel(mut self, distance: f64) -> Self {
        for axis in 0..Self::SPACE {
            self = self.sheared(axis, Self::U + axis, distance);
        }
        self
    }

    /// Other axes across the ray: the new first axis lies at `angle` from the old one towards the second. Nothing in the
    /// plane.
    #[inline]
    #[must_use]
    pub fn rotate(self, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        self.rotate_by(cos, sin)
    }

    /// [`Covariance::rotate`] by cosine and sine of the angle.
    #[inline]
    #[must_use]
    pub fn rotate_by(mut self, cos: f64, sin: f64) -> Self {
        if Self::SPACE < 2 {
            return self;
        }
        for first in [0, Self::U] {
            // Old coordinates of a new point: x = cos x' − sin y', y = sin x' + cos y'.
            for j in 0..N {
                let (a, b) = (self.rows[first][j], self.rows[first + 1][j]);
                (self.rows[first][j], self.rows[first + 1][j]) = (cos * a + sin * b, cos * b - sin * a);
            }
            for i in 0..N {
                let (a, b) = (self.rows[i][first], self.rows[i][first + 1]);
                (self.rows[i][first], self.rows[i][first + 1]) = (cos * a + sin * b, cos * b - sin * a);
            }
        }
        self
    }

    /// From across the ray onto a surface that it meets at this cosine, first axis in the plane of incidence:
    /// l₁(x, u) = l₀(x cos θ, u). Left out by `[003]`.
    #[inline]
    #[must_use]
    pub fn arrive(self, cos: f64) -> Self {
        self.scaled(0, cos.abs())
    }

    /// From a surface to across a ray that leaves it at this cosine: l₁(x, u) = l₀(x / cos θ, u).
    #[inline]
    #[must_use]
    pub fn leave(self, cos: f64) -> Self {
        self.scaled(0, 1.0 / cos.abs().max(GRAZING))
    }

    /// From a plane to the rotating frame of a curved surface, or back on the side of reflection: l₁(x, u) = l₀(x, u + K x).
    /// `curvature` is [K_xx, K_xy, K_yy] in 1/m on axes with the first in the plane of incidence; across the plane normals
    /// turn rays by cos θ less. To go on through the surface, give −K. `[003]` Curvature: k is 1/radius, not a radius.
    #[inline]
    #[must_use]
    pub fn curve(self, [k_xx, k_xy, k_yy]: [f64; 3], cos: f64) -> Self {
        let result = self.sheared(Self::U, 0, k_xx);
        if Self::SPACE < 2 {
            return result;
        }
        let cos = cos.abs();
        result.sheared(Self::U, 1, k_xy).sheared(Self::U + 1, 0, cos * k_xy).sheared(
            Self::U + 1,
            1,
            cos * k_yy,
        )
    }

    /// Curvature given by principal curvatures and the angle of the first one's direction from the first axis.
    #[must_use]
    pub fn curve_principal(self, [first, second]: [f64; 2], angle: f64, cos: f64) -> Self {
        let (sin, cosine) = angle.sin_cos();
        let (c, s) = (cosine * cosine, sin * sin);
        self.curve([first * c + second * s, (first - second) * sin * cosine, first * s + second * c], cos)
    }

    /// Something in the way that leaves an opening of this radius, in every direction across the ray: a Gaussian window
    /// whose standard deviation is half of it, as a disc of that radius has. `[003]` Visibility: an edge itself has no limit.
    #[inline]
    #[must_use]
    pub fn occlude(mut self, radius: f64) -> Self {
        for axis in 0..Self::SPACE {
            self = self.windowed(axis, 0.25 * radius * radius);
        }
        self
    }

    /// An edge whose normal across the ray is (cos, sin) of `angle`, at this distance.
    #[must_use]
    pub fn occlude_towards(self, angle: f64, distance: f64) -> Self {
        let mut e = [0.0; N];
        if Self::SPACE < 2 {
            e[0] = 1.0;
        } else {
            (e[1], e[0]) = angle.sin_cos();
        }
        self.multiplied(&e, 1.0 / (FOUR_PI_SQUARED * distance * distance))
    }

    /// Multiplication by a texture, given its own covariance [xx, xy, yy] on the surface in cycles²/m².
    #[inline]
    #[must_use]
    pub fn texture(mut self, [xx, xy, yy]: [f64; 3]) -> Self {
        self.rows[0][0] = bounded(self.rows[0][0] + xx.max(0.0));
        if Self::SPACE > 1 {
            let most = (xx.max(0.0) * yy.max(0.0)).sqrt();
            let xy = xy.clamp(-most, most);
            self.rows[1][1] = bounded(self.rows[1][1] + yy.max(0.0));
            (self.rows[0][1], self.rows[1][0]) = (self.rows[0][1] + xy, self.rows[1][0] + xy);
        }
        self
    }

    /// Multiplication by the cosine of incidence. About θ it is exp(−½ (u/σ)²) to second order with σ = cos θ in the plane
    /// (−d² ln cos θ = 1/cos² θ) and σ⁻² = 1 across it (ln cos of a ray that leans out by v falls by v²/2).
    #[inline]
    #[must_use]
    pub fn cosine(self, cos: f64) -> Self {
        let cos = cos.abs().max(GRAZING);
        let result = self.windowed(Self::U, cos * cos);
        if Self::SPACE < 2 { result } else { result.windowed(Self::U + 1, 1.0) }
    }

    /// Blur in angle by a lobe of covariance [uu, uv, vv] in radians², about the mirrored direction:
    /// (Σ⁻¹ + 4π² B)⁻¹ on the angles. `[003]` Reflection: its b is 4π² r² (8π² r² for moments of |l̂|²), not a cut-off.
    #[inline]
    #[must_use]
    pub fn reflect(self, [uu, uv, vv]: [f64; 3]) -> Self {
        let mut e = [0.0; N];
        if Self::SPACE < 2 {
            return self.blurred_along(Self::U, uu);
        }
        if !(uu.is_finite() && vv.is_finite()) {
            // Without limit: nothing is left of the angles.
            let first =
                if uu.is_finite() { self.blurred_along(Self::U, uu) } else { self.integrated(Self::U) };
            return if vv.is_finite() {
                first.blurred_along(Self::U + 1, vv)
            } else {
                first.integrated(Self::U + 1)
            };
        }
        // Principal axes of the lobe, one after the other: blurs along different directions commute.
        let angle = 0.5 * (2.0 * uv).atan2(uu - vv);
        let (sin, cos) = angle.sin_cos();
        let (mean, half) = (0.5 * (uu + vv), (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt());
        (e[Self::U], e[Self::U + 1]) = (cos, sin);
        let first = self.blurred(&e, (mean + half).max(0.0));
        (e[Self::U], e[Self::U + 1]) = (-sin, cos);
        first.blurred(&e, (mean - half).max(0.0))
    }

    /// Through a smooth interface, on the surface's own axes: l₁(x, u, v) = l₀(x, g u, (n₂/n₁) v) with
    /// g = n₂ cos θ_t/(n₁ cos θ_i), and the critical angle as a window. `None` beyond it. `[003]` prints 1/g.
    #[must_use]
    pub fn refract(self, interface: &Interface) -> Option<Self> {
        let result = self.refract_without_window(interface)?;
        let Some(window) = interface.critical_window() else { return Some(result) };
        Some(result.windowed(Self::U, window))
    }

    /// Snell's law alone, to first order.
    #[must_use]
    pub fn refract_without_window(self, interface: &Interface) -> Option<Self> {
        let cos_out = interface.cos_out()?;
        let index = interface.indices[1] / interface.indices[0];
        let g = index * cos_out / interface.cos_in.abs().max(GRAZING);
        let result = self.scaled(Self::U, g);
        Some(if Self::SPACE < 2 { result } else { result.scaled(Self::U + 1, index) })
    }

    /// A rough interface: Snell's law, then a blur by the lobe that the microfacets' slopes of variance `slope` (per axis)
    /// make of one direction. A normal that leans by δ turns the refracted ray by δ (g' − 1) with g' = n₁ cos θ_i/(n₂ cos θ_t)
    /// in the plane, and by δ (n₁ cos θ_i − n₂ cos θ_t)/n₂ across it.
    #[must_use]
    pub fn refract_rough(self, interface: &Interface, slope: f64) -> Option<Self> {
        let cos_out = interface.cos_out()?;
        let [from, to] = interface.indices;
        let in_plane = from * interface.cos_in / (to * cos_out.max(GRAZING)) - 1.0;
        let across = (from * interface.cos_in - to * cos_out) / to;
        let smooth = self.refract(interface)?;
        Some(smooth.reflect([slope * in_plane * in_plane, 0.0, slope * across * across]))
    }

    /// A thin lens of focal length f: l₁(x, u) = l₀(x, u − x/f). Infinity is no lens; a length of zero, which no lens has, is
    /// the shortest that makes sense. `[003]` prints f for −1/f and exchanges the shapes of lens and travel.
    #[inline]
    #[must_use]
    pub fn thin_lens(mut self, focal_length: f64) -> Self {
        let power =
            if focal_length.abs() < 1e-9 { 1e9f64.copysign(focal_length) } else { 1.0 / focal_length };
        if !power.is_finite() {
            return self;
        }
        for axis in 0..Self::SPACE {
            self = self.sheared(Self::U + axis, axis, -power);
        }
        self
    }

    /// A thick lens on its axis: curvature, refraction, travel within, and the same on the other side. `None` for an index
    /// that is not positive.
    #[must_use]
    pub fn thick_lens(self, lens: &Lens) -> Option<Self> {
        let [first, second] = lens.curvatures.map(|k| [k, 0.0, k]);
        let back = |k: [f64; 3]| k.map(|k| -k);
        let into = Interface { indices: [1.0, lens.index], cos_in: 1.0 };
        let out = Interface { indices: [lens.index, 1.0], cos_in: 1.0 };
        let inside = self.curve(first, 1.0).refract_without_window(&into)?.curve(back(first), 1.0);
        let inside = inside.travel(lens.thickness);
        // From within the second surface bulges away.
        Some(inside.curve(back(second), 1.0).refract_without_window(&out)?.curve(second, 1.0))
    }

    /// Into the frame of something that moves by `velocity` across the ray and turns the ray by `turning` per unit of time:
    /// l₁(x, u, t) = l₀(x + v t, u + w t, t). In the plane the second components are left out.
    ///
    /// # Panics
    /// Never; without a dimension of time nothing changes.
    #[inline]
    #[must_use]
    pub fn into_motion(mut self, velocity: [f64; 2], turning: [f64; 2]) -> Self {
        let Some(time) = Self::time() else { return self };
        for axis in 0..Self::SPACE {
            self = self.sheared(axis, time, velocity[axis]).sheared(Self::U + axis, time, turning[axis]);
        }
        self
    }

    /// Back from the frame of [`Covariance::into_motion`]: the inverse change of variables. `[003]` transposes where it has to
    /// invert.
    #[inline]
    #[must_use]
    pub fn out_of_motion(self, velocity: [f64; 2], turning: [f64; 2]) -> Self {
        self.into_motion(velocity.map(|v| -v), turning.map(|w| -w))
    }

    /// An edge that moves across the ray: Σ + o (1, 0, −v)(1, 0, −v)ᵀ.
    #[must_use]
    pub fn occlude_moving(self, radius: f64, velocity: [f64; 2]) -> Self {
        self.into_motion(velocity, [0.0; 2]).occlude(radius).out_of_motion(velocity, [0.0; 2])
    }

    /// Absorption whose optical depth across the ray has the second derivatives [xx, xy, yy] in 1/m²: a window
    /// exp(−½ xᵀ H x). Depth that lessens to the sides (H < 0) is a window from the other side: |H|.
    #[must_use]
    pub fn absorb(self, [xx, xy, yy]: [f64; 3]) -> Self {
        if Self::SPACE < 2 {
            return self.texture([xx.abs() / FOUR_PI_SQUARED, 0.0, 0.0]);
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
        let (a, b) = ((mean + half).abs() / FOUR_PI_SQUARED, (mean - half).abs() / FOUR_PI_SQUARED);
        let (sin, cos) = angle.sin_cos();
        self.texture([a * cos * cos + b * sin * sin, (a - b) * sin * cos, a * sin * sin + b * cos * cos])
    }

    /// Scattering in a medium by the angle whose cosine this is, first axis in the plane of the two directions: positions
    /// are seen foreshortened across the new ray, what varied along the old ray's other axis is integrated away, and angles
    /// are blurred by the phase function's variance. `[003]` Scattering: a projection without curvature, then a lobe.
    #[must_use]
    pub fn scatter(self, cos: f64, variance: f64) -> Self {
        self.arrive(cos).reflect([variance, 0.0, variance])
    }
}
