//! Text and numbers as the page shows them.

/// The text with the characters that mean something to HTML written out, for content and for quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(c),
        }
    }
    out
}

/// JSON for a `<script>` element, in which neither `</script` nor `<!--` may appear.
pub(super) fn script_json(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// An error, over many magnitudes: `1.23e-4`.
pub(super) fn error(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.2e}").replace('-', "−").replace("e−", "e-") }
}

/// A number of everyday size in three significant digits, without trailing zeros: `0.05`, `12.3`, `480`.
pub(super) fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "—".into() };
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-4..9).contains(&magnitude) {
        return error(value);
    }
    let decimals = (2 - magnitude).max(0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// A fraction as a signed percentage: `+0.12 %`.
pub(super) fn percent(fraction: f64) -> String {
    format!("{:+.2} %", 100.0 * fraction).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_say_enough() {
        let cases =
            [(0.05, "0.05"), (12.34, "12.3"), (480.0, "480"), (123_456.0, "123456"), (1e-7, "1.00e-7")];
        for (value, text) in cases {
            assert_eq!(plain(value), text);
        }
        assert_eq!([error(1.234e-4), error(-1.0), error(0.0)], ["1.23e-4", "−1.00e0", "0"]);
        assert_eq!(percent(-0.001_234), "−0.12 %");
    }

    #[test]
    fn nothing_of_a_text_is_markup() {
        assert_eq!(escape(r#"<b a="1">&'"#), "&lt;b a=&quot;1&quot;&gt;&amp;&#39;");
        assert!(!script_json(&serde_json::json!("</script><!--")).contains('<'));
    }
}
