//! The text of each kernel.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::legendre::{diagonal, gauss_legendre, reduced_column, step};
use crate::tensor::{band_and_m, tripling_entries};

/// One line of text; writing into a string cannot fail.
macro_rules! line {
    ($out:expr, $($arg:tt)*) => { writeln!($out, $($arg)*).unwrap_or(()) };
}

/// `basis_n`: y_i of a direction, column by column in m (P.-P. Sloan, Efficient Spherical Harmonic Evaluation, 2013).
pub(crate) fn basis(out: &mut String, order: usize) {
    line!(out, "#[inline(always)]");
    line!(out, "#[allow(unused_variables)]");
    line!(out, "pub(crate) fn basis_{order}<T: Real>([x, y, z]: [T; 3]) -> [[T; {order}]; {order}] {{");
    for m in 0..order {
        if m == 1 {
            line!(out, "let (c1, s1) = (x, y);");
        } else if m > 1 {
            let k = m - 1;
            line!(out, "let (c{m}, s{m}) = ((x * c{k}).less(y, s{k}), x.mul_add(s{k}, y * c{k}));");
        }
        for l in m..order {
            let d = diagonal(m);
            if l == m {
                line!(out, "let p{l}_{m} = T::of({d:?});");
            } else if l == m + 1 {
                line!(out, "let p{l}_{m} = T::of({:?}) * z;", step(l, m) * d);
            } else if l == m + 2 {
                // Both terms are known: a polynomial in z².
                let a = step(l, m) * step(l - 1, m) * d;
                let b = step(l, m) / step(l - 1, m) * d;
                if m == 0 || order > m + 2 {
                    line!(out, "let p{l}_{m} = (T::of({a:?}) * z).mul_add(z, T::of({:?}));", -b);
                }
            } else {
                let (a, b) = (step(l, m), step(l, m) / step(l - 1, m));
                let (k, j) = (l - 1, l - 2);
                line!(
                    out,
                    "let p{l}_{m} = (T::of({a:?}) * z).mul_add(p{k}_{m}, T::of({:?}) * p{j}_{m});",
                    -b
                );
            }
        }
    }
    let name = |index: usize| match band_and_m(index) {
        (l, 0) => format!("p{l}_0"),
        (l, m) if m > 0 => format!("p{l}_{m} * c{m}"),
        (l, m) => format!("p{l}_{} * s{}", -m, -m),
    };
    rows(out, order, name);
}

/// The closing expression of a kernel: coefficients in rows of `order`.
fn rows(out: &mut String, order: usize, name: impl Fn(usize) -> String) {
    line!(out, "[");
    for row in 0..order {
        let entries: Vec<String> = (0..order).map(|column| name(row * order + column)).collect();
        line!(out, "[{}],", entries.join(", "));
    }
    line!(out, "]");
    line!(out, "}}");
}

fn load(out: &mut String, order: usize, name: &str) {
    for i in 0..order * order {
        line!(out, "let {name}{i} = {name}[{}][{}];", i / order, i % order);
    }
}

/// j ≤ k, and each output i with its Γ_ijk.
type Pair = (usize, usize, Vec<(usize, f64)>);

/// All pairs that some output needs.
fn pairs(order: usize) -> Vec<Pair> {
    let n = order * order;
    let mut by_pair = vec![Vec::new(); n * n];
    for entry in tripling_entries(order) {
        let t = [entry.i, entry.j, entry.k];
        let mut seen = Vec::new();
        for (a, b, c) in [(0, 1, 2), (1, 0, 2), (2, 0, 1)] {
            let key = (t[a], t[b].min(t[c]), t[b].max(t[c]));
            if !seen.contains(&key) {
                seen.push(key);
                by_pair[key.1 * n + key.2].push((key.0, entry.value));
            }
        }
    }
    let mut all = Vec::new();
    for j in 0..n {
        for k in j..n {
            let mut outputs = by_pair[j * n + k].clone();
            outputs.sort_by_key(|output| output.0);
            if !outputs.is_empty() {
                all.push((j, k, outputs));
            }
        }
    }
    all
}

/// The body shared by product and square; `pair` writes the symmetric product of coefficients j and k.
fn gather(out: &mut String, order: usize, pair: impl Fn(usize, usize) -> String) {
    let mut begun = vec![false; order * order];
    for (j, k, outputs) in pairs(order) {
        line!(out, "let p = {};", pair(j, k));
        for (i, gamma) in outputs {
            if begun[i] {
                line!(out, "o{i} = p.mul_add(T::of({gamma:?}), o{i});");
            } else {
                line!(out, "let mut o{i} = p * T::of({gamma:?});");
                begun[i] = true;
            }
        }
    }
    rows(out, order, |index| format!("o{index}"));
}

