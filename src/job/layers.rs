//! Which layers a picture gets.

use halflight_file::nearest_name;
use halflight_render::features::FEATURE_LAYERS;

use super::{Format, JobError};

/// From `--layers` and the format that can or cannot hold them; without the option an EXR gets all.
///
/// # Errors
/// Unknown names, and layers where they cannot be kept.
pub fn choose_layers(list: Option<&str>, format: Format) -> Result<Vec<&'static str>, JobError> {
    let all = || FEATURE_LAYERS.iter().map(|(name, _)| *name);
    let Some(list) = list else {
        return Ok(if format == Format::Exr { all().collect() } else { Vec::new() });
    };
    let mut chosen = Vec::new();
    for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
        match word {
            "all" => chosen.extend(all()),
            "none" => {}
            _ => chosen.push(all().find(|name| *name == word).ok_or_else(|| unknown(word))?),
        }
    }
    chosen.sort_unstable();
    chosen.dedup();
    if !chosen.is_empty() && format != Format::Exr {
        return Err(JobError::usage("only .exr pictures have layers: name the output with -o FILE.exr"));
    }
    Ok(chosen)
}

fn unknown(word: &str) -> JobError {
    let names: Vec<&str> = FEATURE_LAYERS.iter().map(|(name, _)| *name).collect();
    let hint = match nearest_name(word, names.iter().copied()) {
        Some(name) => format!("did you mean {name}?"),
        None => format!("there are {}, all and none", names.join(", ")),
    };
    JobError::usage(format!("there is no layer {word:?} ({hint})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_chosen_by_name_once_each() {
        assert_eq!(choose_layers(Some("depth, normal,depth"), Format::Exr).unwrap(), ["depth", "normal"]);
        assert_eq!(choose_layers(Some("none"), Format::Png).unwrap(), [""; 0]);
        assert_eq!(choose_layers(None, Format::Exr).unwrap().len(), FEATURE_LAYERS.len());
        assert!(choose_layers(None, Format::Png).unwrap().is_empty());
        let error = choose_layers(Some("depht"), Format::Exr).unwrap_err();
        assert!(error.to_string().contains("did you mean depth?"));
        assert!(choose_layers(Some("depth"), Format::Png).is_err());
    }
}
