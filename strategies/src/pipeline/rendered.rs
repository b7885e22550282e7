//! What a rendering brings back.

use super::Layer;
use lightloom_graph::{FrameProfile, Memory, TimingSource};
use lightloom_passes::{FluxLedger, PhotonState};

/// Images and measurements of a rendering.
#[derive(Clone, Debug, Default)]
pub struct Rendered {
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Frames averaged.
    pub frames: u32,
    /// The layers asked for, without those the strategy does not have.
    pub layers: Vec<LayerImage>,
    /// Photons of all frames together; `None` for a strategy without photons.
    pub photons: Option<PhotonReport>,
    /// GPU time of each pass, in order, summed over the frames and over passes of one name.
    pub passes: Vec<PassReport>,
    /// How the times were measured.
    pub timing: TimingSource,
    /// Times of each frame, where [`Settings::profile`](crate::Settings::profile) asks for them.
    pub profile: Vec<FrameProfile>,
    /// Transient memory of the largest frame.
    pub memory: Memory,
    /// The strategy's counts by name: the largest over the frames.
    pub stats: Vec<(String, u32)>,
    /// What the strategy chose in the last frame, and why, if it has a choice.
    pub choice: Option<String>,
    /// What a person should know, such as photons that found no room.
    pub warnings: Vec<String>,
}

impl Rendered {
    /// The image of a layer, if it was asked for and the strategy has it.
    pub fn layer(&self, layer: Layer) -> Option<&LayerImage> {
        self.layers.iter().find(|image| image.layer == layer)
    }

    /// Adds one frame's photons; `watts` is the worth of one unit of the ledger (W).
    pub(super) fn add_photons(&mut self, emitted: u32, capacity: u32, state: &PhotonState, watts: f64) {
        let frames = f64::from(self.frames.max(1));
        let report = self.photons.get_or_insert_default();
        report.emitted += u64::from(emitted);
        report.stored += u64::from(state.stored);
        report.dropped += u64::from(state.dropped);
        report.culled += u64::from(state.culled);
        report.capacity = capacity;
        let ledger = state.flux_ledger();
        let rows = [
            (ledger.emitted, &mut report.ledger.emitted, &mut report.flux.emitted),
            (ledger.absorbed, &mut report.ledger.absorbed, &mut report.flux.absorbed),
            (ledger.escaped, &mut report.ledger.escaped, &mut report.flux.escaped),
            (ledger.terminated, &mut report.ledger.terminated, &mut report.flux.terminated),
        ];
        for (units, sum, flux) in rows {
            for channel in 0..3 {
                sum[channel] += units[channel];
                flux[channel] = sum[channel] as f64 * watts / frames;
            }
        }
    }

    /// Adds one frame's counts.
    pub(super) fn add_stats(&mut self, names: &[String], counts: &[u32]) {
        for (name, &count) in names.iter().zip(counts) {
            if let Some((_, largest)) = self.stats.iter_mut().find(|(other, _)| other == name) {
                *largest = count.max(*largest);
            } else {
                self.stats.push((name.clone(), count));
            }
        }
    }

    /// Puts what was lost into words.
    pub(super) fn finish(&mut self, strategy: &str) {
        if let Some(photons) = self.photons.filter(|photons| photons.dropped > 0) {
            let PhotonReport { stored, dropped, .. } = photons;
            let all = stored + dropped;
            self.warnings.push(format!(
                "{dropped} of {all} photon records found no room and their light is missing; emit fewer (--photons)"
            ));
        }
        for (name, count) in self.stats.iter().filter(|(name, count)| name.ends_with("dropped") && *count > 0) {
            self.warnings.push(format!(
                "strategy `{strategy}`: {name} = {count}: their light is missing; raise its capacity by --set, or lower the radius"
            ));
        }
        for (name, count) in self.stats.iter().filter(|(name, count)| name.ends_with("cut") && *count > 0) {
            self.warnings.push(format!(
                "strategy `{strategy}`: {name} = {count}: the driver ended their loops early (llvmpipe allows 65,535 turns) and light is \
                 missing; lower the radius or emit fewer photons (--photons)"
            ));
        }
        for (name, count) in self.stats.iter().filter(|(name, count)| name.ends_with("overflowed") && *count > 0) {
            self.warnings.push(format!(
                "strategy `{strategy}`: {name} = {count}: pixels some 65,536 times brighter than the scene at large are too dark"
            ));
        }
        // A twentieth is seen beside the same image without a clamp.
        for (name, count) in self.stats.iter().filter(|(name, count)| name.ends_with("removed_ppm") && *count > 50_000) {
            let percent = f64::from(*count) / 1.0e4;
            self.warnings.push(format!(
                "strategy `{strategy}`: {name} = {count}: the clamp took {percent:.1} % of the indirect light; lower it by --set"
            ));
        }
    }

