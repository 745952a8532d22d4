//! A path's bandwidth step by step, for people who ask why a pixel was shaded.

use std::fmt;

use super::operators::{Bandwidth, GRAZING};

/// One event on the way from light to eye, with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operator {
    /// The light itself.
    Light,
    /// T_d over so many metres.
    Travel(f32),
    /// P_i at this cosine.
    Incidence(f32),
    /// C by this curvature in 1/m (a reflection on a convex surface has it negative).
    Curvature(f32),
    /// B: the lobe's cycles/rad, the texture's cycles/m, and the share k of the line that was kept.
    Reflection {
        /// ρ, cycles/rad.
        lobe: f32,
        /// t, cycles/m.
        texture: f32,
        /// min(1, ρ/|ν_a|).
        kept: f32,
    },
    /// P_x at this cosine.
    Exit(f32),
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Light => write!(f, "light"),
            Self::Travel(distance) => write!(f, "travel {distance:.4} m"),
            Self::Incidence(cosine) => write!(f, "incidence cos {cosine:.4}"),
            Self::Curvature(curvature) => write!(f, "curvature {curvature:.4} 1/m"),
            Self::Reflection { lobe, texture, kept } => {
                write!(
                    f,
                    "reflection lobe {lobe:.4} /rad, texture {texture:.4} /m, keeps {:.1} %",
                    kept * 100.0
                )
            }
            Self::Exit(cosine) => write!(f, "exit cos {cosine:.4}"),
        }
    }
}

/// An event and the bandwidth after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// What happened.
    pub operator: Operator,
    /// The light's line after it, with signs.
    pub line: Bandwidth,
    /// What textures have added by then, as a line of its own.
    pub texture: Bandwidth,
}

impl Step {
    /// The bounds after this step: the sum of the two magnitudes.
    #[must_use]
    pub fn bandwidth(&self) -> Bandwidth {
        (self.line.magnitude() + self.texture.magnitude()).magnitude()
    }
}

/// A path from a light on, of any number of bounces, which remembers its steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    steps: Vec<Step>,
}

impl Chain {
    /// At the light: [`Bandwidth::distant`] or [`Bandwidth::local`].
    #[must_use]
    pub fn new(light: Bandwidth) -> Self {
        Self { steps: vec![Step { operator: Operator::Light, line: light, texture: Bandwidth::default() }] }
    }

    /// The steps, the light first.
    #[must_use]
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The bounds after the last step.
    #[must_use]
    pub fn bandwidth(&self) -> Bandwidth {
        self.last().bandwidth()
    }

    fn last(&self) -> Step {
        self.steps[self.steps.len() - 1]
    }

    fn then(mut self, operator: Operator, apply: impl Fn(Bandwidth) -> Bandwidth) -> Self {
        let last = self.last();
        self.steps.push(Step { operator, line: apply(last.line), texture: apply(last.texture) });
        self
    }

    /// T_d.
    #[must_use]
    pub fn travel(self, distance: f32) -> Self {
        self.then(Operator::Travel(distance), |b| b.travel(distance))
    }

    /// P_i C_-c B C_-c P_x: a whole reflection off a surface of `curvature` (convex > 0).
    #[must_use]
    pub fn reflect(self, cos_incidence: f32, curvature: f32, texture: f32, lobe: f32, cos_exit: f32) -> Self {
        let mut chain = self
            .then(Operator::Incidence(cos_incidence), |b| b.incidence(cos_incidence))
            .then(Operator::Curvature(-curvature), |b| b.curvature(-curvature));
        let last = chain.last();
        let kept = last.line.kept(lobe);
        let added = last.texture.band_limit(lobe);
        chain.steps.push(Step {
            operator: Operator::Reflection { lobe, texture, kept },
            line: last.line * kept,
            texture: Bandwidth { spatial: added.spatial + texture.copysign(added.spatial), ..added },
        });
        let cos_exit = cos_exit.max(GRAZING);
        chain
            .then(Operator::Curvature(-curvature), |b| b.curvature(-curvature))
            .then(Operator::Exit(cos_exit), |b| b.exit(cos_exit))
    }
}

impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            let bound = step.bandwidth();
            let operator = step.operator.to_string();
            writeln!(f, "{operator:<60} {:>12.4} /m {:>12.4} /rad", bound.spatial, bound.angular)?;
        }
        Ok(())
    }
}
