//! From light with visibility to radiance.
//!
//! Diffuse: (ρ/π) ∫ L·V·max(n·ω, 0); Phong: ρ_s (n + 2)/(n + 1) ∫ L·V·lobe(r)·max(n·ω, 0), the lobe of integral 1 about the
//! mirror direction r. Either the lobe and the cosine are joined by a product, which leaves a dot product with the light that
//! arrives; or their logarithms are added to that of the visibility: exp(log V + log lobe + log cos/π) π, and its dot product
//! with the light. The latter costs an exponential for each pixel and is as good for exponents from 1 to about 4. Lobe and cosine
//! have the right energy each, but the exponential of the sum of their logarithms has not (a twelfth is missing at an exponent
//! of 4), so it is put right by a table over the exponent and the cosine between mirror direction and normal.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use halflight_material::LowFrequency;
use halflight_sh::{Exponential, LobeTable, Sh, Zh};

use super::between::mirrored;
use super::settings::ShexpSettings;
use super::solve::LogLight;
use crate::gbuffer::{Look, VisiblePoint};
use crate::sh_light::{Colors, axes};

/// Irradiance without any blockers, averaged over normals and colours.
pub(super) fn unshadowed<const ORDER: usize>(light: &Colors<ORDER>) -> f32 {
    // The mean of a function is its first coefficient times y_00; a normal sees π times the mean radiance.
    let mean = light.iter().map(|l| l[0]).sum::<f32>() / 3.0 * 0.282_094_8;
    (mean * PI).max(f32::MIN_POSITIVE)
}

/// Lobes are tabulated at these steps of the octave.
const STEPS: usize = 16;
/// Octaves from an exponent of 0 (as 1 + n) on.
const OCTAVES: usize = 11;
/// Of the energies of lobe times cosine: entries for each octave of the exponent, and for cosines from 0 to 1.
const ENERGIES_PER_OCTAVE: f32 = 4.0;
const ENERGY_COSINES: usize = 33;
/// Bounds of what they are put right by.
const ENERGY_LIMITS: [f32; 2] = [0.25, 4.0];

/// What light is integrated with.
pub(super) struct Kernels<const ORDER: usize> {
    pub(super) cosine: Zh<ORDER>,
    /// Phong lobes by log₂(1 + n).
    lobes: Vec<Zh<ORDER>>,
    /// Their logarithms.
    logs: LobeTable<ORDER>,
    /// The largest exponent that is added as a logarithm.
    most_by_logarithms: f32,
    /// What the exponential of log lobe + log cosine is to be multiplied by, exponent by exponent.
    energies: Vec<[f32; ENERGY_COSINES]>,
    pub(super) exponential: Exponential,
    clamp: bool,
}

impl<const ORDER: usize> Kernels<ORDER> {
    pub(super) fn new(settings: &ShexpSettings) -> Self {
        /// More changes nothing in six bands.
        const LARGEST: f32 = 256.0;
        let exponent = |i: usize| (i as f64 / STEPS as f64).exp2() - 1.0;
        let lobes = (0..=OCTAVES * STEPS).map(|i| Zh::<ORDER, f64>::phong(exponent(i)).cast()).collect();
        let mut kernels = Self {
            cosine: Zh::clamped_cosine(),
            lobes,
            logs: LobeTable::new(LARGEST, settings.exponential()),
            most_by_logarithms: settings.most_by_logarithms(),
            energies: Vec::new(),
            exponential: settings.exponential(),
            clamp: settings.clamp,
        };
        let last =
            (kernels.most_by_logarithms.clamp(1.0, LARGEST).log2() * ENERGIES_PER_OCTAVE).ceil() as usize;
        kernels.energies =
            (0..=last + 1).map(|i| kernels.energies((i as f32 / ENERGIES_PER_OCTAVE).exp2())).collect();
        kernels
    }

    /// Whether the lobe of a material is added as a logarithm.
    pub(super) fn by_logarithms(&self, material: &LowFrequency) -> bool {
        let exponents = 1.0..=self.most_by_logarithms;
        material.specular != Vec3::ZERO && exponents.contains(&material.exponent)
    }

