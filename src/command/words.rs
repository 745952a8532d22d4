//! Numbers as people read them.

/// `0.42 s`, `12.3 s`, `4 min 05 s`, `2 h 13 min`.
pub(crate) fn seconds(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match seconds {
        s if s < 10.0 => format!("{s:.2} s"),
        s if s < 99.95 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// `12.3 MB`, in powers of ten.
pub(crate) fn bytes(bytes: u64) -> String {
    let b = bytes as f64;
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", b / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", b / 1e6),
        _ => format!("{:.2} GB", b / 1e9),
    }
}

/// `1 sample`, `64 samples`, `12.5 samples`.
pub(crate) fn count(number: f64, noun: &str) -> String {
    let number_text = if number.fract() == 0.0 { format!("{number:.0}") } else { format!("{number:.1}") };
    format!("{number_text} {noun}{}", if number == 1.0 { "" } else { "s" })
}

/// Three significant digits, for tables: `0.00123`, `12.3`, `1.2e-6`.
pub(crate) fn figure(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let magnitude = x.abs().log10().floor() as i32;
    match magnitude {
        -4..=2 => format!("{x:.*}", (2 - magnitude) as usize),
        3..=5 => format!("{x:.0}"),
        _ => format!("{x:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_sizes_and_figures_read_well() {
        assert_eq!(
            [0.417, 12.34, 99.97, 245.0, 7980.0].map(seconds),
            ["0.42 s", "12.3 s", "1 min 40 s", "4 min 05 s", "2 h 13 min"]
        );
        assert_eq!(
            [999, 1_500, 12_300_000, 2_000_000_000].map(bytes),
            ["999 B", "1.5 kB", "12.3 MB", "2.00 GB"]
        );
        assert_eq!([1.0, 64.0, 12.5].map(|n| count(n, "sample")), ["1 sample", "64 samples", "12.5 samples"]);
        assert_eq!(
            [0.0, 1.234e-3, 12.345, 12345.6, 1.2e-7].map(figure),
            ["0", "0.00123", "12.3", "12346", "1.20e-7"]
        );
    }
}
