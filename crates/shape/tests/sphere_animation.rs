//! Sets of animated models follow them: what covers the surface at rest covers it later.

use std::path::Path;

use halflight_shape::{SphereFitOptions, SphereSet, load_model};

#[test]
fn spheres_of_skinned_figures_follow_their_animation() {
    for (name, spheres) in [("CesiumMan.glb", 25), ("RiggedFigure.glb", 20), ("RiggedSimple.glb", 8)] {
        let path =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/animated")).join(name);
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        }
        let model = load_model(&path).expect("it can be read");
        let options = SphereFitOptions { spheres, teleports: 10, ..SphereFitOptions::default() };
        let (set, report) = SphereSet::fit_model(&model, &options).expect("it can be fitted");
        assert!(report.measure.coverage.uncovered < 0.005, "{name}: {report:?}");
        assert_eq!(set.influences.len(), spheres);
        for influences in &set.influences {
            assert!((influences.weights.iter().sum::<f32>() - 1.0).abs() < 1e-4, "{name}: {influences:?}");
        }
        let duration = model.duration().expect("it moves");
        let rest = set.silhouettes(&model.rest_surface().mesh);
        for step in 0..5 {
            let time = duration * step as f32 / 4.0;
            let posed = set.posed(&model.rest_to_pose(time));
            let surface = model.surface_at(time);
            let (measure, outlines) = (posed.measure(&surface), posed.silhouettes(&surface));
            println!(
                "{name} at {time:.2} s: uncovered {:.3}, silhouettes {:.3} (at rest {:.3})",
                measure.coverage.uncovered, outlines.mean_iou, rest.mean_iou
            );
            assert!(measure.coverage.uncovered < 0.15, "{name} at {time}: {measure:?}");
            assert!(outlines.mean_iou > rest.mean_iou - 0.08, "{name} at {time}: {outlines:?}");
        }
    }
}
