//! Light in media without bias: where a path scatters next, and how much of a shadow ray arrives.
//!
//! Free paths are sampled against a majorant M of all volumes that overlap, and each tentative collision is real with the
//! probability P = ⟨T σ_s⟩/(⟨T σ_s⟩ + ⟨T σ_n⟩), σ_n = M − σ_t, ⟨·⟩ a mean over colours weighted by the throughput T; the path's
//! weight takes up σ_s/(M P) or σ_n/(M (1 − P)). Absorption is in the weights: no path ends by it. Transmittance is exact for
//! volumes without a grid and ratio tracking, Π σ_n/M, for the others.
//!
//! Source: Kutz, Habel, Li, Novák 2017, "Spectral and decomposition tracking", §4; Novák, Selle, Jarosz 2014, "Residual ratio
//! tracking", eq. 9. Cost: a step for every 1/M metres.

use glam::Vec3;
use halflight_scene::media::{MOST_VOLUMES, Media, Volume};
use halflight_trace::Ray;

/// Tentative collisions after which a path is taken to be stuck: a medium so dense that nothing leaves it.
const MOST_COLLISIONS: u32 = 1 << 16;
/// Below this a throughput brings nothing that a picture shows.
const NOTHING: f32 = 1e-12;

/// A point where a path scatters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Collision {
    /// Distance along the ray.
    pub(crate) t: f32,
    /// The phase function's mean cosine.
    pub(crate) anisotropy: f32,
}

/// Random numbers of a ray in a medium: any number of them, from four of its path.
pub(crate) struct Stream {
    first: Option<f32>,
    state: u64,
}

impl Stream {
    /// From the numbers of a set; the first is used as it is, so that the first free path is stratified.
    #[inline]
    pub(crate) fn new(u: [f32; 4]) -> Self {
        let [a, b, c, d] = u.map(|u| u64::from(u.to_bits()));
        Self { first: Some(u[0]), state: a ^ b << 32 ^ c.rotate_left(17) ^ d << 29 }
    }

    /// The next number in [0, 1). (Steele, Lea, Flood 2014: SplitMix.)
    #[inline]
    fn next(&mut self) -> f32 {
        if let Some(first) = self.first.take() {
            return first;
        }
        self.hashed()
    }

