//! Materials of two others, `type = "mix"`.
//!
//! Parts may be declared before or after the mix; those who end in themselves, or go too deep, are told so.

use std::collections::HashMap;
use std::sync::Arc;

use halflight_image::Texels;
use halflight_material::{Material, MaterialKind, ScalarInput};

use super::Builder;
use super::materials::no_such_material;
use crate::schema::{At, Origin, Problem};
use crate::spec::{MaterialKindSpec, MaterialReference, MaterialSpec, MixSpec, ScalarSetting};

/// Mixes in mixes: a point asks up to 2⁸ materials then.
const DEEPEST: usize = 8;
/// By how much a mask may leave 0 to 1, for pictures that were filtered.
const TOLERANCE: f32 = 1e-3;

/// What the scene declares, and what is made of it so far.
#[derive(Default)]
pub(crate) struct Mixing {
    pub(crate) declared: Arc<[(At<String>, MaterialSpec)]>,
    made: HashMap<String, Material>,
    /// The materials that are being made, each a part of the one before.
    underway: Vec<String>,
    depth: usize,
}

impl Builder {
    /// The `[material.NAME]` of that name, made once; `None`, with the reason reported, if there is none or it is made of
    /// itself.
    pub(crate) fn declared_material(&mut self, name: &At<String>) -> Option<Material> {
        if let Some(made) = self.mixing.made.get(&name.value) {
            return Some(made.clone());
        }
        if let Some(first) = self.mixing.underway.iter().position(|other| *other == name.value) {
            let way: Vec<String> = self.mixing.underway[first..]
                .iter()
                .chain([&name.value])
                .map(|material| format!("`{material}`"))
                .collect();
            let problem = Problem::new(
                &name.origin,
                format!("the mix `{}` is made of itself: {}", name.value, way.join(", of ")),
            );
            self.reader.report(problem);
            return None;
        }
        let declared = Arc::clone(&self.mixing.declared);
        let Some((_, spec)) = declared.iter().find(|(other, _)| other.value == name.value) else {
            let names = declared.iter().map(|(other, _)| other.value.as_str()).collect();
            self.reader.report(no_such_material(name, names));
            return None;
        };
        self.mixing.underway.push(name.value.clone());
        let material = self.material(&name.value, spec);
        self.mixing.underway.pop();
        self.mixing.made.insert(name.value.clone(), material.clone());
        Some(material)
    }

    /// How a mix scatters; black, with the reason reported, where that cannot be.
    pub(super) fn mix(&mut self, name: &str, spec: &MixSpec) -> MaterialKind {
        let mask = self.scalar(&spec.mask, 0);
        self.check_mask(&spec.mask, &mask);
        self.mixing.depth += 1;
        let parts = [(&spec.first, "first"), (&spec.second, "second")]
            .map(|(reference, key)| self.part(&format!("{name}: {key}"), reference));
        self.mixing.depth -= 1;
        match parts {
            [Some(first), Some(second)] => MaterialKind::Mix { parts: Arc::new([first, second]), mask },
            _ => MaterialKind::Black,
        }
    }

    fn part(&mut self, called: &str, reference: &MaterialReference) -> Option<Material> {
        let origin = match reference {
            MaterialReference::Named(name) => &name.origin,
            MaterialReference::Inline(spec) => &spec.origin,
        };
        // Before the part is made, so that it ends, and after, as it may have been made before.
        let too_deep = || {
            Problem::new(origin, format!("mixes of mixes go deeper here than {DEEPEST}, which is the most"))
        };
        if self.mixing.depth > DEEPEST {
            self.reader.report(too_deep());
            return None;
        }
        let (material, said) = match reference {
            MaterialReference::Named(name) => {
                let declared = Arc::clone(&self.mixing.declared);
                let found = declared.iter().find(|(other, _)| other.value == name.value);
                let said = found.and_then(|(_, spec)| beside_scattering(spec));
                (self.declared_material(name)?, said)
            }
            MaterialReference::Inline(spec) => (self.material(called, spec), beside_scattering(spec)),
        };
        if let Some(key) = said {
            self.refuse_part(origin, &material.name, key);
        }
        if depth(&material) >= DEEPEST {
            self.reader.report(too_deep());
            return None;
        }
        Some(material)
    }

    fn refuse_part(&mut self, origin: &Origin, name: &str, key: &str) {
        let problem = Problem::new(
            origin,
            format!("`{name}` is part of a mix, which takes only how its parts scatter, and has {key}"),
        );
        self.reader.report(problem.help("say it in the mix itself, or mix a material without it"));
    }

    /// Reports a picture that is no mask.
    fn check_mask(&mut self, setting: &ScalarSetting, mask: &ScalarInput) {
        let (ScalarSetting::Texture(spec), ScalarInput::Textured { texture, channel, factor }) =
            (setting, mask)
        else {
            return;
        };
        let wrong = match &texture.image.texels {
            Texels::Bytes(..) if (0.0..=1.0 + TOLERANCE).contains(factor) => return,
            // A byte may be 1.
            Texels::Bytes(..) => Some((0, *factor)),
            Texels::Floats(texels) => texels
                .iter()
                .map(|texel| texel[(*channel).min(3)] * factor)
                .enumerate()
                .find(|(_, value)| !(-TOLERANCE..=1.0 + TOLERANCE).contains(value)),
        };
        let Some((at, value)) = wrong else { return };
        let width = texture.image.width.max(1);
        let found = if matches!(texture.image.texels, Texels::Bytes(..)) {
            format!("the mask is multiplied by {value}")
        } else {
            format!("the mask is {value} in column {} and row {}", at % width, at / width)
        };
        let problem = Problem::new(&spec.file.origin, format!("{found}; masks go from 0 to 1"));
        self.reader.report(
            problem.help("`factor` multiplies the picture, `channel` says which number of it counts"),
        );
    }
}

/// How many mixes a material has in each other.
fn depth(material: &Material) -> usize {
    match &material.kind {
        MaterialKind::Mix { parts, .. } => 1 + parts.iter().map(depth).max().unwrap_or(0),
        _ => 0,
    }
}

/// What a material says that a mix does not take from its parts, if anything.
fn beside_scattering(spec: &MaterialSpec) -> Option<&'static str> {
    let common = &spec.common;
    if matches!(spec.kind, MaterialKindSpec::Emissive(_)) {
        return Some("a `radiance`");
    }
    [
        (common.emission.is_some(), "an `emission`"),
        (common.normal_map.is_some(), "a `normal_map`"),
        (common.opacity.is_some(), "an `opacity`"),
        (common.displacement.is_some(), "a `displacement`"),
    ]
    .into_iter()
    .find_map(|(is_said, key)| is_said.then_some(key))
}
