//! Bars for times and memory.

use crate::format::{bytes, number};
use crate::report::escape;
use crate::results::{PassTime, Results};

/// Device time of each pass, on one scale for all strategies.
pub(crate) fn times(results: &Results) -> String {
    let charts: Vec<(&str, Option<f64>, Vec<Row>)> =
        results.strategies.iter().map(|s| (s.name.as_str(), s.gpu_ms, merged(&s.passes))).collect();
    let longest = charts.iter().flat_map(|(_, _, rows)| rows).map(|row| row.value).fold(0.0, f64::max);
    if longest <= 0.0 {
        return "<p class=note>This adapter has no clock, so there are no times per pass.</p>\n".to_owned();
    }
    let mut html =
        format!("<p class=note>One frame, in ms; the bars of all strategies have one scale. {}</p>\n", escape(&results.timing));
    for (name, total, rows) in charts {
        html.push_str(&format!("<h3>{} <small>{} ms</small></h3>\n", escape(name), number(total)));
        html.push_str(&bars(&rows, longest));
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
        html.push_str(&format!("<h3>{}</h3>\n", escape(&strategy.name)));
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

/// Passes of one name as one row, in the order of their first run: long work is split into many dispatches.
fn merged(passes: &[PassTime]) -> Vec<Row> {
    let mut groups: Vec<(&str, usize, f64)> = Vec::new();
    for pass in passes {
        let name = pass.name.split('#').next().unwrap_or(&pass.name);
        let ms = pass.gpu_ms.unwrap_or(0.0);
        match groups.iter_mut().find(|group| group.0 == name) {
            Some(group) => {
                group.1 += 1;
                group.2 += ms;
            }
            None => groups.push((name, 1, ms)),
        }
    }
    let row = |(name, count, ms): (&str, usize, f64)| Row {
        label: if count > 1 { format!("{name} ×{count}") } else { name.to_owned() },
        text: number(Some(ms)),
        value: ms,
        class: "time",
    };
    groups.into_iter().map(row).collect()
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

    #[test]
    fn passes_of_one_name_become_one_row() {
        let pass = |name: &str, ms| PassTime { name: name.to_owned(), gpu_ms: Some(ms) };
        let rows = merged(&[pass("trace", 1.0), pass("gather", 2.0), pass("gather#2", 3.0)]);
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[1].label.as_str(), rows[1].value), ("gather ×2", 5.0));
    }

    #[test]
    fn the_longest_bar_is_full() {
        let row = |value| Row { label: String::new(), text: String::new(), value, class: "time" };
        let html = bars(&[row(4.0), row(1.0)], 4.0);
        assert!(html.contains("width:100.00%") && html.contains("width:25.00%"), "{html}");
    }
}
