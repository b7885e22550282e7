//! Bars for times and memory.

use crate::format::{bytes, number};
use crate::report::escape;
use crate::results::Results;
use std::fmt::Write as _;

/// Device time of the strategies on one scale, then of each strategy's passes on a scale of its own: brute force would
/// leave nothing to see of the others.
pub(crate) fn times(results: &Results) -> String {
    let time =
        |name: &str, ms: Option<f64>| Row { label: name.to_owned(), text: number(ms), value: ms.unwrap_or(0.0), class: "time" };
    let totals: Vec<Row> = results.strategies.iter().map(|s| time(&s.name, s.gpu_ms)).collect();
    if totals.iter().all(|row| row.value <= 0.0) {
        return "<p class=note>This adapter has no clock, so there are no times per pass.</p>\n".to_owned();
    }
    let note = format!("<p class=note>Device time of one frame in ms, measured by {}.</p>\n", escape(&results.timing));
    let mut html = format!("{note}<h3>Strategies <small>on one scale</small></h3>\n{}", bars(&totals, longest(&totals)));
    for strategy in &results.strategies {
        let rows: Vec<Row> = strategy.passes.iter().map(|pass| time(&pass.name, pass.gpu_ms)).collect();
        let total = number(strategy.gpu_ms);
        let _ = writeln!(html, "<h3>{} <small>{total} ms</small></h3>", escape(&strategy.name));
        html.push_str(&bars(&rows, longest(&rows)));
    }
    html
}

/// Transient memory of each strategy: without sharing, as held, and the lower bound.
pub(crate) fn memory(results: &Results) -> String {
    let most = results.strategies.iter().map(|s| s.memory.unshared_bytes).max().unwrap_or(0);
    let mut html =
        "<p class=note>Transient resources of one frame. Unshared: each has memory of its own. Pooled: what the frame \
                    holds, resources of one shape taking turns. Live: the most that is in use at one time, the lower bound.</p>\n"
            .to_owned();
    for strategy in &results.strategies {
        let row =
            |label: &str, class, value: u64| Row { label: label.to_owned(), text: bytes(value), value: value as f64, class };
        let rows = [
            row("unshared", "unshared", strategy.memory.unshared_bytes),
            row("pooled", "pooled", strategy.memory.pooled_bytes),
            row("live", "live", strategy.memory.peak_live_bytes),
        ];
        let _ = writeln!(html, "<h3>{}</h3>", escape(&strategy.name));
        html.push_str(&bars(&rows, most as f64));
    }
    html
}

struct Row {
    label: String,
    text: String,
    value: f64,
    class: &'static str,
}

fn longest(rows: &[Row]) -> f64 {
    rows.iter().map(|row| row.value).fold(0.0, f64::max)
}

fn bars(rows: &[Row], full: f64) -> String {
    let bar = |row: &Row| {
        let percent = if full > 0.0 { 100.0 * row.value / full } else { 0.0 };
        format!(
            "<div class=bar><span>{}</span><i><b class={} style=\"width:{percent:.2}%\"></b></i><em>{}</em></div>\n",
            escape(&row.label),
            row.class,
            escape(&row.text)
        )
    };
    let bars: String = rows.iter().map(bar).collect();
    format!("<div class=bars>\n{bars}</div>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{PassTime, StrategyResult};

    #[test]
    fn a_strategys_passes_have_a_scale_of_their_own() {
        let strategy = |name: &str, ms: f64| StrategyResult {
            name: name.to_owned(),
            gpu_ms: Some(ms),
            passes: vec![PassTime { name: "gather".to_owned(), gpu_ms: Some(ms) }],
            ..StrategyResult::default()
        };
        let results = Results { strategies: vec![strategy("a", 1.0), strategy("b", 100.0)], ..Results::default() };
        let html = times(&results);
        assert_eq!(html.matches("width:100.00%").count(), 3, "b among the strategies, and each strategy's longest pass: {html}");
        assert_eq!(html.matches("width:1.00%").count(), 1, "a among the strategies: {html}");
    }

    #[test]
    fn without_a_clock_there_are_no_bars() {
        let strategy = StrategyResult { name: "a".to_owned(), ..StrategyResult::default() };
        let html = times(&Results { strategies: vec![strategy], ..Results::default() });
        assert!(html.contains("no clock") && !html.contains("class=bar"), "{html}");
    }

    #[test]
    fn the_longest_bar_is_full() {
        let row = |value| Row { label: String::new(), text: String::new(), value, class: "time" };
        let html = bars(&[row(4.0), row(1.0)], 4.0);
        assert!(html.contains("width:100.00%") && html.contains("width:25.00%"), "{html}");
    }
}
