//! What the page shows beside the pictures.

use serde_json::{Value, json};

use super::Studio;
use crate::side::Shown;

impl Studio {
    /// Everything that the page shows beside the pictures.
    pub(super) fn state(&self) -> Value {
        let names =
            (0..self.posed.world.instances().len() as u32).map(|i| self.posed.shape_name(i).to_string());
        let mut shapes: Vec<String> = names.collect();
        shapes.dedup();
        shapes.truncate(200);
        let of = |side: &Shown| {
            let busy = side.busy().map(|(what, seconds)| json!({ "what": what, "seconds": seconds }));
            json!({
                "technique": side.name, "settings": side.settings, "busy": busy,
                "reference": side.reference.as_ref().map(|reference| &reference.name),
            })
        };
        let material = |(number, text): &(usize, String)| {
            let object = self.posed.objects.iter().find(|object| object.object == *number)?;
            Some(json!([self.posed.shape_name(object.instances.start), text]))
        };
        let reach = (self.posed.bounds.1 - self.posed.bounds.0).length();
        let own = self.eye.own;
        json!({
            "kind": "state",
            "scene": self.stage.name,
            "scenes": self.scenes,
            "environments": self.environments,
            "references": self.references,
            "environment": self.swap.environment,
            "has_environment": self.posed.lights.environment().is_some(),
            "materials": self.swap.materials.iter().filter_map(material).collect::<Vec<_>>(),
            "description": self.stage.scene.description(),
            "shapes": shapes,
            "moved": self.moved.iter().map(|(name, by)| json!([name, by.to_array()])).collect::<Vec<_>>(),
            "reach": if reach.is_finite() && reach > 0.0 { reach } else { 1.0 },
            "size": self.size,
            "seconds": self.seconds,
            "duration": self.stage.scene.duration(),
            "animated": self.stage.scene.is_animated(),
            "playing": self.playing.is_some(),
            "turn_degrees": self.turn_degrees,
            "exposure_ev": self.exposure_ev,
            "filmic": self.filmic,
            "follows": !(own.place || own.field_of_view || own.lens),
            "field_of_view_degrees": self.eye.vertical_fov(self.aspect()).to_degrees(),
            "aperture_radius": self.eye.camera.aperture_radius,
            "focus_distance": self.eye.camera.focus_distance,
            "layer": self.layer,
            "layers": self.layer_names(),
            "compare": self.compare,
            "sides": self.sides.iter().map(of).collect::<Vec<_>>(),
            "moment": self.moment,
            "errors": self.errors,
            "encode_milliseconds": self.encode_milliseconds,
            "techniques": self.techniques,
        })
    }
}
