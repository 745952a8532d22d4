//! The straight-line kernels that the build script writes, and their choice by order.
//!
//! Orders 1 to 6 have products as unrolled code, orders 7 and 8 as a loop over the table of Γ. The choice costs
//! nothing: the order is a constant of each instance.

use std::sync::OnceLock;

use crate::Real;
use crate::sh::filled;
use crate::tensor::{Entry, tripling_entries};

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// The same array, whose size the compiler does not see to be the same.
#[inline(always)]
fn same<T: Copy, const A: usize, const B: usize>(from: &[[T; A]; A]) -> [[T; B]; B] {
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
pub(crate) fn quarter_turn<const N: usize, T: Real>(f: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(N, (&same(f)), [1 quarter_turn_1, 2 quarter_turn_2, 3 quarter_turn_3, 4 quarter_turn_4,
        5 quarter_turn_5, 6 quarter_turn_6, 7 quarter_turn_7, 8 quarter_turn_8], unreachable!("orders end at 8"))
}

#[inline(always)]
pub(crate) fn quarter_turn_back<const N: usize, T: Real>(f: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(N, (&same(f)), [1 quarter_turn_back_1, 2 quarter_turn_back_2, 3 quarter_turn_back_3,
        4 quarter_turn_back_4, 5 quarter_turn_back_5, 6 quarter_turn_back_6, 7 quarter_turn_back_7,
        8 quarter_turn_back_8], unreachable!("orders end at 8"))
}

#[inline(always)]
pub(crate) fn product<const N: usize, T: Real>(f: &[[T; N]; N], g: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(N, (&same(f), &same(g)), [1 product_1, 2 product_2, 3 product_3, 4 product_4, 5 product_5,
        6 product_6], product_by_table(f, g))
}

#[inline(always)]
pub(crate) fn square<const N: usize, T: Real>(f: &[[T; N]; N]) -> [[T; N]; N] {
    by_order!(N, (&same(f)), [1 square_1, 2 square_2, 3 square_3, 4 square_4, 5 square_5, 6 square_6],
        product_by_table(f, f))
}

/// The entries of Γ with i ≤ j ≤ k of an order from 1 to 8, computed once.
pub(crate) fn tripling(order: usize) -> &'static [Entry] {
    static TABLES: [OnceLock<Vec<Entry>>; 8] = [const { OnceLock::new() }; 8];
    TABLES[order - 1].get_or_init(|| tripling_entries(order))
}

/// The product as a loop over Γ: the slow and obvious form, and the only one at orders 7 and 8.
pub(crate) fn product_by_table<const N: usize, T: Real>(f: &[[T; N]; N], g: &[[T; N]; N]) -> [[T; N]; N] {
    let (f, g) = (f.as_flattened(), g.as_flattened());
    let mut product = [[T::of(0.0); N]; N];
    let out = product.as_flattened_mut();
    for &Entry { i, j, k, value } in tripling(N) {
        let gamma = T::of(value);
        let pair = |j: usize, k: usize| if j == k { f[j] * g[j] } else { f[j] * g[k] + f[k] * g[j] };
        out[i] = gamma.mul_add(pair(j, k), out[i]);
        if j != i {
            out[j] = gamma.mul_add(pair(i, k), out[j]);
        }
        if k != j {
            out[k] = gamma.mul_add(pair(i, j), out[k]);
        }
    }
    product
}
