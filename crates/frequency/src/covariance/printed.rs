//! `[003]` as printed, for the tests that show what is wrong with it; see `docs/errata.md`.

use super::{Covariance2, Covariance3};

/// Refraction: Tf = diag(1, e·i_z/t_z) with e = n₁/n₂.
#[must_use]
pub fn refract(light: Covariance2, indices: [f64; 2], cos: [f64; 2]) -> Covariance2 {
    light.scaled(1, indices[0] / indices[1] * cos[0] / cos[1])
}

/// Lens: C = [1, f; 0, 1], Tr = [1, 0; d, 1], L = C·Tr, Σ' = Lᵀ Σ L.
#[must_use]
pub fn lens(light: Covariance2, focal_length: f64, distance: f64) -> Covariance2 {
    let l = [[1.0 + focal_length * distance, focal_length], [distance, 1.0]];
    light.transformed(&l)
}

/// Motion: M (Mᵀ Σ M + O) Mᵀ.
#[must_use]
pub fn occlude_moving(light: Covariance3, o: f64, velocity: f64) -> Covariance3 {
    let m = [[1.0, 0.0, velocity], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let transposed = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [velocity, 0.0, 1.0]];
    let mut inside = light.transformed(&m);
    inside.rows[0][0] += o;
    inside.transformed(&transposed)
}

/// BRDF: inverse(inverse(Σ) + B), which does not exist for distant light.
#[must_use]
pub fn reflect(light: Covariance2, b: f64) -> Option<Covariance2> {
    let invert = |[[a, b], [_, d]]: [[f64; 2]; 2]| {
        let determinant = a * d - b * b;
        (determinant != 0.0)
            .then(|| [[d / determinant, -b / determinant], [-b / determinant, a / determinant]])
    };
    let mut inverse = invert(light.rows)?;
    inverse[1][1] += b;
    Some(Covariance2 { rows: invert(inverse)? })
}
