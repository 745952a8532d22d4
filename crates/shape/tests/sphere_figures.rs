//! How well spheres stand for the meshes at hand: prints a table, and holds it to what was reached. Seconds are of this
//! machine and this profile; `cargo test -p halflight-shape --test sphere_figures -- --nocapture` shows it.

use std::path::Path;
use std::time::Instant;

use halflight_shape::{SphereFitOptions, SphereSet, load_model};

#[test]
fn fits_are_as_good_as_they_have_been() {
    println!(
        "mesh, spheres: seconds, outside volume, uncovered, mean and least overlap of silhouettes; the last balanced"
    );
    // The most that may be outside, by volume of the mesh, and the least overlap: a tenth worse than measured.
    for (name, spheres, most_outside, least_overlap) in [
        ("meshes/stanford_bunny.ply", 10, 0.85, 0.70),
        ("meshes/stanford_bunny.ply", 25, 0.46, 0.80),
        ("meshes/stanford_bunny.ply", 50, 0.34, 0.84),
        ("meshes/stanford_bunny.ply", 100, 0.25, 0.87),
        ("animated/CesiumMan.glb", 25, 1.4, 0.64),
    ] {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")).join(name);
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        }
        let model = load_model(&path).expect("it can be read");
        let surface = model.rest_surface().mesh;
        let start = Instant::now();
        let options = SphereFitOptions { spheres, ..SphereFitOptions::default() };
        let (set, report) = SphereSet::fit_model(&model, &options).expect("it can be fitted");
        let seconds = start.elapsed().as_secs_f64();
        let outside = report.measure.outside_fraction().expect("it has an inside");
        let uncovered = report.measure.coverage.uncovered;
        let outlines = set.silhouettes(&surface);
        let balanced = set.balanced(&surface).0.silhouettes(&surface);
        println!(
            "{name}, {spheres}: {seconds:.1} s, {outside:.3}, {uncovered:.5}, {:.3}, {:.3}; {:.3}",
            outlines.mean_iou, outlines.least_iou, balanced.mean_iou
        );
        assert!(outside < most_outside && uncovered < 0.002, "{name}, {spheres}: {report:?}");
        assert!(
            outlines.mean_iou > least_overlap && balanced.mean_iou > outlines.mean_iou,
            "{name}: {outlines:?}"
        );
    }
}
