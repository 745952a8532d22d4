//! Light fields on grids, their numerical Fourier transforms, and the second moments of those.

use halflight_frequency::covariance::Covariance;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Samples of a field at ((i − n/2) h) per axis.
pub(crate) fn sampled<const N: usize>(
    n: usize,
    h: [f64; N],
    field: impl Fn([f64; N]) -> Complex<f64>,
) -> Vec<Complex<f64>> {
    (0..n.pow(N as u32))
        .map(|index| {
            let mut rest = index;
            let mut z = [0.0; N];
            for axis in (0..N).rev() {
                z[axis] = ((rest % n) as f64 - (n / 2) as f64) * h[axis];
                rest /= n;
            }
            field(z)
        })
        .collect()
}

/// ∫ Ω Ωᵀ |F|ᵖ / ∫ |F|ᵖ, and ∫ |F|ᵖ, with the mean frequency left in.
pub(crate) fn moments<const N: usize>(
    mut values: Vec<Complex<f64>>,
    n: usize,
    h: [f64; N],
    power: i32,
) -> (Covariance<N>, f64) {
    let fft = FftPlanner::new().plan_fft_forward(n);
    let mut line = vec![Complex::default(); n];
    for axis in 0..N {
        let stride = n.pow((N - 1 - axis) as u32);
        for start in (0..values.len()).filter(|i| (i / stride).is_multiple_of(n)) {
            for (k, value) in line.iter_mut().enumerate() {
                *value = values[start + k * stride];
            }
            fft.process(&mut line);
            for (k, value) in line.iter().enumerate() {
                values[start + k * stride] = *value;
            }
        }
    }
    let mut result = Covariance::ZERO;
    let mut total = 0.0;
    for (index, value) in values.iter().enumerate() {
        let weight = value.norm().powi(power);
        let mut rest = index;
        let mut omega = [0.0; N];
        for axis in (0..N).rev() {
            let k = (rest % n) as f64;
            let signed = if k < (n / 2) as f64 { k } else { k - n as f64 };
            omega[axis] = signed / (n as f64 * h[axis]);
            rest /= n;
        }
        total += weight;
        for i in 0..N {
            for j in 0..N {
                result.rows[i][j] += weight * omega[i] * omega[j];
            }
        }
    }
    result.rows = result.rows.map(|row| row.map(|value| value / total));
    (result, total)
}

/// A Gaussian beam of covariance C = (4π² Σ)⁻¹: exp(−2π² zᵀ Σ z).
pub(crate) fn beam<const N: usize>(sigma: &Covariance<N>, z: [f64; N]) -> Complex<f64> {
    let mut q = 0.0;
    for i in 0..N {
        for j in 0..N {
            q += z[i] * sigma.rows[i][j] * z[j];
        }
    }
    // exp(−½ zᵀ C⁻¹ z) with C⁻¹ = 4π² Σ.
    Complex::new((-0.5 * 4.0 * std::f64::consts::PI.powi(2) * q).exp(), 0.0)
}

/// Numbers without visible structure, the same in every run.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next_number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64) / (1u64 << 53) as f64
    }
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next_number()
    }
}

/// A random band-limited field in the plane: wave packets at random places with random frequencies and phases.
pub(crate) fn packets(seed: u64) -> Vec<[f64; 7]> {
    let mut numbers = Numbers(seed);
    (0..12)
        .map(|_| {
            let mut between = |a: f64, b: f64| numbers.between(a, b);
            [
                between(-0.6, 0.6),
                between(-0.6, 0.6),
                between(0.25, 0.4),
                between(0.25, 0.4),
                between(-2.0, 2.0),
                between(-2.0, 2.0),
                between(0.0, 1.0),
            ]
        })
        .collect()
}

pub(crate) fn packet_field(packets: &[[f64; 7]], [x, u]: [f64; 2]) -> Complex<f64> {
    packets
        .iter()
        .map(|p| {
            let (dx, du) = ((x - p[0]) / p[2], (u - p[1]) / p[3]);
            let phase = std::f64::consts::TAU * (p[4] * x + p[5] * u + p[6]);
            Complex::from_polar((-0.5 * (dx * dx + du * du)).exp(), phase)
        })
        .sum()
}

/// The largest difference of entries, relative to the geometric mean of the diagonal entries that they belong to.
pub(crate) fn difference<const N: usize>(a: &Covariance<N>, b: &Covariance<N>) -> f64 {
    let mut worst: f64 = 0.0;
    for i in 0..N {
        for j in 0..N {
            let scale = (b.rows[i][i] * b.rows[j][j]).sqrt().max(1e-300);
            worst = worst.max((a.rows[i][j] - b.rows[i][j]).abs() / scale);
        }
    }
    worst
}
