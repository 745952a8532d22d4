//! Asking for memory before it is needed.
//!
//! A map of a few million texels does not fit the caches, and a look-up waits for main memory about as long as a ray
//! takes to trace. Asked for before the ray, the texels are there after it.
//!
//! `unsafe` is needed because the instruction takes an address; it reads nothing into the program.
#![allow(unsafe_code)]

/// Begins to bring the line of `items[index]` into the cache. No effect on results; none at all out of bounds or on
/// processors that this does not know.
#[inline]
pub(super) fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(item) = items.get(index) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the address is that of a live reference, and every x86-64 processor has the instruction.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(item).cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}
