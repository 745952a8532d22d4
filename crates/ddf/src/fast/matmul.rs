//! Products of small matrices that keep a block of the result in registers.
//!
//! Rows are samples, columns neurons; widths are multiples of 16, heights of 8. The vectors are those of `pulp`, whose
//! level is chosen at run time: levels with fused multiply-add agree with each other and differ from the plain one in
//! the last bits.

use pulp::Simd;

/// `a · b + c`, fused where the level has it.
#[inline(always)]
pub(crate) fn fma<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Rows of a block of the result: with two columns of vectors, sixteen sums, which hide the latency of the products.
const ROWS: usize = 8;

/// y = x w + bias: x is rows × `inner`, w is `inner` × `width`. The rows of x are `stride` apart.
#[inline(always)]
pub(crate) fn forward<S: Simd>(
    simd: S,
    (x, stride, inner): (&[f32], usize, usize),
    w: &[f32],
    bias: Option<&[f32]>,
    width: usize,
    y: &mut [f32],
) {
    let vectors = width / S::F32_LANES;
    let rows = y.len() / width;
    let w = S::as_simd_f32s(w).0;
    let bias = bias.map(|bias| S::as_simd_f32s(bias).0);
    let y = S::as_mut_simd_f32s(y).0;
    for row in (0..rows).step_by(ROWS) {
        let x: [&[f32]; ROWS] = std::array::from_fn(|r| &x[(row + r) * stride..][..inner]);
        let mut column = 0;
        while column < vectors {
            if vectors - column >= 2 {
                block::<S, 2>(simd, x, w, bias, vectors, &mut y[row * vectors..], column);
                column += 2;
            } else {
                block::<S, 1>(simd, x, w, bias, vectors, &mut y[row * vectors..], column);
                column += 1;
            }
        }
    }
}

#[inline(always)]
fn block<S: Simd, const V: usize>(
    simd: S,
    x: [&[f32]; ROWS],
    w: &[S::f32s],
    bias: Option<&[S::f32s]>,
    vectors: usize,
    y: &mut [S::f32s],
    column: usize,
) {
    let zero = simd.splat_f32s(0.0);
    let start: [S::f32s; V] = std::array::from_fn(|v| bias.map_or(zero, |bias| bias[column + v]));
    let mut sums = [start; ROWS];
    for (i, line) in w.chunks_exact(vectors).enumerate() {
        let Some(line) = line[column..].first_chunk::<V>() else { return };
        for r in 0..ROWS {
            let a = simd.splat_f32s(x[r][i]);
            for v in 0..V {
                sums[r][v] = simd.mul_add_e_f32s(a, line[v], sums[r][v]);
            }
        }
    }
    for r in 0..ROWS {
        y[r * vectors + column..][..V].copy_from_slice(&sums[r]);
    }
}

/// g += xᵀ dy: the gradient of `forward` by its weights. `inner` is a multiple of 8.
#[inline(always)]
pub(crate) fn weight_gradient<S: Simd>(
    simd: S,
    (x, stride, inner): (&[f32], usize, usize),
    dy: &[f32],
    width: usize,
    g: &mut [f32],
) {
    let vectors = width / S::F32_LANES;
    let dy = S::as_simd_f32s(dy).0;
    let g = S::as_mut_simd_f32s(g).0;
    for i in (0..inner).step_by(ROWS) {
        let mut column = 0;
        while column < vectors {
            let g = &mut g[i * vectors..];
            if vectors - column >= 2 {
                gradient_block::<S, 2>(simd, &x[i..], stride, dy, vectors, g, column);
                column += 2;
            } else {
                gradient_block::<S, 1>(simd, &x[i..], stride, dy, vectors, g, column);
                column += 1;
            }
        }
    }
}

#[inline(always)]
fn gradient_block<S: Simd, const V: usize>(
    simd: S,
    x: &[f32],
    stride: usize,
    dy: &[S::f32s],
    vectors: usize,
    g: &mut [S::f32s],
    column: usize,
) {
    let mut sums: [[S::f32s; V]; ROWS] =
        std::array::from_fn(|r| std::array::from_fn(|v| g[r * vectors + column + v]));
    for (line, x) in dy.chunks_exact(vectors).zip(x.chunks(stride)) {
        let (Some(line), Some(x)) = (line[column..].first_chunk::<V>(), x.first_chunk::<ROWS>()) else {
            return;
        };
        for r in 0..ROWS {
            let a = simd.splat_f32s(x[r]);
            for v in 0..V {
                sums[r][v] = simd.mul_add_e_f32s(a, line[v], sums[r][v]);
            }
        }
    }
    for r in 0..ROWS {
        g[r * vectors + column..][..V].copy_from_slice(&sums[r]);
    }
}

