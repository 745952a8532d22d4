//! The straight-line kernels that the build script writes, and their choice by order.
//!
//! Orders 1 to 4 have products as unrolled code, orders 5 to 8 as loops over the table of Γ. The choice costs nothing:
//! the order is a constant of each instance.

use std::sync::OnceLock;

use crate::Real;
use crate::sh::filled;
use crate::tensor::{Entry, tripling_entries};

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// The same array, whose size the compiler does not see to be the same.
#[inline(always)]
pub(crate) fn same<T: Copy, const A: usize, const B: usize>(from: &[[T; A]; A]) -> [[T; B]; B] {
    debug_assert_eq!(A, B);
    filled(|row, column| from[row][column])
}

macro_rules! by_order {
    ($order:expr, $args:tt, [$($n:literal $kernel:ident),*], $rest:expr) => {
        match $order {
            $($n => same(&$kernel $args),)*
            _ => $rest,
        }
    };
}

#[inline(always)]
pub(crate) fn basis<const N: usize, T: Real>(d: [T; 3]) -> [[T; N]; N] {
    by_order!(
        N,
        (d),
        [1 basis_1, 2 basis_2, 3 basis_3, 4 basis_4, 5 basis_5, 6 basis_6, 7 basis_7, 8 basis_8],
        unreachable!("orders end at 8")
    )
}

#[inline(always)]
pub(crate) fn rotate<const N: usize, T: Real>(f: &[[T; N]; N], turns: &[[T; 2]; 3]) -> [[T; N]; N] {
    by_order!(
        N,
        (&same(f), turns),
        [1 rotate_1, 2 rotate_2, 3 rotate_3, 4 rotate_4, 5 rotate_5, 6 rotate_6, 7 rotate_7, 8 rotate_8],
        unreachable!("orders end at 8")
    )
}

#[inline(always)]
pub(crate) fn product<const N: usize, T: Real>(f: &[[T; N]; N], g: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(
        N,
        (&same(f), &same(g)),
        [1 product_1, 2 product_2, 3 product_3, 4 product_4],
        product_by_table(f, g)
    )
}

#[inline(always)]
pub(crate) fn square<const N: usize, T: Real>(f: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(N, (&same(f)), [1 square_1, 2 square_2, 3 square_3, 4 square_4], square_by_table(f))
}

/// One entry of Γ for the loops over the table.
#[derive(Clone, Copy, Debug)]
struct Triple {
    i: u8,
    j: u8,
    k: u8,
    single: f32,
    double: f64,
}

impl Triple {
    #[inline(always)]
    fn places(&self) -> (usize, usize, usize) {
        (usize::from(self.i), usize::from(self.j), usize::from(self.k))
    }
}

/// The entries of Γ of one order, by how many of their indices are equal, so that the loops have no branches.
struct Tripling {
    /// All, with i ≤ j ≤ k.
    entries: Vec<Entry>,
    /// i < j < k: each serves three outputs.
    distinct: Vec<Triple>,
    /// i = j ≠ k: (i, i, k) serves two.
    twice: Vec<Triple>,
    /// i = j = k.
    thrice: Vec<Triple>,
}

fn tables(order: usize) -> &'static Tripling {
    static TABLES: [OnceLock<Tripling>; 8] = [const { OnceLock::new() }; 8];
    TABLES[order - 1].get_or_init(|| {
        let entries = tripling_entries(order);
        let mut table = Tripling { entries, distinct: vec![], twice: vec![], thrice: vec![] };
        for &Entry { i, j, k, value } in &table.entries {
            let triple = |i: usize, j: usize, k: usize| Triple {
                i: i as u8,
                j: j as u8,
                k: k as u8,
                single: value as f32,
                double: value,
            };
            match (i == j, j == k) {
                (true, true) => table.thrice.push(triple(i, i, i)),
                (true, false) => table.twice.push(triple(i, i, k)),
                (false, true) => table.twice.push(triple(j, j, i)),
                (false, false) => table.distinct.push(triple(i, j, k)),
            }
        }
        // Neighbours in the list would wait for each other's sums in memory: steps of a golden section part them.
        let count = table.distinct.len();
        let step = (1..=count).rev().find(|&step| step * 8 < count * 5 && coprime(step, count)).unwrap_or(1);
        table.distinct = (0..count).map(|at| table.distinct[at * step % count]).collect();
        table
    })
}

