//! What was measured, as a page of Markdown beside the figures of the paper.

use std::fmt::Write;

/// [MML13] Table 1, Lambertian surfaces: scene, stored photons, ms of 3D bounds, 2.5D bounds, hash grid, tiles.
const MML13: [(&str, &str, [f64; 4]); 6] = [
    ("Sponza", "448 k", [25.4, 20.8, 45.7, 11.1]),
    ("Kitchen", "520 k", [13.1, 9.3, 36.0, 7.2]),
    ("Warehouse", "1,607 k", [47.8, 33.6, 77.1, 27.5]),
    ("Chess", "295 k", [14.1, 11.2, 79.7, 12.8]),
    ("Corridors", "596 k", [16.5, 3.7, 4.8, 1.3]),
    ("Pool", "586 k", [16.1, 12.1, 46.1, 19.9]),
];
/// The strategies that its columns correspond to.
const MML13_STRATEGIES: [&str; 4] = ["splat-3d", "splat-2.5d", "hash-grid", "tiled"];

/// Strategies down, scenes across.
pub(crate) struct Table {
    adapter: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<f64>)>,
}

impl Table {
    pub(crate) fn new(adapter: &str) -> Self {
        Self { adapter: adapter.to_owned(), columns: Vec::new(), rows: Vec::new() }
    }

    /// A time of the column in work.
    pub(crate) fn add(&mut self, strategy: &str, ms: f64) {
        let at = self.rows.iter().position(|(name, _)| name == strategy).unwrap_or_else(|| {
            self.rows.push((strategy.to_owned(), Vec::new()));
            self.rows.len() - 1
        });
        self.rows[at].1.push(ms);
    }

    pub(crate) fn finish_column(&mut self, scene: &str, [width, height]: [u32; 2], stored: usize) {
        self.columns.push(format!("{scene}, {width} × {height}, {} k", (stored as f64 / 1e3).round()));
    }

    pub(crate) fn markdown(&self) -> String {
        let mut page = format!(
            "# Milliseconds of the strategies\n\nOn {}, by the benchmark in `strategies/benches`, which wrote this page: a strategy's own passes \
             for one frame, without tracing the photons; all surfaces Lambertian, every photon at every pixel, constant radii. Columns: scene, image, \
             stored photons.\n\n",
            self.adapter
        );
        row(&mut page, "Strategy", self.columns.iter().cloned());
        row(&mut page, "---", self.columns.iter().map(|_| "---:".to_owned()));
        for (name, times) in &self.rows {
            row(&mut page, &format!("`{name}`"), times.iter().map(|ms| format!("{ms:.1}")));
        }
        page.push_str(
            "\n[MML13] Table 1 has these on an NVIDIA GeForce 670 at 1920 × 1080, Lambertian surfaces, a photon of k² or a pixel of k² with k = 4 and \
             filtered afterwards; its scenes but Sponza are not public, and its Sponza had other light. Columns: scene, stored photons.\n\n",
        );
        row(&mut page, "Algorithm", MML13.iter().map(|(scene, stored, _)| format!("{scene}, {stored}")));
        row(&mut page, "---", MML13.iter().map(|_| "---:".to_owned()));
        for (column, name) in MML13_STRATEGIES.iter().enumerate() {
            row(&mut page, &format!("`{name}`"), MML13.iter().map(|(_, _, times)| format!("{:.1}", times[column])));
        }
        page.push_str(
            "\n[MML13]: https://doi.org/10.1145/2448196.2448207 \"Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013\"\n",
        );
        page
    }
}

fn row(page: &mut String, head: &str, cells: impl Iterator<Item = String>) {
    let cells: Vec<_> = cells.collect();
    writeln!(page, "| {head} | {} |", cells.join(" | ")).expect("a string takes all");
}
