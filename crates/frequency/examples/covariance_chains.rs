//! What an event costs: chains of ten, in four and five dimensions.

use std::hint::black_box;
use std::time::Instant;

use halflight_frequency::covariance::{Covariance, microfacet_lobe};

fn chain<const N: usize>(light: Covariance<N>, k: f64) -> Covariance<N> {
    let lobe = microfacet_lobe(0.1, 0.8);
    light
        .travel(1.0 + k)
        .rotate(0.3)
        .arrive(0.8)
        .curve([0.5, 0.1, 0.2], 0.8)
        .reflect(lobe)
        .texture([3.0, 0.0, 2.0])
        .curve([0.5, 0.1, 0.2], 0.8)
        .leave(0.8)
        .travel(2.0)
        .occlude(0.5)
}

fn measure<const N: usize>() {
    const CHAINS: u32 = 1_000_000;
    let start = Instant::now();
    for i in 0..CHAINS {
        black_box(chain(black_box(Covariance::<N>::diagonal([1.0; N])), f64::from(i % 7)));
    }
    let each = start.elapsed().as_secs_f64() / f64::from(CHAINS) / 10.0;
    println!("{N} dimensions: {:.1} ns an event", each * 1e9);
}

fn main() {
    measure::<2>();
    measure::<4>();
    measure::<5>();
}
