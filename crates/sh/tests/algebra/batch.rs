use halflight_sh::attenuation::Cap;
use halflight_sh::batch::{self, CapLanes, Lanes};
use halflight_sh::study::BlockerSet;
use halflight_sh::{BlockerTable, Exponential, Sh, Simd, Zh};

use crate::common::Numbers;

fn levels() -> Vec<Simd> {
    [Simd::Baseline, Simd::Avx2, Simd::Avx512].into_iter().filter(|&level| level <= Simd::detect()).collect()
}

fn block<const N: usize>(numbers: &mut Numbers, scale: f64) -> Sh<N, Lanes> {
    Sh::from_fn(|_| Lanes(std::array::from_fn(|_| (numbers.signed() * scale) as f32)))
}

fn close<const N: usize>(a: &Sh<N>, b: &Sh<N>, limit: f32) -> bool {
    a.coefficients().iter().zip(b.coefficients()).all(|(a, b)| (a - b).abs() <= limit * b.abs().max(1.0))
}

fn every_kernel_equals_the_single_form<const N: usize>() {
    let mut numbers = Numbers(11);
    let directions: Vec<[Lanes; 3]> = (0..2)
        .map(|_| {
            let all: Vec<_> = (0..16).map(|_| numbers.direction().as_vec3()).collect();
            [0, 1, 2].map(|axis| Lanes(std::array::from_fn(|lane| all[lane][axis])))
        })
        .collect();
    let at = |b: usize, lane: usize| directions[b].map(|axis| axis.0[lane]);
    let f = [block::<N>(&mut numbers, 1.0), block(&mut numbers, 1.5)];
    let g = [block::<N>(&mut numbers, 1.0), block(&mut numbers, 1.0)];
    let zonal: Vec<Zh<N, Lanes>> = (0..2)
        .map(|_| Zh(std::array::from_fn(|_| Lanes(std::array::from_fn(|_| numbers.signed() as f32)))))
        .collect();
    for simd in levels() {
        let mut out = [Sh::<N, Lanes>::zero(); 2];
        let check =
            |out: &[Sh<N, Lanes>; 2], what: &str, limit: f32, single: &dyn Fn(usize, usize) -> Sh<N>| {
                for b in 0..2 {
                    for lane in 0..16 {
                        let (batched, alone) = (batch::lane(&out[b], lane), single(b, lane));
                        assert!(
                            close(&batched, &alone, limit),
                            "{what}, order {N}, {}: {batched:?} {alone:?}",
                            simd.name()
                        );
                    }
                }
            };
        batch::basis(simd, &directions, &mut out);
        check(&out, "basis", 3e-6, &|b, lane| Sh::basis(at(b, lane)));
        batch::rotate_zonal(simd, &zonal, &directions, &mut out);
        check(&out, "zonal", 6e-6, &|b, lane| {
            Zh(std::array::from_fn(|l| zonal[b].0[l].0[lane])).to_direction(at(b, lane))
        });
        batch::product(simd, &f, &g, &mut out);
        check(&out, "product", 4e-6, &|b, lane| batch::lane(&f[b], lane).product(&batch::lane(&g[b], lane)));
        batch::square(simd, &f, &mut out);
        check(&out, "square", 4e-6, &|b, lane| batch::lane(&f[b], lane).square());
        for form in [Exponential::default(), Exponential::FixedSquaring { squarings: 3 }] {
            batch::exponential(simd, form, &f, &mut out);
            check(&out, "exponential", 5e-4, &|b, lane| form.apply(&batch::lane(&f[b], lane)));
        }
        let mut dots = [Lanes::default(); 2];
        batch::dot(simd, &f, &g, &mut dots);
        for lane in 0..16 {
            let alone = batch::lane(&f[1], lane).dot(&batch::lane(&g[1], lane));
            assert!((dots[1].0[lane] - alone).abs() < 1e-5);
        }
    }
}

#[test]
fn every_kernel_equals_the_single_form_at_every_level() {
    every_kernel_equals_the_single_form::<3>();
    every_kernel_equals_the_single_form::<4>();
    every_kernel_equals_the_single_form::<5>();
}

fn lanes_of(caps: &[Cap]) -> Vec<CapLanes> {
    caps.chunks(16)
        .map(|chunk| {
            let mut lanes = CapLanes::default();
            for (lane, cap) in chunk.iter().enumerate() {
                for axis in 0..3 {
                    lanes.direction[axis].0[lane] = cap.direction[axis];
                }
                lanes.half_angle.0[lane] = cap.half_angle;
                lanes.weight.0[lane] = 0.7;
            }
            lanes
        })
        .collect()
}

#[test]
fn blockers_added_side_by_side_equal_blockers_added_one_by_one() {
    let table = BlockerTable::<4>::new();
    let caps: Vec<Cap> =
        [BlockerSet::Small(30), BlockerSet::Huge(7)].iter().flat_map(|set| set.caps(3)).collect();
    let alone: Sh<4> = caps.iter().map(|cap| table.log_visibility(cap) * 0.7).sum();
    let lanes = lanes_of(&caps);
    for simd in levels() {
        assert!(close(&batch::accumulate_blockers(simd, &table, &lanes), &alone, 1e-5), "{}", simd.name());
        let mut logs = vec![Sh::<4, Lanes>::zero(); lanes.len()];
        batch::accumulate_blockers_at_points(simd, &table, &lanes, &mut logs);
        batch::accumulate_blockers_at_points(simd, &table, &lanes, &mut logs);
        for (index, cap) in caps.iter().enumerate() {
            let found = batch::lane(&logs[index / 16], index % 16);
            assert!(close(&found, &(table.log_visibility(cap) * 1.4), 1e-5), "{}", simd.name());
        }
    }
}

#[test]
fn angles_outside_the_table_read_its_ends() {
    let table = BlockerTable::<4>::new();
    let mut caps = lanes_of(&[Cap { direction: glam::Vec3::Z, half_angle: 0.0 }; 3]);
    caps[0].half_angle.0[..3].copy_from_slice(&[f32::NAN, -1.0, 1e9]);
    for simd in levels() {
        let _ = batch::accumulate_blockers(simd, &table, &caps);
    }
}