    #[inline]
    fn hashed(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// The intervals in which a ray is in volumes, cut where any begins or ends.
struct Cuts {
    inside: [[f32; 2]; MOST_VOLUMES],
    places: [f32; 2 * MOST_VOLUMES],
    count: usize,
}

impl Cuts {
    fn new(media: &Media, ray: &Ray, end: f32) -> Self {
        let mut cuts = Self { inside: [[0.0; 2]; MOST_VOLUMES], places: [0.0; 2 * MOST_VOLUMES], count: 0 };
        for (inside, volume) in cuts.inside.iter_mut().zip(media.volumes()) {
            if let Some(interval) = volume.region.interval(ray.origin, ray.direction, end) {
                *inside = interval;
                for place in interval {
                    cuts.places[cuts.count] = place;
                    cuts.count += 1;
                }
            }
        }
        cuts.places[..cuts.count].sort_unstable_by(f32::total_cmp);
        cuts
    }

    /// The volumes that a ray is in at `t`.
    fn at<'a>(&'a self, media: &'a Media, t: f32) -> impl Iterator<Item = &'a Volume> {
        let volumes = media.volumes().iter().zip(&self.inside);
        volumes.filter(move |(_, inside)| t >= inside[0] && t < inside[1]).map(|(volume, _)| volume)
    }
}

/// Where a ray scatters before `end`, if it does; `throughput` takes up what is lost on the way.
pub(crate) fn collide(
    media: &Media,
    ray: &Ray,
    end: f32,
    stream: &mut Stream,
    throughput: &mut Vec3,
) -> Option<Collision> {
    let cuts = Cuts::new(media, ray, end);
    let mut left = MOST_COLLISIONS;
    for pair in cuts.places[..cuts.count].windows(2) {
        let [mut t, leave] = [pair[0], pair[1]];
        if leave <= t {
            continue;
        }
        let middle = if leave.is_finite() { 0.5 * (t + leave) } else { t + 1.0 };
        let majorant: f32 = cuts.at(media, middle).map(Volume::majorant).sum();
        if majorant <= 0.0 {
            continue;
        }
        loop {
            t -= (-stream.next()).ln_1p() / majorant;
            // False for NaN too.
            let within = t < leave;
            if !within {
                break;
            }
            left -= 1;
            if left == 0 || throughput.max_element() < NOTHING {
                *throughput = Vec3::ZERO;
                return None;
            }
            let point = ray.at(t);
            let (mut scattering, mut extinction) = (Vec3::ZERO, Vec3::ZERO);
            for volume in cuts.at(media, middle) {
                let density = volume.density_at(point);
                scattering += volume.scattering * density;
                extinction += volume.extinction() * density;
            }
            let null = (Vec3::splat(majorant) - extinction).max(Vec3::ZERO);
            let (real, unreal) =
                ((*throughput * scattering).element_sum(), (*throughput * null).element_sum());
            if real + unreal <= 0.0 {
                *throughput = Vec3::ZERO;
                return None;
            }
            let probability = real / (real + unreal);
            if stream.hashed() < probability {
                *throughput *= scattering / (majorant * probability);
                let anisotropy = chosen(&cuts, media, middle, point, scattering, stream);
                return Some(Collision { t, anisotropy });
            }
            *throughput *= null / (majorant * (1.0 - probability));
        }
    }
    None
}

/// The phase function of one of the volumes at a point, by what each scatters there.
fn chosen(cuts: &Cuts, media: &Media, t: f32, point: Vec3, scattering: Vec3, stream: &mut Stream) -> f32 {
    let mut volumes = cuts.at(media, t);
    let Some(first) = volumes.next() else { return 0.0 };
    let mut anisotropy = first.anisotropy;
    let mut rest = scattering.element_sum() * stream.hashed()
        - (first.scattering * first.density_at(point)).element_sum();
    for volume in volumes {
        let part = (volume.scattering * volume.density_at(point)).element_sum();
        if rest >= 0.0 && part > 0.0 {
            anisotropy = volume.anisotropy;
        }
        rest -= part;
    }
    anisotropy
}

/// How much of the light along a ray, up to its `t_max`, is neither absorbed nor scattered: an estimate without bias.
pub(crate) fn transmittance(media: &Media, ray: &Ray, stream: &mut Stream) -> Vec3 {
    let mut result = Vec3::ONE;
    for volume in media.volumes() {
        let Some([enter, leave]) = volume.region.interval(ray.origin, ray.direction, ray.t_max) else {
            continue;
        };
        if volume.density.is_none() {
            let depth = volume.extinction() * (leave - enter);
            // A colour that nothing happens to passes however long the way is.
            let passes = |depth: f32| if depth.is_nan() { 1.0 } else { (-depth).exp() };
            result *= Vec3::new(passes(depth.x), passes(depth.y), passes(depth.z));
            continue;
        }
        let majorant = volume.majorant();
        let mut t = enter;
        for _ in 0..MOST_COLLISIONS {
            t -= (-stream.next()).ln_1p() / majorant;
            let within = t < leave;
            if !within || result.max_element() < NOTHING {
                break;
            }
            let extinction = volume.extinction() * volume.density_at(ray.at(t));
            result *= (Vec3::ONE - extinction / majorant).max(Vec3::ZERO);
        }
    }
    result
}

/// How much light passes from the beginning of a ray to each of its points: [`transmittance`] for all ends at once, with one
/// walk through what varies. Room for it is kept from ray to ray.
#[derive(Clone, Debug, Default)]
pub(crate) struct Passage {
    /// Where volumes without a grid are, and their extinction.
    even: Vec<([f32; 2], Vec3)>,
    /// What is left of the light after each tentative collision, in order.
    steps: Vec<(f32, Vec3)>,
    /// Where the ray is within any volume: intervals in order that do not overlap.
    within: Vec<[f32; 2]>,
}

impl Passage {
    /// For a ray up to its `t_max`.
    pub(crate) fn walk(&mut self, media: &Media, ray: &Ray, stream: &mut Stream) {
        self.even.clear();
        self.steps.clear();
        self.within.clear();
        for volume in media.volumes() {
            let Some([enter, leave]) = volume.region.interval(ray.origin, ray.direction, ray.t_max) else {
                continue;
            };
            self.within.push([enter, leave]);
            if volume.density.is_none() {
                self.even.push(([enter, leave], volume.extinction()));
                continue;
            }
            let (majorant, mut left) = (volume.majorant(), Vec3::ONE);
            let mut t = enter;
            for _ in 0..MOST_COLLISIONS {
                t -= (-stream.next()).ln_1p() / majorant;
                let within = t < leave;
                if !within || left.max_element() < NOTHING {
                    break;
                }
                let passes = Vec3::ONE - volume.extinction() * volume.density_at(ray.at(t)) / majorant;
                let passes = passes.max(Vec3::ZERO);
                left *= passes;
                self.steps.push((t, passes));
            }
        }
        self.within.sort_by(|a, b| a[0].total_cmp(&b[0]));
        self.within.dedup_by(|next, last| {
            let touch = next[0] <= last[1];
            if touch {
                last[1] = last[1].max(next[1]);
            }
            touch
        });
        self.steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = Vec3::ONE;
        for (_, passes) in &mut self.steps {
            left *= *passes;
            *passes = left;
        }
    }

    /// Where the ray is within any volume.
    pub(crate) fn within(&self) -> &[[f32; 2]] {
        &self.within
    }

    /// What is left at distance `t`.
    pub(crate) fn at(&self, t: f32) -> Vec3 {
        let mut depth = Vec3::ZERO;
        for ([enter, leave], extinction) in &self.even {
            let way = t.min(*leave) - enter;
            if way > 0.0 {
                // A colour that nothing happens to passes however long the way is.
                let of = extinction * way;
                depth += Vec3::select(of.is_nan_mask(), Vec3::ZERO, of);
            }
        }
        let after = self.steps.partition_point(|step| step.0 <= t);
        let stepped = if after == 0 { Vec3::ONE } else { self.steps[after - 1].1 };
        (-depth).exp() * stepped
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use halflight_scene::media::{DensityGrid, Region};

    use super::*;

    fn slab(absorption: Vec3, scattering: Vec3, density: Option<Arc<DensityGrid>>) -> Media {
        let region = Region::Box { low: Vec3::ZERO, high: Vec3::new(10.0, 10.0, 2.0) };
        let name = "slab".into();
        Media::new(vec![Volume { name, region, absorption, scattering, anisotropy: 0.0, density }])
    }

    fn streams(n: u32) -> impl Iterator<Item = Stream> {
        (0..n).map(move |i| {
            let part = |k: u32| (i.wrapping_mul(k) >> 8) as f32 / (1u32 << 24) as f32;
            Stream::new([
                (i as f32 + 0.5) / n as f32,
                part(0x9e37_79b9),
                part(0x85eb_ca6b),
                part(0xc2b2_ae35),
            ])
        })
    }

    /// A linear ramp of density along z, from 0.1 to 1.9: its mean between the outermost middles is known.
    fn ramp() -> Arc<DensityGrid> {
        let values = (0..16).map(|k| 0.1 + 1.8 * k as f32 / 15.0).collect();
        Arc::new(DensityGrid::new([1, 1, 16], values).unwrap())
    }

    #[test]
    fn transmittance_is_that_of_beer_and_lambert() {
        let (a, s) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.3, 0.1, 0.5));
        let ray = Ray { t_max: 9.0, ..Ray::new(Vec3::new(5.0, 5.0, -1.0), Vec3::Z) };
        let expected = (-(a + s) * 2.0).exp();
        let even = transmittance(&slab(a, s, None), &ray, &mut Stream::new([0.5; 4]));
        assert!((even - expected).abs().max_element() < 1e-6);
        // The ramp's mean density is 1.
        let media = slab(a, s, Some(ramp()));
        let n = 100_000;
        let mean =
            streams(n).map(|mut stream| transmittance(&media, &ray, &mut stream)).sum::<Vec3>() / n as f32;
        assert!((mean - expected).abs().max_element() < 3e-3, "{mean} {expected}");
    }

    #[test]
    fn one_walk_tells_for_every_point_what_passes_to_it() {
        let (a, s) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.3, 0.1, 0.5));
        let ray = Ray { t_max: 9.0, ..Ray::new(Vec3::new(5.0, 5.0, -1.0), Vec3::Z) };
        let n = 20_000;
        let mut passage = Passage::default();
        for density in [None, Some(ramp())] {
            let media = slab(a, s, density.clone());
            let mut sums = [Vec3::ZERO; 3];
            for mut stream in streams(n) {
                passage.walk(&media, &ray, &mut stream);
                for (sum, t) in sums.iter_mut().zip([0.5, 2.2, 9.0]) {
                    *sum += passage.at(t) / n as f32;
                }
            }
            for (sum, t) in sums.into_iter().zip([0.5, 2.2, 9.0]) {
                let short = Ray { t_max: t, ..ray };
                let alone: Vec3 =
                    streams(n).map(|mut stream| transmittance(&media, &short, &mut stream)).sum();
                assert!((sum - alone / n as f32).abs().max_element() < 8e-3, "{t}: {sum}");
            }
        }
    }

    #[test]
    fn what_passes_without_scattering_is_that_of_beer_and_lambert_too() {
        let (a, s) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.3, 0.1, 0.5));
        let ray = Ray::new(Vec3::new(5.0, 5.0, -1.0), Vec3::Z);
        let expected = (-(a + s) * 2.0).exp();
        for density in [None, Some(ramp())] {
            let media = slab(a, s, density);
            let n = 200_000;
            let (mut passed, mut scattered) = (Vec3::ZERO, Vec3::ZERO);
            for mut stream in streams(n) {
                let mut throughput = Vec3::ONE;
                match collide(&media, &ray, 9.0, &mut stream, &mut throughput) {
                    None => passed += throughput,
                    Some(collision) => {
                        assert!(collision.t > 1.0 && collision.t < 3.0);
                        scattered += throughput;
                    }
                }
            }
            let (passed, scattered) = (passed / n as f32, scattered / n as f32);
            assert!((passed - expected).abs().max_element() < 4e-3, "{passed} {expected}");
            // What is not absorbed is scattered: σ_s/σ_t of the rest.
            let rest = (Vec3::ONE - expected) * s / (a + s);
            assert!((scattered - rest).abs().max_element() < 4e-3, "{scattered} {rest}");
        }
    }

    #[test]
    fn media_without_end_and_colours_that_meet_nothing_stay_numbers() {
        let region = Region::Everywhere;
        let (absorption, scattering) = (Vec3::new(0.0, 0.1, 0.2), Vec3::new(0.0, 0.3, 0.1));
        let name = "fog".into();
        let media =
            Media::new(vec![Volume { name, region, absorption, scattering, anisotropy: 0.5, density: None }]);
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        let through = transmittance(&media, &ray, &mut Stream::new([0.3; 4]));
        assert_eq!(through, Vec3::new(1.0, 0.0, 0.0));
        for mut stream in streams(1000) {
            let mut throughput = Vec3::ONE;
            collide(&media, &ray, f32::INFINITY, &mut stream, &mut throughput);
            assert!(throughput.is_finite());
        }
    }
}
