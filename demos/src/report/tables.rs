//! The table of strategies.

use crate::format::{bytes, count, number, ratio};
use crate::report::escape;
use crate::results::{Results, StrategyResult};

/// One row per strategy; the best of each column that has a best is marked.
pub(crate) fn strategies(results: &Results) -> String {
    let heads = [
        ("strategy", ""),
        ("relMSE", "mean of (x − r)² / (r² + 0.01)"),
        ("mean ratio", "mean of the image over mean of the reference; 1 is right"),
        ("FLIP", "perceived difference of the shown images, 0 to 1"),
        ("GPU ms", "device time of one frame"),
        ("memory", "transient memory held on the device"),
        ("photons stored", "of those emitted, all bounces"),
        ("dropped", "records that found the buffer full"),
        ("flux in W", "emitted, mean of the channels"),
        ("absorbed", "share of the emitted flux"),
        ("escaped", "share of the emitted flux"),
        ("ended", "share ended by roulette or depth"),
    ];
    let cell = |(name, title): &(&str, &str)| format!("<th scope=col title=\"{}\">{name}</th>", escape(title));
    let head: String = heads.iter().map(cell).collect();
    let best = Best::of(&results.strategies);
    let rows: String = results.strategies.iter().map(|row| line(row, &best)).collect();
    format!("<div class=scroll><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n")
}

/// The smallest value of each column where smaller is better.
struct Best {
    relmse: Option<f64>,
    flip: Option<f64>,
    gpu_ms: Option<f64>,
}

impl Best {
    fn of(rows: &[StrategyResult]) -> Self {
        let least = |value: fn(&StrategyResult) -> Option<f64>| {
            // A best of one is no news.
            let values = rows.iter().filter_map(value);
            if rows.len() < 2 { None } else { values.min_by(f64::total_cmp) }
        };
        Self { relmse: least(|row| row.relmse), flip: least(|row| row.flip), gpu_ms: least(|row| row.gpu_ms) }
    }
}

fn line(row: &StrategyResult, best: &Best) -> String {
    let cell = |text: String, is_best: bool| {
        let class = if is_best { " class=best" } else { "" };
        format!("<td{class}>{text}</td>")
    };
    // As shown: what reads the same is the same.
    let is_best = |value: Option<f64>, best: Option<f64>| best.is_some() && number(value) == number(best);
    let mean = |channels: [f64; 3]| channels.iter().sum::<f64>() / 3.0;
    let emitted = mean(row.flux.emitted);
    let share = |channels: [f64; 3]| {
        if emitted > 0.0 { format!("{:.1} %", 100.0 * mean(channels) / emitted) } else { "–".to_owned() }
    };
    let photons = row.photons.emitted > 0;
    let counted = |value: u64| {
        if photons { count(value) } else { "–".to_owned() }
    };
    let cells = [
        cell(number(row.relmse), is_best(row.relmse, best.relmse)),
        cell(ratio(row.mean_ratio), false),
        cell(number(row.flip), is_best(row.flip, best.flip)),
        cell(number(row.gpu_ms), is_best(row.gpu_ms, best.gpu_ms)),
        cell(bytes(row.bytes), false),
        cell(counted(row.photons.stored), false),
        cell(counted(row.photons.dropped), false),
        cell(number((emitted > 0.0).then_some(emitted)), false),
        cell(share(row.flux.absorbed), false),
        cell(share(row.flux.escaped), false),
        cell(share(row.flux.terminated), false),
    ];
    format!("<tr><th scope=row>{}</th>{}</tr>\n", escape(&row.name), cells.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_error_is_marked_and_the_rest_is_not() {
        let row =
            |name: &str, relmse| StrategyResult { name: name.to_owned(), relmse: Some(relmse), ..StrategyResult::default() };
        let results = Results { strategies: vec![row("a", 0.5), row("b", 0.25)], ..Results::default() };
        let table = strategies(&results);
        assert!(table.contains("<td class=best>0.250</td>"), "{table}");
        assert!(table.contains("<td>0.500</td>"), "{table}");
        let tie = Results { strategies: vec![row("a", 0.25), row("b", 0.250_01)], ..Results::default() };
        assert_eq!(strategies(&tie).matches("class=best").count(), 2, "what reads the same is the same");
    }
}