fn coprime(mut a: usize, mut b: usize) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

/// The entries of Γ with i ≤ j ≤ k of an order from 1 to 8, computed once.
pub(crate) fn tripling(order: usize) -> &'static [Entry] {
    &tables(order).entries
}

/// The product as loops over Γ. From order 5 on the unrolled code would be tens of kilobytes for each set of
/// instructions, and no faster.
#[inline(always)]
pub(crate) fn product_by_table<const N: usize, T: Real>(f: &[[T; N]; N], g: &[[T; N]; N]) -> [[T; N]; N] {
    let table = tables(N);
    let (f, g) = (f.as_flattened(), g.as_flattened());
    let mut product = [[T::of(0.0); N]; N];
    let out = product.as_flattened_mut();
    for triple in &table.distinct {
        let ((i, j, k), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        out[i] = gamma.mul_add(f[j].mul_add(g[k], f[k] * g[j]), out[i]);
        out[j] = gamma.mul_add(f[i].mul_add(g[k], f[k] * g[i]), out[j]);
        out[k] = gamma.mul_add(f[i].mul_add(g[j], f[j] * g[i]), out[k]);
    }
    for triple in &table.twice {
        let ((i, _, k), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        out[i] = gamma.mul_add(f[i].mul_add(g[k], f[k] * g[i]), out[i]);
        out[k] = gamma.mul_add(f[i] * g[i], out[k]);
    }
    for triple in &table.thrice {
        let ((i, _, _), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        out[i] = gamma.mul_add(f[i] * g[i], out[i]);
    }
    product
}

/// The square as loops over Γ.
#[inline(always)]
fn square_by_table<const N: usize, T: Real>(f: &[[T; N]; N]) -> [[T; N]; N] {
    let table = tables(N);
    let f = f.as_flattened();
    let mut square = [[T::of(0.0); N]; N];
    let out = square.as_flattened_mut();
    for triple in &table.distinct {
        let ((i, j, k), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        let (a, b) = (gamma * (f[i] + f[i]), gamma * (f[j] + f[j]));
        out[i] = b.mul_add(f[k], out[i]);
        out[j] = a.mul_add(f[k], out[j]);
        out[k] = a.mul_add(f[j], out[k]);
    }
    for triple in &table.twice {
        let ((i, _, k), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        let a = gamma * f[i];
        out[i] = (a + a).mul_add(f[k], out[i]);
        out[k] = a.mul_add(f[i], out[k]);
    }
    for triple in &table.thrice {
        let ((i, _, _), gamma) = (triple.places(), T::of_table(triple.single, triple.double));
        out[i] = (gamma * f[i]).mul_add(f[i], out[i]);
    }
    square
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries that are not zero among all orders of the indices, and those with i ≤ j ≤ k.
    fn counts(order: usize) -> (usize, usize) {
        let all = tripling(order).iter().map(|entry| match (entry.i == entry.j, entry.j == entry.k) {
            (true, true) => 1,
            (false, false) => 6,
            _ => 3,
        });
        (all.sum(), tripling(order).len())
    }

    #[test]
    fn verified_math_1_numbers_of_nonzeros_of_the_tripling_tensor() {
        assert_eq!(counts(3), (83, 25));
        assert_eq!(counts(4), (353, 77));
        assert_eq!(counts(5), (1158, 238));
        assert_eq!(counts(6), (2907, 549));
    }

    #[test]
    fn unrolled_products_equal_the_loop_over_the_table() {
        let f: [[f64; 4]; 4] = filled(|row, column| (row as f64 * 1.3 + column as f64).sin());
        let g: [[f64; 4]; 4] = filled(|row, column| (row as f64 + column as f64 * 0.7).cos());
        let (unrolled, looped) = (product(&f, &g), product_by_table(&f, &g));
        let (square, square_looped) = (square(&f), square_by_table(&f));
        for row in 0..4 {
            for column in 0..4 {
                assert!((unrolled[row][column] - looped[row][column]).abs() < 1e-14);
                assert!((square[row][column] - square_looped[row][column]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn verified_math_1_constant_entries_are_the_identity_over_root_4_pi() {
        for entry in tripling(8).iter().filter(|entry| entry.i == 0) {
            assert_eq!(entry.j, entry.k);
            assert!((entry.value - 1.0 / crate::sh::SQRT_4PI).abs() < 1e-14);
        }
    }
}
