//! Media, lenses, shutters and glass that cannot be: errors at their line, or sound scenes.

use std::path::Path;

use halflight_scene::{LoadOptions, Scene};

/// What the loader says of a scene with these lines.
fn said(lines: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("{lines}\n")).expect("a scene file");
    load(&path)
}

fn load(path: &Path) -> Result<Scene, String> {
    Scene::load(path, &LoadOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn media_that_cannot_be_are_told_with_their_line() {
    for lines in [
        "[[medium]]\nscattering = -1",
        "[[medium]]\nabsorption = nan",
        "[[medium]]\nscattering = inf",
        "[[medium]]\nscattering = 1\nanisotropy = 1",
        "[[medium]]\nscattering = 1\nanisotropy = nan",
        "[[medium]]\nscattering = 1\ndensity = -2",
        "[[medium]]\nscattering = 1\nmin = [0, 0, 0]",
        "[[medium]]\nscattering = 1\nmin = [0, 0, 0]\nmax = [1, 0, 1]",
        "[[medium]]\nscattering = 1\ncenter = [0, 0, 0]",
        "[[medium]]\nscattering = 1\ncenter = [0, 0, 0]\nradius = 0",
        "[[medium]]\nscattering = 1\ngrid = \"nowhere.grid\"\nmin = [0, 0, 0]\nmax = [1, 1, 1]",
        "[[medium]]\nscattering = 1\ngrid = \"nowhere.grid\"",
        "[[medium]]\nscatering = 1",
    ] {
        let Err(error) = said(lines) else { panic!("{lines} was taken") };
        assert!(error.contains("scene.toml"), "{error}");
    }
    let scene = said("[[medium]]\nscattering = [1, 2, 3]\n[[medium]]").expect("a medium of nothing is none");
    assert_eq!(scene.at(0.0).expect("a frame").media.volumes().len(), 1);
}

#[test]
fn lenses_shutters_and_glass_that_cannot_be_are_told_too() {
    for lines in [
        "[camera]\naperture_radius = -0.1",
        "[camera]\naperture_radius = inf",
        "[camera]\nfocus_distance = 0",
        "[camera]\nfocus_distance = -2",
        "[camera]\nfocus_distance = nan",
        "[camera]\nshutter = [1, 0]",
        "[material.glass]\ntype = \"dielectric\"\nior = 0",
        "[material.glass]\ntype = \"dielectric\"\nior = -1.5",
        "[material.glass]\ntype = \"dielectric\"\nior = nan",
    ] {
        assert!(said(lines).is_err(), "{lines} was taken");
    }
    assert!(said("[camera]\naperture_radius = 0\nshutter = [0.5, 0.5]").is_ok());
}

#[test]
fn numbers_are_told_as_they_were_written_and_elements_of_nothing_as_missing() {
    let Err(error) = said("[[medium]]\nscattering = 1\nabsorption = -0.1") else { panic!("taken") };
    assert!(error.contains("found -0.1\n"), "{error}");
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, "[camera]\norigin = [0, 1, 2]\n").expect("a scene file");
    let options = LoadOptions { set: vec!["medium.0.scattering=1".into()], ..LoadOptions::default() };
    let Err(error) = Scene::load(&path, &options) else { panic!("taken") };
    assert!(error.to_string().contains("there are no media"), "{error}");
}
