//! Whatever goes in, bounds come out: finite, not negative, and never smaller for more demanding input.

use halflight_frequency::bandwidth::{Bandwidth, Chain, Exit, UNLIMITED, pixel, variance};
use halflight_frequency::mapping::EnvironmentBandwidth;
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::Plane;
use proptest::prelude::*;

fn sound(b: Bandwidth) -> bool {
    [b.spatial, b.angular].iter().all(|v| v.is_finite() && *v >= 0.0 && *v <= UNLIMITED)
}

fn any_finite() -> impl Strategy<Value = f32> {
    prop_oneof![-1e3f32..1e3, Just(0.0), Just(-0.0), Just(f32::MAX), Just(f32::MIN_POSITIVE), any::<f32>()]
        .prop_filter("finite", |v| v.is_finite())
}

fn exits() -> impl Strategy<Value = Exit> {
    (any_finite(), any_finite(), any_finite(), any_finite())
        .prop_map(|(curvature, distance, cos_exit, texture)| Exit { curvature, distance, cos_exit, texture })
}

proptest! {
    #[test]
    fn any_input_gives_bounds(exit in exits(), a in any_finite(), b in any_finite(), c in any_finite(), d in any_finite()) {
        prop_assert!(sound(exit.distant(a, b)));
        prop_assert!(sound(exit.local(a, b, c, d)));
        prop_assert!(sound(exit.textured()));
        prop_assert!(sound(exit.average_distant(&[a; 16], &[b; 16], &[c.abs(); 16])));
        prop_assert!(sound(exit.average_local(&[a; 16], &[b; 16], &[c; 16], &[d; 16], &[1.0; 16])));
        let chain = Chain::new(Bandwidth::new(a, b)).travel(c).reflect(d, a, b, c, d).travel(b);
        prop_assert!(chain.steps().iter().all(|s| sound(s.bandwidth())));
        let per_pixel = pixel::pixel_bandwidth(a, b, c);
        prop_assert!(per_pixel.is_finite() && per_pixel >= 0.0);
        prop_assert!((-2..=9).contains(&pixel::level(per_pixel, -2, 9)));
        let moment = variance::second_moment_plain(&[a; 4], &[b; 4], &[c; 4], &[d; 4]);
        prop_assert!(moment.is_finite() && moment >= 0.0);
        let n = variance::sample_count(variance::uniform_bound(moment), a.abs(), 0.02, 1, 1024);
        prop_assert!((1..=1024).contains(&n));
        prop_assert!(variance::importance_variance(&[a, b, c], &[d, 1.0, 1.0]) >= 0.0);
    }

    #[test]
    fn any_picture_has_sound_bandwidths_and_brighter_does_not_mean_faster(
        width in 1usize..20, height in 1usize..20, values in prop::collection::vec(any_finite(), 400), gain in 0.1f32..10.0,
    ) {
        let values: Vec<f32> = values.into_iter().take(width * height).collect();
        let picture = Plane { width, height, values };
        let analyse = |picture: &Plane| EnvironmentBandwidth::plane(picture, Filter::Smooth, Rule::Octave);
        let map = analyse(&picture);
        prop_assert!(map.values.iter().all(|v| v.is_finite() && *v >= 0.0 && *v <= 1e4));
        // Of values that neither overflow nor vanish, only the proportions count.
        if picture.values.iter().all(|v| v.abs() < 1e6 && (*v == 0.0 || v.abs() > 1e-3)) {
            let doubled = Plane { values: picture.values.iter().map(|v| v * 4.0).collect(), ..picture.clone() };
            prop_assert_eq!(analyse(&doubled).values, map.values);
        }
        let scaled = Plane { values: picture.values.iter().map(|v| v * gain).collect(), ..picture };
        prop_assert!(analyse(&scaled).values.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn nan_means_unlimited_and_not_nan(exit in exits(), a in any_finite()) {
        prop_assert!(sound(exit.distant(f32::NAN, a)));
        prop_assert!(sound(exit.local(f32::NAN, 1.0, 1.0, a)));
        let (bent, far) = (Exit { curvature: f32::NAN, ..exit }, Exit { distance: f32::INFINITY, ..exit });
        prop_assert!(sound(bent.distant(a, a)));
        prop_assert!(sound(far.local(a, 0.0, 0.0, a)));
    }

    #[test]
    fn bounds_grow_with_light_lobe_texture_curvature_distance_and_tilt(
        v in prop::array::uniform8(0.01f32..50.0), cos in 0.02f32..1.0, cos_i in 0.02f32..1.0, more in 1.0f32..3.0,
    ) {
        let exit = Exit { curvature: v[0], distance: v[1], cos_exit: cos, texture: v[2] };
        let base = (exit.distant(v[3], v[4]), exit.local(v[3], v[5], cos_i, v[4]));
        let grown = [
            Exit { curvature: v[0] * more, ..exit },
            Exit { distance: v[1] * more, ..exit },
            Exit { texture: v[2] * more, ..exit },
            Exit { cos_exit: cos / more, ..exit },
        ];
        for exit in grown {
            let (far, near) = (exit.distant(v[3], v[4]), exit.local(v[3], v[5], cos_i, v[4]));
            prop_assert!(far.angular >= base.0.angular * 0.9999 && far.spatial >= base.0.spatial * 0.9999);
            prop_assert!(near.angular >= base.1.angular * 0.9999 && near.spatial >= base.1.spatial * 0.9999);
        }
        prop_assert!(exit.distant(v[3] * more, v[4]).angular >= base.0.angular * 0.9999);
        prop_assert!(exit.distant(v[3], v[4] * more).angular >= base.0.angular * 0.9999);
        prop_assert!(exit.local(v[3] * more, v[5], cos_i, v[4]).angular >= base.1.angular * 0.9999);
        prop_assert!(exit.local(v[3], v[5], cos_i, v[4] * more).angular >= base.1.angular * 0.9999);
    }
}