/// `product_n`: Σ Γ_ijk f_j g_k in pair form.
pub(crate) fn product(out: &mut String, order: usize) {
    line!(out, "#[inline(always)]");
    line!(out, "#[allow(unused_mut, unused_variables)]");
    line!(
        out,
        "pub(crate) fn product_{order}<T: Real>(f: &[[T; {order}]; {order}], g: &[[T; {order}]; {order}]) -> [[T; {order}]; {order}] {{"
    );
    load(out, order, "f");
    load(out, order, "g");
    gather(out, order, |j, k| {
        if j == k { format!("f{j} * g{j}") } else { format!("f{j}.mul_add(g{k}, f{k} * g{j})") }
    });
}

/// `square_n`: the product of a vector with itself.
pub(crate) fn square(out: &mut String, order: usize) {
    line!(out, "#[inline(always)]");
    line!(out, "#[allow(unused_mut, unused_variables)]");
    line!(
        out,
        "pub(crate) fn square_{order}<T: Real>(f: &[[T; {order}]; {order}]) -> [[T; {order}]; {order}] {{"
    );
    load(out, order, "f");
    for i in 0..order * order {
        line!(out, "let d{i} = f{i} + f{i};");
    }
    gather(out, order, |j, k| if j == k { format!("f{j} * f{j}") } else { format!("d{j} * f{k}") });
}

/// y_i of a direction, for the quadrature of the quarter turn.
fn values(order: usize, [x, y, z]: [f64; 3]) -> Vec<f64> {
    let mut all = vec![0.0; order * order];
    let (mut c, mut s) = (1.0, 0.0);
    for m in 0..order {
        for (above, p) in reduced_column(order, m, z).into_iter().enumerate() {
            let l = m + above;
            all[l * l + l + m] = p * c;
            if m > 0 {
                all[l * l + l - m] = p * s;
            }
        }
        (c, s) = (x * c - y * s, x * s + y * c);
    }
    all
}

/// X₊₉₀, which takes y to z and z to −y, row by row.
fn quarter_turn(order: usize) -> Vec<f64> {
    let n = order * order;
    let mut matrix = vec![0.0; n * n];
    for (z, weight) in gauss_legendre(16) {
        for step in 0..32 {
            let angle = 2.0 * PI * (f64::from(step) + 0.5) / 32.0;
            let r = (1.0 - z * z).sqrt();
            let (x, y) = (r * angle.cos(), r * angle.sin());
            let (here, before) = (values(order, [x, y, z]), values(order, [x, z, -y]));
            for i in 0..n {
                for j in 0..n {
                    matrix[i * n + j] += weight * (2.0 * PI / 32.0) * here[i] * before[j];
                }
            }
        }
    }
    matrix
}

/// New values of all coefficients from a sparse matrix, whose entry (i, j) is `matrix[i · rows + j · columns]`.
fn apply(out: &mut String, order: usize, matrix: &[f64], (rows, columns): (usize, usize)) {
    let n = order * order;
    let mut names = Vec::new();
    let mut values = Vec::new();
    for i in 0..n {
        let mut text = String::new();
        for j in 0..n {
            let value = matrix[i * rows + j * columns];
            if band_and_m(i).0 != band_and_m(j).0 || value.abs() < 1e-10 {
                continue;
            }
            text = if !text.is_empty() {
                format!("T::of({value:?}).mul_add(f{j}, {text})")
            } else if (value - 1.0).abs() < 1e-10 {
                format!("f{j}")
            } else if (value + 1.0).abs() < 1e-10 {
                format!("-f{j}")
            } else {
                format!("T::of({value:?}) * f{j}")
            };
        }
        if text != format!("f{i}") {
            names.push(format!("f{i}"));
            values.push(text);
        }
    }
    if !names.is_empty() {
        line!(out, "let ({},) = ({},);", names.join(", "), values.join(", "));
    }
}

/// `rotate_n`: Z_α X₋₉₀ Z_β X₊₉₀ Z_γ, from (cos α, sin α) and the same of β and γ.
pub(crate) fn rotate(out: &mut String, order: usize) {
    let n = order * order;
    let matrix = quarter_turn(order);
    line!(out, "#[inline(always)]");
    line!(out, "#[allow(unused_variables)]");
    line!(
        out,
        "pub(crate) fn rotate_{order}<T: Real>(f: &[[T; {order}]; {order}], turns: &[[T; 2]; 3]) -> [[T; {order}]; {order}] {{"
    );
    load(out, order, "f");
    for (turn, after) in [(2, Some((n, 1))), (1, Some((1, n))), (0, None)] {
        if order > 1 {
            line!(out, "let [c1, s1] = turns[{turn}];");
        }
        for m in 2..order {
            let k = m - 1;
            line!(out, "let (c{m}, s{m}) = ((c1 * c{k}).less(s1, s{k}), c1.mul_add(s{k}, s1 * c{k}));");
        }
        for l in 1..order {
            for m in 1..=l {
                let (minus, plus) = (l * l + l - m, l * l + l + m);
                line!(
                    out,
                    "let (f{minus}, f{plus}) = (c{m}.mul_add(f{minus}, s{m} * f{plus}), (c{m} * f{plus}).less(s{m}, f{minus}));"
                );
            }
        }
        if let Some(strides) = after {
            apply(out, order, &matrix, strides);
        }
    }
    rows(out, order, |i| format!("f{i}"));
}
