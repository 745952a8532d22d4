//! Basis, zonal rotation, product, square and dot product, block by block.

use super::{Lanes, WIDTH, load, load_direction, store};
use crate::sh::zonal_factor;
use crate::simd::{Kernel, Lane, Simd};
use crate::zonal::scale_bands;
use crate::{Sh, Zh};

fn same_length(a: usize, b: usize) {
    assert_eq!(a, b, "slices of blocks that belong together have the same length");
}

/// Basis and zonal rotation: `zonal` is empty for the former.
struct Basis<'a, const ORDER: usize> {
    directions: &'a [[Lanes; 3]],
    zonal: &'a [Zh<ORDER, Lanes>],
    out: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for Basis<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        for (block, direction) in self.directions.iter().enumerate() {
            for part in 0..WIDTH / V::N {
                let mut sh = Sh::<ORDER, V>::basis(load_direction(direction, part));
                if let Some(zh) = self.zonal.get(block) {
                    let mut factors = [V::splat(0.0); ORDER];
                    for l in 0..ORDER {
                        factors[l] = V::load(&zh.0[l].0[part * V::N..]) * V::of(zonal_factor(l));
                    }
                    scale_bands(&mut sh, &factors);
                }
                store(&sh, &mut self.out[block], part);
            }
        }
    }
}

/// y_i of unit directions. Panics where the slices differ in length.
pub fn basis<const ORDER: usize>(simd: Simd, directions: &[[Lanes; 3]], out: &mut [Sh<ORDER, Lanes>]) {
    same_length(directions.len(), out.len());
    simd.run(Basis { directions, zonal: &[], out });
}

/// Zonal functions turned to unit directions. Panics where the slices differ in length.
pub fn rotate_zonal<const ORDER: usize>(
    simd: Simd,
    zonal: &[Zh<ORDER, Lanes>],
    directions: &[[Lanes; 3]],
    out: &mut [Sh<ORDER, Lanes>],
) {
    same_length(directions.len(), out.len());
    same_length(zonal.len(), out.len());
    simd.run(Basis { directions, zonal, out });
}

struct Product<'a, const ORDER: usize> {
    f: &'a [Sh<ORDER, Lanes>],
    g: &'a [Sh<ORDER, Lanes>],
    out: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for Product<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        for ((f, g), out) in self.f.iter().zip(self.g).zip(self.out) {
            for part in 0..WIDTH / V::N {
                let (f, g): (Sh<ORDER, V>, Sh<ORDER, V>) = (load(f, part), load(g, part));
                store(&f.product_inlined(&g), out, part);
            }
        }
    }
}

/// Products f·g. Panics where the slices differ in length.
pub fn product<const ORDER: usize>(
    simd: Simd,
    f: &[Sh<ORDER, Lanes>],
    g: &[Sh<ORDER, Lanes>],
    out: &mut [Sh<ORDER, Lanes>],
) {
    same_length(f.len(), out.len());
    same_length(g.len(), out.len());
    simd.run(Product { f, g, out });
}

struct Square<'a, const ORDER: usize> {
    f: &'a [Sh<ORDER, Lanes>],
    out: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for Square<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        for (f, out) in self.f.iter().zip(self.out) {
            for part in 0..WIDTH / V::N {
                let f: Sh<ORDER, V> = load(f, part);
                store(&f.square_inlined(), out, part);
            }
        }
    }
}

/// Squares f·f. Panics where the slices differ in length.
pub fn square<const ORDER: usize>(simd: Simd, f: &[Sh<ORDER, Lanes>], out: &mut [Sh<ORDER, Lanes>]) {
    same_length(f.len(), out.len());
    simd.run(Square { f, out });
}

struct Dot<'a, const ORDER: usize> {
    f: &'a [Sh<ORDER, Lanes>],
    g: &'a [Sh<ORDER, Lanes>],
    out: &'a mut [Lanes],
}

impl<const ORDER: usize> Kernel for Dot<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        for ((f, g), out) in self.f.iter().zip(self.g).zip(self.out) {
            for part in 0..WIDTH / V::N {
                let (f, g): (Sh<ORDER, V>, Sh<ORDER, V>) = (load(f, part), load(g, part));
                f.dot(&g).store(&mut out.0[part * V::N..]);
            }
        }
    }
}

/// ∫ f g. Panics where the slices differ in length.
pub fn dot<const ORDER: usize>(
    simd: Simd,
    f: &[Sh<ORDER, Lanes>],
    g: &[Sh<ORDER, Lanes>],
    out: &mut [Lanes],
) {
    same_length(f.len(), out.len());
    same_length(g.len(), out.len());
    simd.run(Dot { f, g, out });
}
