//! Animations.

use halflight_file::LoadError;

use super::accessor::Document;
use super::json::AnimationSampler;
use super::scene::Order;
use crate::mesh::MAX_COORDINATE;
use crate::model::{
    Interpolation, Model, ModelAnimation, ModelChannel, ModelProperty, ModelTrack, Placement,
};

/// Fills in the animations; nodes and meshes are there already.
pub(super) fn read(model: &mut Model, order: &Order, file: &Document) -> Result<(), LoadError> {
    for (index, animation) in file.root.animations.iter().enumerate() {
        let mut converted = ModelAnimation { name: animation.name.clone(), ..ModelAnimation::default() };
        for (number, channel) in animation.channels.iter().enumerate() {
            let who = format!("animation {index}, channel {number}");
            // A channel without a node is for extensions.
            let Some(node) = channel.target.node else { continue };
            let node = *file.get(&order.new_index, node, "node", &who)?;
            let sampler = file.get(&animation.samplers, channel.sampler, "sampler", &who)?;
            let property = match channel.target.path.as_str() {
                "translation" => ModelProperty::Translation,
                "rotation" => ModelProperty::Rotation,
                "scale" => ModelProperty::Scale,
                "weights" => ModelProperty::MorphWeights,
                other => {
                    let other = other.escape_debug();
                    model
                        .warnings
                        .push(format!("{who} moves `{other}`, which is not known, and was left out"));
                    continue;
                }
            };
            let Some(track) = read_track(sampler, property, &who, file)? else {
                model.warnings.push(format!("{who} has no keys and was left out"));
                continue;
            };
            if property == ModelProperty::MorphWeights {
                check_targets(model, node, track.width, &who, file)?;
            }
            take_apart(&mut model.nodes[node].placement);
            converted.duration = converted.duration.max(track.times.last().copied().unwrap_or(0.0));
            converted.channels.push(ModelChannel { node, property, track });
        }
        model.animations.push(converted);
    }
    Ok(())
}

fn read_track(
    sampler: &AnimationSampler,
    property: ModelProperty,
    who: &str,
    file: &Document,
) -> Result<Option<ModelTrack>, LoadError> {
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(other) => {
            return Err(
                file.error(format!("{who}: the interpolation `{}` is not known", other.escape_debug()))
            );
        }
    };
    let times: Vec<f32> = file.floats::<1>(sampler.input, who)?.into_iter().flatten().collect();
    if times.is_empty() {
        return Ok(None);
    }
    if let Some(i) = times.windows(2).position(|pair| pair[1] < pair[0]) {
        return Err(file.error(format!("{who}: time runs backwards from {} to {}", times[i], times[i + 1])));
    }
    let values: Vec<f32> = match property {
        ModelProperty::Translation | ModelProperty::Scale => {
            file.floats::<3>(sampler.output, who)?.into_iter().flatten().collect()
        }
        ModelProperty::Rotation => file.floats::<4>(sampler.output, who)?.into_iter().flatten().collect(),
        ModelProperty::MorphWeights => file.floats::<1>(sampler.output, who)?.into_iter().flatten().collect(),
    };
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let width = match property {
        ModelProperty::Translation | ModelProperty::Scale => 3,
        ModelProperty::Rotation => 4,
        ModelProperty::MorphWeights => values.len() / (parts * times.len()),
    };
    if width == 0 || values.len() != parts * times.len() * width {
        let found = format!("{who}: {} times do not go with {} numbers of values", times.len(), values.len());
        return Err(file.error(found));
    }
    if let Some(value) = values.iter().find(|value| value.abs() > MAX_COORDINATE) {
        return Err(file.error(format!("{who}: the value {value} is further out than {MAX_COORDINATE:e}")));
    }
    Ok(Some(ModelTrack { interpolation, times, width, values }))
}

/// The meshes of a node whose weights are animated must have as many targets.
fn check_targets(
    model: &Model,
    node: usize,
    width: usize,
    who: &str,
    file: &Document,
) -> Result<(), LoadError> {
    let targets = model.nodes[node].meshes.iter().map(|&mesh| model.meshes[mesh].morphs.len());
    match targets.max() {
        Some(targets) if targets != width => {
            Err(file.error(format!("{who} moves {width} weights, but the mesh has {targets} morph targets")))
        }
        _ => Ok(()),
    }
}

/// A matrix becomes parts, so that they can be moved one by one.
fn take_apart(placement: &mut Placement) {
    if let Placement::Matrix(matrix) = *placement {
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        let parts = Placement::Parts { translation, rotation, scale };
        if parts.to_affine().is_finite() {
            *placement = parts;
        }
    }
}