    /// Energy of lobe × cosine over that of the exponential of the sum of their logarithms, by the angle between them.
    fn energies(&self, exponent: f32) -> [f32; ENERGY_COSINES] {
        let normal = [0.0, 0.0, 1.0];
        let (lobe, [log_lobe, log_cosine]) = (self.lobe(exponent), self.log_lobe(exponent));
        std::array::from_fn(|i| {
            let cosine = i as f32 / (ENERGY_COSINES - 1) as f32;
            let mirrored = [(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
            let exact = lobe.to_direction(mirrored).dot(&self.cosine.to_direction(normal));
            let log = log_lobe.to_direction(mirrored) + log_cosine.to_direction(normal);
            let found = PI * self.exponential.apply(&log).dot(&Sh::one());
            (exact / found.max(f32::MIN_POSITIVE)).clamp(ENERGY_LIMITS[0], ENERGY_LIMITS[1])
        })
    }

    /// What the integral of light with the exponential of logarithms is to be multiplied by at a point.
    /// The mirror direction and the eye are as far from the normal: `cosine` is that of either.
    pub(super) fn energy(&self, exponent: f32, cosine: f32) -> f32 {
        let cosine = cosine.clamp(0.0, 1.0) * (ENERGY_COSINES - 1) as f32;
        let exponent = exponent.max(1.0).log2() * ENERGIES_PER_OCTAVE;
        let (i, j) =
            ((exponent as usize).min(self.energies.len() - 2), (cosine as usize).min(ENERGY_COSINES - 2));
        let (s, t) = ((exponent - i as f32).min(1.0), cosine - j as f32);
        let along = |row: &[f32; ENERGY_COSINES]| row[j] + (row[j + 1] - row[j]) * t;
        let (below, above) = (along(&self.energies[i]), along(&self.energies[i + 1]));
        below + (above - below) * s
    }

    /// Logarithms of the lobe of an exponent and of the cosine, both of integral 1.
    pub(super) fn log_lobe(&self, exponent: f32) -> [Zh<ORDER>; 2] {
        [self.logs.lookup(exponent), self.logs.lookup(1.0)]
    }

    /// The Phong lobe of an exponent, of integral 1.
    pub(super) fn lobe(&self, exponent: f32) -> Zh<ORDER> {
        let place = (1.0 + exponent).log2().clamp(0.0, OCTAVES as f32) * STEPS as f32;
        let below = (place as usize).min(OCTAVES * STEPS - 1);
        let (a, b, t) = (&self.lobes[below], &self.lobes[below + 1], place - below as f32);
        Zh(std::array::from_fn(|l| a.0[l] + (b.0[l] - a.0[l]) * t))
    }

    /// Radiance towards the eye under a light, which is there in two parts as well if logarithms are to be added.
    pub(super) fn reflected(
        &self,
        point: &VisiblePoint,
        light: &Colors<ORDER>,
        apart: Option<&LogLight<ORDER>>,
    ) -> Vec3 {
        let cosine = self.cosine.to_direction(axes(point.normal));
        let exponent = point.material.exponent;
        let gathered = match apart.filter(|_| self.by_logarithms(&point.material)) {
            _ if point.material.specular == Vec3::ZERO => Vec3::ZERO,
            Some(apart) => {
                let [lobe, cosine] = self.log_lobe(exponent);
                let log = apart.log
                    + lobe.to_direction(axes(mirrored(point.normal, point.towards_eye)))
                    + cosine.to_direction(axes(point.normal));
                PI * self.energy(exponent, point.normal.dot(point.towards_eye))
                    * integral(&apart.lit, &self.exponential.apply(&log))
            }
            None => {
                let lobe = self.lobe(exponent).to_direction(axes(mirrored(point.normal, point.towards_eye)));
                integral(light, &lobe.product(&cosine))
            }
        };
        let look = Look { material: point.material, emitted: point.emitted };
        self.radiance(&look, integral(light, &cosine), gathered)
    }

    /// Radiance from the integrals of the light with the cosine, and with lobe and cosine.
    #[inline]
    pub(super) fn radiance(&self, look: &Look, irradiance: Vec3, gathered: Vec3) -> Vec3 {
        let material = &look.material;
        let n = material.exponent;
        let clamped = |integral: Vec3| if self.clamp { integral.max(Vec3::ZERO) } else { integral };
        if material.specular == Vec3::ZERO {
            return look.emitted + material.diffuse * FRAC_1_PI * clamped(irradiance);
        }
        look.emitted
            + material.diffuse * FRAC_1_PI * clamped(irradiance)
            + material.specular * ((n + 2.0) / (n + 1.0)) * clamped(gathered)
    }
}

/// ∫ L·V times a kernel, for the three colours.
#[inline]
fn integral<const ORDER: usize>(light: &Colors<ORDER>, kernel: &Sh<ORDER>) -> Vec3 {
    Vec3::new(light[0].dot(kernel), light[1].dot(kernel), light[2].dot(kernel))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tabulated_lobes_are_those_of_the_exponent() {
        let kernels = Kernels::<6>::new(&ShexpSettings::default());
        for exponent in [0.0f32, 0.5, 3.0, 20.0, 111.0, 1024.0] {
            let exact: Zh<6> = Zh::<6, f64>::phong(f64::from(exponent)).cast();
            for (found, exact) in kernels.lobe(exponent).0.iter().zip(exact.0) {
                assert!((found - exact).abs() < 2e-3, "{exponent}: {found} {exact}");
            }
        }
    }

    #[test]
    fn added_logarithms_of_lobe_and_cosine_have_the_energy_of_their_product() {
        let kernels = Kernels::<4>::new(&ShexpSettings::default());
        for exponent in [1.0f32, 1.7, 3.0, 4.0] {
            for degrees in [0.0f32, 20.0, 45.0, 60.0, 75.0] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let (normal, mirrored) = ([0.0, 0.0, 1.0], [sin, 0.0, cos]);
                let product =
                    kernels.lobe(exponent).to_direction(mirrored).dot(&kernels.cosine.to_direction(normal));
                let [lobe, cosine] = kernels.log_lobe(exponent);
                let log = lobe.to_direction(mirrored) + cosine.to_direction(normal);
                let sum = PI * kernels.exponential.apply(&log).dot(&Sh::one());
                let corrected = sum * kernels.energy(exponent, cos);
                println!("{exponent} {degrees}: {product:.4}, {sum:.4} as it is, {corrected:.4} corrected");
                assert!((corrected - product).abs() < 0.005, "{exponent} {degrees}: {corrected} {product}");
            }
        }
    }
}
