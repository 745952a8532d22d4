//! What the kernels of spherical harmonics cost.

use halflight_sh::{Simd, bench};

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::table::Table;

/// DirectXMath's SHMath at order 4, nanoseconds for a single call (SHEval, SHRotate, SHMult).
const PEER: [(&str, f64); 3] = [("basis", 3.9), ("rotation from a matrix", 23.0), ("product", 64.0)];

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let runs = if args.quick { 2 } else { 40 };
    let simd = Simd::from_name(args.machine.simd()?.name()).unwrap_or(Simd::Baseline);
    let mut table = Table::new(["kernel", "calls", "order 4", "goal", "DirectXMath", "order 6"]);
    let [four, six] = [4, 6].map(|order| bench::measure(order, simd, runs));
    for (four, six) in four.map_err(Failure::failed)?.iter().zip(&six.map_err(Failure::failed)?) {
        let nanoseconds = |ns: f64| format!("{ns:.1}");
        let or_dash = |ns: Option<f64>| ns.map_or_else(|| "–".into(), nanoseconds);
        let peer = PEER.iter().find(|(kernel, _)| *kernel == four.kernel && !four.batched);
        table.row([
            four.kernel.to_string(),
            if four.batched { "batched" } else { "single" }.into(),
            nanoseconds(four.nanoseconds),
            or_dash(four.goal),
            or_dash(peer.map(|(_, ns)| *ns)),
            nanoseconds(six.nanoseconds),
        ]);
    }
    let notes = vec![
        format!("nanoseconds for each vector on one core, batched with {}; best of {runs} runs", simd.name()),
        "DirectXMath's SHMath at order 4, as measured when the goals were set".into(),
    ];
    Ok(Findings { title: "Kernels of spherical harmonics", table, notes })
}