/// One row times a matrix of `width` columns, in four independent sums, as one row alone would wait for itself.
#[inline(always)]
pub(crate) fn row<S: Simd>(simd: S, x: &[f32], w: &[f32], bias: &[f32], width: usize, y: &mut [f32]) {
    let vectors = width / S::F32_LANES;
    let (w, bias, y) = (S::as_simd_f32s(w).0, S::as_simd_f32s(bias).0, S::as_mut_simd_f32s(y).0);
    let mut column = 0;
    while column < vectors {
        if vectors - column >= 2 {
            row_block::<S, 2>(simd, x, w, bias, vectors, y, column);
            column += 2;
        } else {
            row_block::<S, 1>(simd, x, w, bias, vectors, y, column);
            column += 1;
        }
    }
}

#[inline(always)]
fn row_block<S: Simd, const V: usize>(
    simd: S,
    x: &[f32],
    w: &[S::f32s],
    bias: &[S::f32s],
    vectors: usize,
    y: &mut [S::f32s],
    column: usize,
) {
    let mut sums = [[simd.splat_f32s(0.0); V]; 4];
    sums[0] = std::array::from_fn(|v| bias[column + v]);
    let (quads, rest) = x.as_chunks::<4>();
    let mut lines = w.chunks_exact(vectors);
    for four in quads {
        for s in 0..4 {
            let Some(line) = lines.next().and_then(|line| line[column..].first_chunk::<V>()) else { return };
            let a = simd.splat_f32s(four[s]);
            for v in 0..V {
                sums[s][v] = simd.mul_add_e_f32s(a, line[v], sums[s][v]);
            }
        }
    }
    for &a in rest {
        let Some(line) = lines.next().and_then(|line| line[column..].first_chunk::<V>()) else { return };
        let a = simd.splat_f32s(a);
        for v in 0..V {
            sums[0][v] = simd.mul_add_e_f32s(a, line[v], sums[0][v]);
        }
    }
    for v in 0..V {
        let (a, b) = (simd.add_f32s(sums[0][v], sums[1][v]), simd.add_f32s(sums[2][v], sums[3][v]));
        y[column + v] = simd.add_f32s(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    struct Both<'a> {
        x: &'a [f32],
        w: &'a [f32],
        bias: &'a [f32],
        dy: &'a [f32],
        sizes: (usize, usize, usize),
    }

    impl pulp::WithSimd for Both<'_> {
        type Output = (Vec<f32>, Vec<f32>, Vec<f32>);
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (rows, inner, width) = self.sizes;
            let mut y = vec![0.0; rows * width];
            forward(simd, (self.x, inner, inner), self.w, Some(self.bias), width, &mut y);
            let mut g = vec![1.0; inner * width];
            weight_gradient(simd, (self.x, inner, inner), self.dy, width, &mut g);
            let mut one = vec![0.0; width];
            row(simd, &self.x[..inner - 1], self.w, self.bias, width, &mut one);
            (y, g, one)
        }
    }

    #[test]
    fn products_equal_plain_sums_at_every_level() {
        let mut random = Random::new(1, 1, 1);
        for (rows, inner, width) in [(8, 16, 16), (16, 24, 32), (64, 56, 48)] {
            let mut draw = |n: usize| -> Vec<f32> { (0..n).map(|_| random.normal()).collect() };
            let (x, w, bias, dy) = (draw(rows * inner), draw(inner * width), draw(width), draw(rows * width));
            for arch in [pulp::Arch::Scalar, pulp::Arch::new()] {
                let job = Both { x: &x, w: &w, bias: &bias, dy: &dy, sizes: (rows, inner, width) };
                let (y, g, one) = arch.dispatch(job);
                for c in 0..width {
                    for r in 0..rows {
                        let sum: f32 = (0..inner).map(|i| x[r * inner + i] * w[i * width + c]).sum();
                        assert!((y[r * width + c] - sum - bias[c]).abs() < 1e-4);
                    }
                    let without_last: f32 = (0..inner - 1).map(|i| x[i] * w[i * width + c]).sum();
                    assert!((one[c] - without_last - bias[c]).abs() < 1e-4);
                    for i in 0..inner {
                        let sum: f32 = (0..rows).map(|r| x[r * inner + i] * dy[r * width + c]).sum();
                        assert!((g[i * width + c] - sum - 1.0).abs() < 1e-4);
                    }
                }
            }
        }
    }
}
