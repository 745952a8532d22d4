//! Pictures on surfaces, and the colours of metals.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use halflight_image::{ColorSpace, Texels, TextureImage};
use halflight_material::{
    ColorInput, Material, MaterialKind, NormalMap, SurfaceInput, Texture, UvTransform, Wrap, metal,
    metal_names,
};

/// Red and green above, blue and white below, linear.
fn checker() -> Texture {
    let texels = vec![[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]];
    Texture::new(Arc::new(TextureImage { width: 2, height: 2, texels: Texels::Floats(texels) }))
}

#[test]
fn a_texture_has_its_texels_at_their_centres_and_the_mean_between() {
    let texture = checker();
    assert_eq!(texture.sample(Vec2::new(0.25, 0.25)), Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(texture.sample(Vec2::new(0.75, 0.75)), Vec4::ONE);
    assert_eq!(texture.sample(Vec2::new(0.5, 0.5)), Vec4::new(0.5, 0.5, 0.5, 1.0));
    assert_eq!(texture.mean(), Vec4::new(0.5, 0.5, 0.5, 1.0));
}

#[test]
fn a_texture_of_squares_shows_the_texel_that_a_place_lies_in() {
    let texture = Texture { nearest: true, ..checker() };
    let smooth = checker();
    for (u, v) in [(0.01, 0.01), (0.49, 0.2), (0.51, 0.2), (0.99, 0.49), (0.3, 0.51), (0.9, 0.99)] {
        let center = |x: f32, size: usize| ((x * size as f32).floor() + 0.5) / size as f32;
        let middle = Vec2::new(center(u, smooth.image.width), center(v, smooth.image.height));
        assert_eq!(texture.sample(Vec2::new(u, v)), smooth.sample(middle), "at {u} {v}");
    }
}

#[test]
fn beyond_its_border_a_texture_repeats_stays_or_turns_over() {
    let mut texture = checker();
    let red = Vec4::new(1.0, 0.0, 0.0, 1.0);
    let green = Vec4::new(0.0, 1.0, 0.0, 1.0);
    assert_eq!(texture.sample(Vec2::new(1.25, -3.75)), red);
    assert!((texture.sample(Vec2::new(0.0, 0.25)) - (red + green) / 2.0).length() < 1e-6);
    texture.wrap_u = Wrap::Clamp;
    assert_eq!(texture.sample(Vec2::new(0.0, 0.25)), red);
    assert_eq!(texture.sample(Vec2::new(9.0, 0.25)), green);
    texture.wrap_u = Wrap::Mirror;
    assert_eq!(texture.sample(Vec2::new(1.25, 0.25)), green);
    assert_eq!(texture.sample(Vec2::new(2.25, 0.25)), red);
    assert_eq!(texture.sample(Vec2::new(-0.25, 0.25)), red);
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        texture.wrap_u = wrap;
        texture.wrap_v = wrap;
        for x in [1e30f32, -1e30, f32::MAX, 1e-38, 0.999_999_94, f32::NAN, f32::INFINITY] {
            assert!(texture.sample(Vec2::new(x, -x)).is_finite());
        }
    }
}

#[test]
fn coordinates_are_scaled_then_turned_then_moved() {
    let transform =
        UvTransform { offset: Vec2::new(0.1, 0.2), rotation: FRAC_PI_2, scale: Vec2::new(2.0, 3.0) };
    // The rotation of KHR_texture_transform takes (u, v) to (v, −u) at a quarter turn.
    let found = transform.apply(Vec2::new(0.5, 0.1));
    assert!((found - Vec2::new(0.3 + 0.1, -1.0 + 0.2)).length() < 1e-6, "{found}");
}

#[test]
fn srgb_bytes_are_mixed_in_linear_light() {
    let texels = Texels::Bytes(vec![[0, 0, 0, 255], [255, 255, 255, 255]], ColorSpace::Srgb);
    let mut texture = Texture::new(Arc::new(TextureImage { width: 2, height: 1, texels }));
    texture.wrap_u = Wrap::Clamp;
    assert!((texture.sample(Vec2::new(0.5, 0.5)).x - 0.5).abs() < 1e-6);
    let texels = Texels::Bytes(vec![[188, 188, 188, 128]], ColorSpace::Srgb);
    let found = Texture::new(Arc::new(TextureImage { width: 1, height: 1, texels })).sample(Vec2::ZERO);
    assert!((found.x - 0.5029).abs() < 1e-3 && (found.w - 128.0 / 255.0).abs() < 1e-6);
}

