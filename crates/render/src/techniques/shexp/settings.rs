//! The settings of `shexp`.

use halflight_scene::schema::{positive, within};
use halflight_scene::{choices, record};
use halflight_sh::ClosedForm;

choices! {
    /// How the logarithm of what a sphere leaves visible is had.
    pub enum BlockerLog, "logarithm of a blocker" {
        /// That of the projected visibility, tabulated by half-angle.
        "table" => Table,
        /// log ε times the projected blocker, with one `epsilon` for all.
        "closed-form" => ClosedForm,
        /// The same with the best ε of each half-angle.
        "closed-form-by-angle" => ClosedFormByAngle,
    }
}

choices! {
    /// How height fields and spheres are joined.
    pub enum Composition, "composition of shexp" {
        /// Visibility past the spheres times visibility past each field.
        "product" => Product,
        /// Fields are added to the logarithms of the spheres: one exponential for all, less exact.
        "logarithms" => Logarithms,
    }
}

choices! {
    /// How the exponential is worked out.
    pub enum ExponentialKind, "exponential of shexp" {
        /// Halvings, a polynomial of the second degree, squarings.
        "squaring" => Squaring,
        /// Optimal-linear after halvings, then squarings.
        "hybrid" => Hybrid,
        /// Optimal-linear alone: fast, and wrong where much is hidden.
        "linear" => Linear,
        /// The power series to the eighth degree, for study.
        "series" => Series,
        /// By eigen-decomposition: slow.
        "exact" => Exact,
    }
}

choices! {
    /// How a glossy lobe meets light and visibility.
    pub enum GlossyForm, "glossy shading of shexp" {
        /// By logarithms for exponents up to 4, by a triple product above.
        "auto" => Auto,
        /// The product of lobe and cosine, integrated with the product of light and visibility.
        "triple-product" => TripleProduct,
        /// The logarithms of lobe, cosine and visibility added, one exponential, integrated with the light.
        "logarithms" => Logarithms,
    }
}

record! {
    /// Spherical-harmonic exponentiation: soft shadows of sphere sets and height fields under an environment, for
    /// things that deform every frame.
    pub struct ShexpSettings, "[technique.shexp]" {
        /// Bands of the spherical harmonics, from 3 to 6. More are sharper and cost more.
        #[example = "4"]
        order: u32 = 4 => within(3.0, 6.0),
        /// Spheres that stand for each mesh as a blocker; 0 lets meshes throw no shadow.
        #[example = "100"]
        spheres: u32 = 50 => within(0.0, 4096.0),
        /// Pixels between the points where shadows are first worked out, along each axis, as a power of two; 1 works out every
        /// pixel.
        #[example = "1"]
        stride: u32 = 8 => within(1.0, 64.0),
        /// How far the irradiances at those points may differ, in parts of the unshadowed light, before more points are
        /// taken between them.
        #[example = "0.02"]
        tolerance: f32 = 0.1 => positive(),
        /// Whether blockers that overlap count less.
        #[example = "false"]
        attenuation: bool = true,
        /// The logarithm of what a sphere leaves visible.
        #[example = "\"closed-form\""]
        blocker: BlockerLog = BlockerLog::Table,
        /// ε of `blocker = "closed-form"`.
        #[example = "0.2"]
        epsilon: f32 = 0.25 => within(1e-4, 0.99),
        /// How height fields and spheres are joined.
        #[example = "\"logarithms\""]
        composition: Composition = Composition::Product,
        /// How the exponential is worked out.
        #[example = "\"exact\""]
        exponential: ExponentialKind = ExponentialKind::Squaring,
        /// How glossy lobes are integrated.
        #[example = "\"triple-product\""]
        glossy: GlossyForm = GlossyForm::Auto,
        /// Whether integrals below zero, which a few bands can give, become zero.
        #[example = "false"]
        clamp: bool = true,
        /// Half-angle under which a group of scattered spheres may be taken for one; 0 looks at each.
        #[unit = "degrees"]
        #[example = "0"]
        cut_degrees: f32 = 2.0 => within(0.0, 30.0),
    }
}

impl Copy for ShexpSettings {}

impl Default for ShexpSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Exponents up to which `glossy = "auto"` adds logarithms.
const MOST_BY_LOGARITHMS: f32 = 4.0;

impl ShexpSettings {
    /// The recommended settings.
    pub const DEFAULT: Self = Self {
        order: 4,
        spheres: 50,
        stride: 8,
        tolerance: 0.1,
        attenuation: true,
        blocker: BlockerLog::Table,
        epsilon: 0.25,
        composition: Composition::Product,
        exponential: ExponentialKind::Squaring,
        glossy: GlossyForm::Auto,
        clamp: true,
        cut_degrees: 2.0,
    };

    /// The closed form of a blocker's logarithm, if there is one.
    pub(super) fn closed_form(&self) -> Option<ClosedForm> {
        match self.blocker {
            BlockerLog::Table => None,
            BlockerLog::ClosedForm => Some(ClosedForm::Fixed { epsilon: f64::from(self.epsilon) }),
            BlockerLog::ClosedFormByAngle => Some(ClosedForm::ByAngle),
        }
    }

    /// The exponential of the crate of harmonics.
    pub(super) fn exponential(&self) -> halflight_sh::Exponential {
        use halflight_sh::Exponential;
        match self.exponential {
            ExponentialKind::Squaring => Exponential::default(),
            ExponentialKind::Hybrid => Exponential::LinearSquaring { threshold: 1.0 },
            ExponentialKind::Linear => Exponential::Linear,
            ExponentialKind::Series => Exponential::Series { degree: 8 },
            ExponentialKind::Exact => Exponential::Exact,
        }
    }

    /// The largest exponent of a lobe that is added as a logarithm.
    pub(super) fn most_by_logarithms(&self) -> f32 {
        match self.glossy {
            GlossyForm::Auto => MOST_BY_LOGARITHMS,
            GlossyForm::TripleProduct => -1.0,
            GlossyForm::Logarithms => f32::INFINITY,
        }
    }
}
