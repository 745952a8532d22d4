//! Writes the straight-line kernels of the crate: basis, product, square and rotation, with their constants.
//!
//! The constants come from the same f64 code that the crate tests its kernels against, so no table of numbers has to be
//! kept by hand.

#[path = "../src/legendre.rs"]
#[allow(dead_code, unreachable_pub)]
mod legendre;
#[path = "../src/tensor.rs"]
#[allow(dead_code, unreachable_pub)]
mod tensor;
mod write;

use std::{env, fs, path::Path};

fn main() {
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-changed=src/legendre.rs");
    println!("cargo::rerun-if-changed=src/tensor.rs");
    let mut text = String::new();
    for order in 1..=8 {
        write::basis(&mut text, order);
        write::rotate(&mut text, order);
    }
    for order in 1..=4 {
        write::product(&mut text, order);
        write::square(&mut text, order);
    }
    let folder = env::var("OUT_DIR").expect("cargo names the output folder");
    fs::write(Path::new(&folder).join("kernels.rs"), text).expect("the output folder can be written");
}
