//! What `[001]` prints about wavelets, where that is wrong: for the errata tests.

/// Eq. (7) as far as it can be read: the smallest i for which the sum of the largest amplitudes from i to the **coarse** end
/// is below ε times the largest of all; the number of octaves if there is none.
#[must_use]
pub fn level(largest_amplitudes: &[f32], epsilon: f32) -> usize {
    let top = largest_amplitudes.iter().copied().fold(0.0, f32::max);
    (0..largest_amplitudes.len())
        .find(|&i| largest_amplitudes[i..].iter().sum::<f32>() < epsilon * top)
        .unwrap_or(largest_amplitudes.len())
}

/// Eq. (7) with its ε = 0.01 on amplitudes, but summed from the fine side: the finest level for almost any picture.
#[must_use]
pub fn level_by_amplitude(largest_amplitudes: &[f32], epsilon: f32) -> usize {
    let top = largest_amplitudes.iter().copied().fold(0.0, f32::max);
    (0..largest_amplitudes.len())
        .find(|&i| largest_amplitudes[..=i].iter().sum::<f32>() >= epsilon * top)
        .unwrap_or(largest_amplitudes.len())
}

/// ν_a = 2π/(2^I λ), §2.3: radians per radian, 4π times 1/(2^(I+1) λ) with λ in radians per texel.
#[must_use]
pub fn angular(level: usize, lambda: f32) -> f32 {
    std::f32::consts::TAU / ((level as f32).exp2() * lambda)
}