    /// GPU time of all passes and frames (ms); `None` if none was measured.
    pub fn gpu_ms(&self) -> Option<f64> {
        self.passes.iter().filter_map(|pass| pass.gpu_ms).reduce(|a, b| a + b)
    }
}

/// The image of one layer, in the layer's unit. Rows run from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerImage {
    /// What it shows.
    pub layer: Layer,
    /// RGB per pixel; for light, the mean over the frames.
    pub pixels: Vec<[f32; 3]>,
    /// Standard error of the mean, RGB per pixel; `None` for one frame and for surfaces.
    pub standard_error: Option<Vec<[f32; 3]>>,
}

/// What became of the photons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonReport {
    /// Photons that left the lights.
    pub emitted: u64,
    /// Records kept.
    pub stored: u64,
    /// Records that found no room.
    pub dropped: u64,
    /// Records left out because no pixel could gather them.
    pub culled: u64,
    /// Records that the store holds in each frame.
    pub capacity: u32,
    /// Where the flux went, per frame (W).
    pub flux: Flux,
    /// The same in fixed point, summed over the frames: balances to the last bit.
    pub ledger: FluxLedger,
}

/// Where the photons' flux went (W, RGB).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flux {
    /// What left the lights.
    pub emitted: [f64; 3],
    /// What surfaces took.
    pub absorbed: [f64; 3],
    /// What left the scene.
    pub escaped: [f64; 3],
    /// What roulette and the bounce limit ended.
    pub terminated: [f64; 3],
}

/// GPU time of the passes of one name.
#[derive(Clone, Debug, PartialEq)]
pub struct PassReport {
    /// The passes' name.
    pub name: String,
    /// Time (ms); `None` where it cannot be measured.
    pub gpu_ms: Option<f64>,
}

/// The name without the suffix `#2` that makes it unique in its frame.
pub(super) fn base_name(name: &str) -> &str {
    match name.rsplit_once('#') {
        Some((base, number)) if !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => name,
    }
}

/// Adds a frame's times to the report.
pub(super) fn add_times<'a>(report: &mut Vec<PassReport>, times: impl Iterator<Item = (&'a str, Option<f64>)>) {
    for (name, gpu_ms) in times {
        let name = base_name(name);
        if let Some(pass) = report.iter_mut().find(|pass| pass.name == name) {
            pass.gpu_ms = match (pass.gpu_ms, gpu_ms) {
                (Some(a), Some(b)) => Some(a + b),
                (a, b) => a.or(b),
            };
        } else {
            report.push(PassReport { name: name.to_owned(), gpu_ms });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_become_warnings_and_flux_becomes_watts() {
        let mut rendered = Rendered { frames: 2, ..Rendered::default() };
        let mut state = PhotonState { stored: 8, dropped: 2, ..PhotonState::default() };
        state.ledger[0] = 100;
        for _ in 0..2 {
            rendered.add_photons(10, 8, &state, 0.5);
        }
        let [entries, dropped] = ["entries", "tiled.entries_dropped"].map(str::to_owned);
        rendered.add_stats(&[entries.clone(), dropped.clone()], &[5, 0]);
        rendered.add_stats(&[entries.clone(), dropped.clone()], &[4, 3]);
        rendered.finish("tiled");
        let photons = rendered.photons.unwrap();
        assert_eq!((photons.emitted, photons.stored, photons.dropped, photons.ledger.emitted[0]), (20, 16, 4, 200));
        assert!((photons.flux.emitted[0] - 50.0).abs() < 1e-9, "100 units of ½ W in each frame");
        assert_eq!(rendered.stats, [(entries, 5), (dropped, 3)]);
        assert_eq!(rendered.warnings.len(), 2, "{:?}", rendered.warnings);
        assert!(rendered.warnings[0].contains("4 of 20") && rendered.warnings[1].contains("`tiled`"), "{:?}", rendered.warnings);
    }

    #[test]
    fn times_are_summed_by_name_without_suffix() {
        let mut report = Vec::new();
        add_times(&mut report, [("a", Some(1.0)), ("b", None), ("a#2", Some(2.0)), ("a#x", Some(5.0))].into_iter());
        add_times(&mut report, [("a#12", Some(4.0)), ("b", Some(3.0))].into_iter());
        let named: Vec<_> = report.iter().map(|pass| (pass.name.as_str(), pass.gpu_ms)).collect();
        assert_eq!(named, [("a", Some(7.0)), ("b", Some(3.0)), ("a#x", Some(5.0))]);
        let rendered = Rendered { passes: report, ..Rendered::default() };
        assert_eq!(rendered.gpu_ms(), Some(15.0));
    }
}
