//! Coefficients in a file: JSON with the name of their convention, the order, and red, green and blue of each.

use std::io::{Read, Write};
use std::path::Path;

use halflight_file::{LoadError, write_whole};
use halflight_sh::convert::Convention;
use serde_json::{Value, json};

use super::super::failure::Failure;

/// Coefficients of three colours as a library writes them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Light {
    pub(super) convention: Convention,
    pub(super) order: usize,
    /// One after the other, in the convention's order of indices.
    pub(super) coefficients: Vec<[f64; 3]>,
}

/// More than 64 coefficients of any sensible notation need.
const LARGEST_FILE: u64 = 1 << 20;

impl Light {
    pub(super) fn convention_name(&self) -> &'static str {
        Convention::ALL
            .iter()
            .find(|(_, known)| *known == self.convention)
            .map_or("halflight", |(name, _)| name)
    }

    pub(super) fn to_json(&self) -> Value {
        json!({ "convention": self.convention_name(), "order": self.order, "coefficients": self.coefficients })
    }

    pub(super) fn load(path: &Path) -> Result<Self, Failure> {
        const ASKED: &str = "coefficients of spherical harmonics";
        let error = |found: String| {
            Failure::from(LoadError::new(ASKED, path, found).hint("`halflight sh project` writes such files"))
        };
        let mut text = String::new();
        let file = std::fs::File::open(path).map_err(|e| error(e.to_string()))?;
        file.take(LARGEST_FILE + 1).read_to_string(&mut text).map_err(|e| error(e.to_string()))?;
        if text.len() as u64 > LARGEST_FILE {
            return Err(error("a file of more than a megabyte".into()));
        }
        let value: Value = serde_json::from_str(&text).map_err(|e| error(format!("no JSON: {e}")))?;
        Self::of_json(&value).map_err(error)
    }

    fn of_json(value: &Value) -> Result<Self, String> {
        let name = value["convention"].as_str().ok_or("no \"convention\"")?;
        let convention = Convention::from_name(name)
            .ok_or_else(|| format!("convention {name:?}, which is none of {}", convention_names()))?;
        let list = value["coefficients"].as_array().ok_or("no list \"coefficients\"")?;
        let mut coefficients = Vec::with_capacity(list.len().min(64));
        for (index, colour) in list.iter().enumerate() {
            let number = |channel: usize| colour[channel].as_f64().filter(|x| x.is_finite());
            match (number(0), number(1), number(2)) {
                (Some(r), Some(g), Some(b)) => coefficients.push([r, g, b]),
                _ => return Err(format!("coefficient {index} is not three finite numbers")),
            }
        }
        let order = coefficients.len().isqrt();
        if order * order != coefficients.len() || !halflight_sh::ORDERS.contains(&order) {
            return Err(format!(
                "{} coefficients; 1, 4, 9, 16, 25, 36, 49 or 64 were expected",
                coefficients.len()
            ));
        }
        if let Some(said) = value["order"].as_u64().filter(|said| *said != order as u64) {
            return Err(format!(
                "order {said}, but {} coefficients, which are those of order {order}",
                coefficients.len()
            ));
        }
        if order > convention.largest_order() {
            return Err(format!(
                "order {order}, which {name} does not have: it ends at {}",
                convention.largest_order()
            ));
        }
        Ok(Light { convention, order, coefficients })
    }

    pub(super) fn save(&self, path: &Path) -> Result<(), Failure> {
        let text = format!("{:#}\n", self.to_json());
        write_whole(path, "coefficients of spherical harmonics", |to| to.write_all(text.as_bytes()))?;
        Ok(())
    }
}

/// For messages and help.
pub(super) fn convention_names() -> String {
    Convention::ALL.map(|(name, _)| name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_file_is_said() {
        for (value, said) in [
            (json!({}), "no \"convention\""),
            (json!({ "convention": "unreal", "coefficients": [] }), "none of halflight, directxmath"),
            (json!({ "convention": "halflight" }), "no list"),
            (json!({ "convention": "halflight", "coefficients": [[1, 2]] }), "coefficient 0 is not three"),
            (json!({ "convention": "halflight", "coefficients": [] }), "0 coefficients"),
            (json!({ "convention": "threejs", "coefficients": vec![[0.0; 3]; 16] }), "it ends at 3"),
        ] {
            let found = Light::of_json(&value).expect_err("an error");
            assert!(found.contains(said), "{found}");
        }
    }

    #[test]
    fn json_gives_back_what_was_written() {
        let light =
            Light { convention: Convention::DirectXMath, order: 2, coefficients: vec![[0.25, 1.0, -3.0]; 4] };
        assert_eq!(Light::of_json(&light.to_json()), Ok(light));
    }
}
