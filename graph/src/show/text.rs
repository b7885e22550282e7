//! Words and numbers of the page.

/// Text with the characters that mean something in HTML written out.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // XML knows no such characters, and a browser shows none of them.
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Bytes in KiB, MiB or GiB.
pub(super) fn bytes(bytes: u64) -> String {
    let value = bytes as f64;
    match bytes {
        0..1024 => format!("{bytes} B"),
        1024..0x10_0000 => format!("{:.1} KiB", value / 1024.0),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", value / f64::from(1 << 20)),
        _ => format!("{:.2} GiB", value / f64::from(1 << 30)),
    }
}

/// Milliseconds with three significant digits, in µs where they are few.
pub(super) fn time(ms: f64) -> String {
    let (value, unit) = if ms < 1.0 { (ms * 1e3, "µs") } else { (ms, "ms") };
    let digits = usize::from(value < 100.0) + usize::from(value < 10.0);
    format!("{value:.digits$} {unit}")
}

/// The first `most` characters, an ellipsis for the last where there are more.
pub(super) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let mut short: String = text.chars().take(most.saturating_sub(1)).collect();
    short.push('…');
    short
}

/// The next of 1, 2, 5 · 10ⁿ at or above `value`.
pub(super) fn round_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 1.0;
    }
    let power = 10_f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= value * 0.999_999).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_written_out() {
        assert_eq!(escape("<a href=\"x\">&'\u{1}"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39; ");
    }

    #[test]
    fn units_follow_the_size() {
        assert_eq!([bytes(1023), bytes(1024), bytes(3 << 30)], ["1023 B", "1.0 KiB", "3.00 GiB"]);
        assert_eq!([time(0.001_234), time(0.5), time(12.34), time(123.4)], ["1.23 µs", "500 µs", "12.3 ms", "123 ms"]);
    }

    #[test]
    fn long_names_end_in_an_ellipsis() {
        assert_eq!(shorten("abcdef", 6), "abcdef");
        assert_eq!(shorten("abcdefg", 6), "abcde…");
        assert_eq!(shorten("abc", 0), "…");
    }

    #[test]
    fn axes_end_at_round_numbers() {
        let tenths = [0.0, 0.3, 1.0, 1.1, 3.0, 7.0].map(|x| (round_up(x) * 10.0).round() as u32);
        assert_eq!(tenths, [10, 5, 10, 20, 50, 100]);
    }
}