#[test]
fn a_material_takes_its_colour_from_texture_factor_and_vertex() {
    let texture = Arc::new(checker());
    let albedo = ColorInput::Textured { texture: texture.clone(), factor: Vec3::splat(0.5) };
    let mut material = Material::new("tiles", MaterialKind::Diffuse { albedo });
    let input = SurfaceInput { uv: Vec2::new(0.25, 0.25), color: Vec3::new(0.5, 1.0, 1.0) };
    assert_eq!(material.bsdf(&input).albedo(), Vec3::new(0.25, 0.0, 0.0));
    assert!(!material.is_emissive() && material.emitted(&input) == Vec3::ZERO);
    material.emission = Some(ColorInput::Textured { texture, factor: Vec3::splat(4.0) });
    assert!(material.is_emissive());
    assert_eq!(material.emitted(&input), Vec3::new(4.0, 0.0, 0.0));
    assert_eq!(material.mean_emission(), Vec3::splat(2.0));
}

#[test]
fn a_normal_map_bends_the_normal_and_never_below_the_surface() {
    let map = |texel: [f32; 4]| NormalMap {
        texture: Arc::new(Texture::new(Arc::new(TextureImage {
            width: 1,
            height: 1,
            texels: Texels::Floats(vec![texel]),
        }))),
        scale: 1.0,
    };
    assert_eq!(map([0.5, 0.5, 1.0, 1.0]).at(Vec2::ZERO), Vec3::Z);
    assert!((map([0.8, 0.5, 0.9, 1.0]).at(Vec2::ZERO) - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-6);
    for bad in [[0.5, 0.5, 0.5, 1.0], [1.0, 0.5, 0.0, 1.0], [0.0; 4]] {
        assert_eq!(map(bad).at(Vec2::ZERO), Vec3::Z);
    }
}

#[test]
fn gold_is_yellow_copper_is_red_and_silver_is_bright() {
    let straight_on = |name: &str| {
        let material = Material::metal(name, 0.3).expect("a known metal");
        material.bsdf(&SurfaceInput::default()).albedo()
    };
    let gold = straight_on("gold");
    assert!(gold.x > 0.9 && (0.6..0.85).contains(&gold.y) && (0.2..0.45).contains(&gold.z), "{gold}");
    let copper = straight_on("copper");
    assert!(copper.x > 0.85 && copper.y < 0.7 && copper.z < 0.6, "{copper}");
    assert!(straight_on("silver").min_element() > 0.85);
    for name in metal_names() {
        let (eta, k) = metal(name).expect("listed");
        assert!(eta.min_element() > 0.0 && k.min_element() > 0.0);
        assert!(straight_on(name).max_element() <= 1.0);
    }
    assert!(metal("aluminum").is_some());
}

/// The mean of a texture under a Gaussian, by a sum over a fine grid.
fn summed(texture: &Texture, uv: Vec2, [uu, uv_, vv]: [f32; 3]) -> Vec4 {
    let a = uu.max(1e-12).sqrt();
    let (b, c) = (uv_ / a, (vv - uv_ * uv_ / (a * a)).max(0.0).sqrt());
    let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
    for i in -60..=60 {
        for j in -60..=60 {
            let (x, y) = (i as f32 / 20.0, j as f32 / 20.0);
            let weight = (-0.5 * (x * x + y * y)).exp();
            sum += weight * texture.sample(uv + Vec2::new(a * x, b * x + c * y));
            weights += weight;
        }
    }
    sum / weights
}

#[test]
fn the_mean_under_a_footprint_is_that_of_the_texels_there() {
    let texels = (0..64 * 48).map(|i| {
        let (x, y) = (i % 64, i / 64);
        // Squares, stripes, and something that looks random.
        let squares = if (x / 8 + y / 6) % 2 == 0 { 1.0 } else { 0.0 };
        let random = (i as u32).wrapping_mul(2_654_435_761) >> 24;
        [squares, if x % 4 < 2 { 1.0 } else { 0.0 }, random as f32 / 255.0, 1.0]
    });
    let image = TextureImage { width: 64, height: 48, texels: Texels::Floats(texels.collect()) };
    let plain = Texture::new(Arc::new(image));
    let mut turned = plain.clone();
    turned.transform = UvTransform { offset: Vec2::new(0.2, 0.1), rotation: 0.5, scale: Vec2::new(1.5, 0.8) };
    for texture in [plain, turned] {
        let (mut worst, mut squares, mut count) = (0.0f32, 0.0, 0.0);
        for k in 0..60 {
            let part = |a: f32| (k as f32 * a).fract();
            let uv = Vec2::new(part(0.754_877_7), part(0.569_840_3));
            let (s, r) = (0.004 + 0.2 * part(0.31), 0.2 + 0.8 * part(0.17));
            let (sin, cos) = (std::f32::consts::TAU * part(0.618_034)).sin_cos();
            let (a, b) = (s * s, s * s * r * r);
            let footprint =
                [a * cos * cos + b * sin * sin, (a - b) * sin * cos, a * sin * sin + b * cos * cos];
            let error = (texture.sample_over(uv, footprint) - summed(&texture, uv, footprint)).abs();
            worst = worst.max(error.max_element());
            squares += error.length_squared();
            count += 3.0;
        }
        let rms = (squares / count).sqrt();
        println!("worst {worst}, mean {rms}");
        assert!(worst < 0.2 && rms < 0.04, "{worst} {rms}");
        // A point is a point, and a footprint without end the mean of all.
        let uv = Vec2::new(0.3, 0.6);
        assert_eq!(texture.sample_over(uv, [0.0; 3]), texture.sample(uv));
        let all = texture.sample_over(uv, [f32::INFINITY, 0.0, f32::INFINITY]);
        assert!((all - texture.mean()).abs().max_element() < 1e-3, "{all} {}", texture.mean());
    }
}

#[test]
fn what_a_limited_material_reflects_under_a_footprint_is_the_mean_of_what_its_points_reflect() {
    let texels = (0..32 * 32).map(|i| {
        let light = (i % 32 / 4 + i / 32 / 4) % 2 == 0;
        if light { [0.95, 0.9, 0.3, 1.0] } else { [0.05, 0.1, 0.6, 1.0] }
    });
    let image = TextureImage { width: 32, height: 32, texels: Texels::Floats(texels.collect()) };
    let texture = || ColorInput::Textured {
        texture: Arc::new(Texture::new(Arc::new(image.clone()))),
        factor: Vec3::ONE,
    };
    let even = || ColorInput::Constant(Vec3::splat(0.3));
    let bright = ColorInput::Textured {
        texture: Arc::new(Texture::new(Arc::new(image.clone()))),
        factor: Vec3::splat(1.6),
    };
    let exponent = 20.0.into();
    let kinds = [
        MaterialKind::Phong { diffuse: texture(), specular: even(), exponent },
        MaterialKind::Phong { diffuse: even(), specular: texture(), exponent: 20.0.into() },
        // The numbers of the first one are kept with the texture; those of others are not averaged.
        MaterialKind::Phong { diffuse: texture(), specular: texture(), exponent: 20.0.into() },
        MaterialKind::Diffuse { albedo: bright },
    ];
    let (wo, wi) = (Vec3::new(0.3, 0.1, 0.9).normalize(), Vec3::new(-0.2, 0.1, 0.8).normalize());
    let footprint = [0.02, 0.0, 0.02];
    for (i, kind) in kinds.into_iter().enumerate() {
        let material = Material::new("tiles", kind);
        let (mut of_points, mut of_means) = (Vec3::ZERO, Vec3::ZERO);
        for k in 0..64 * 64 {
            let uv = Vec2::new((k % 64) as f32 + 0.5, (k / 64) as f32 + 0.5) / 64.0;
            let input = SurfaceInput { uv, color: Vec3::ONE };
            of_points += material.bsdf(&input).eval(wo, wi);
            of_means += material.bsdf_over(&input, Some(footprint), 0.0).eval(wo, wi);
        }
        let ratio = of_means / of_points;
        assert!((ratio - 1.0).abs().max_element() < 0.01, "{i}: {ratio}");
    }
}
