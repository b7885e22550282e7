//! Caustics in light space: photons splatted into maps of what the lights would see, and the maps projected on the scene like shadow maps.
//!
//! ```text
//! for each view V of a light:                                          # a spot or the sun: one, a point: six
//!     receivers[V] = rasterised scene, but for all that refracts or mirrors
//! for each photon P whose earlier scatterings were all specular:
//!     V = views of a light that sees P                                 # of several, the one whose texels are smallest there
//!     D = diameter of the splat                                        # fixed, or that of the photon's beam
//!     W = Σ k(x, P)                                                    # over the texels x of V in reach of D, on the surface of P
//!     for each such texel x:  flux[x] += Φ_P k(x, P) / W               # atomically
//! for each texel x:   E[x] = flux[x] / a_x                             # a_x: area of the receiver that x holds
//! for each pixel:     image = Σ_V E[V, where V shows the pixel's point] R / π
//! ```
//!
//! [WD08]. **It estimates caustics and nothing else**: `indirect` is the caustic layer, other indirect light is black, and only photons whose first
//! scattering is specular are followed ([`Strategy::caustics_only`]); what meets no specular surface ends there and is never splatted. In a
//! frame composed with another strategy such photons lie in the store, too, and are passed over. Pixels that show mirrors and glass are
//! path-traced by the pipeline as for every strategy.
//!
//! **Maps.** They hold the surfaces behind glass and mirrors, for that is where photons land; the paper draws them as the light sees them and moves
//! photons over. Which light a photon came from no record tells, and it does not matter: a map is a chart of the surfaces, every photon is put
//! on one light's map, and pixels take the sum of all. Photons that no light would see, behind an occluder or on surfaces turned away, are
//! counted in `photons_unseen`, and their light is missing. Emissive surfaces and environments have no one place to look from, and so no
//! maps: their caustics are found where some point, spot or directional light looks. A scene without those has none; the
//! [choice](Strategy::choice) says so. `screen-space` knows no such bounds.
//!
//! **Flux.** Weights are divided by their sum over the very texels that take part, so that Σ E a over all maps is the flux of the photons seen, to
//! rounding. Splats near an edge between faces of a cube lie on both. The area of a texel includes the tilt of its receiver, in closed form.
//!
//! **Splats.** The kernel is a bell, exp(−8 d²/D²) within D/2. Diameters are clamped from 3 texels, within which the four around any point lie, to
//! `most`. By ray differentials ([Igehy99]) `D = spread √(A / a)`, A the area that the photon's share of its light covers where it lands, a that of a
//! texel: any number of interfaces and mirrors, both principal curvatures. By the equation of lenses ([WD08] Eq. 7)
//! `D = |d_front / (d_front + d_bg) · (d_bg − d_image) / d_image| D₀`, `D₀ = spread` times the breadth (texels) of that share if nothing stood in its
//! way; a thick lens bends at both its faces. The beam of a photon is that of all the light that went its way: of a ray that glass reflects, one in
//! twenty, the neighbours are farther away than it says, and such light stays grainy.
//!
//! **Bias.** By the breadth of the splats, and by pixels between texels; consistent as texels and splats shrink. E knows no direction: Lambertian
//! surfaces reflect it as they should, glossy ones as if it came evenly from all around.
//!
//! **Four splats.** `multi-resolution` splats each photon four times in one pass, into four sums of luminance and four counts, from which each
//! texel chooses what it takes of the four kernels. [WD08] shows the sums so blended. As a smaller splat is taken only where it is brighter, and the broader
//! ones around keep what they have, that adds light, with a million photons a fifth of the caustics of `builtin:caustics`. Here photons are splatted once more, by what the texels take of them,
//! divided by its sum: the same shapes, and the flux of the photons.
//!
//! **Sums.** 64-bit fixed point by atomics on pairs of words: equal bits in every run, everywhere; overflow is counted in `texels_overflowed`. Blending by
//! the rasteriser, as in the paper, was the alternative: WebGPU blends 16-bit floats, which lose light, and its four targets hold one channel of the four
//! sums, not three.
//!
//! Bytes moved, for N photons of s = 32 or 20 bytes, K of them on a map, t texels of a splat, T texels of all views and X pixels:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | clearing | | 28 T, for `multi-resolution` 80 T |
//! | `caustic_map_view` | 108 a triangle and view | 8 T |
//! | `caustic_map_place` | s N, 32 a photon and view | 16 K |
//! | `caustic_map_lens` | (16 + s) K, two rays each | 4 K |
//! | `caustic_map_four`, `caustic_map_blend` | (16 + s + 16 t) K, 52 T | 32 t K by atomics at the most, 8 T |
//! | `caustic_map_splat` | (16 + s + 16 t) K; 16 t K more for `multi-resolution` | 12 t K by atomics |
//! | `caustic_map_resolve` | 36 T | 16 T |
//! | `caustic_map_project` | 32 X, 96 a pixel and view that shows it | 32 X |
//!
//! [WD08]: http://jgt.akpeters.com/papers/WymanDachsbacher08/ "Reducing noise in image-space caustics with variable-sized splatting, Wyman and Dachsbacher, Journal of Graphics Tools 13(1), 2008"
//! [Igehy99]: https://doi.org/10.1145/311535.311555 "Tracing ray differentials, Igehy, SIGGRAPH 1999"

mod config;
mod maps;

pub use config::{CausticMapConfig, SplatSize};

use crate::parameter::Assignment;
use crate::{DeviceTraits, Estimate, FrameInputs, Parameter, ScreenSpace, Stats, Strategy, StrategyError};
use lightloom_graph::{BufferDesc, Graph, Load, WgslSources};
use lightloom_passes::radiance_desc;
use lightloom_passes::scene::SceneInfo;
use maps::Maps;

/// The strategy `caustic-map`.
#[derive(Debug)]
pub struct CausticMap {
    /// Parameters; may change between frames.
    pub config: CausticMapConfig,
    maps: Maps,
    /// What a storage buffer of the device holds (bytes).
    buffer_bytes: u64,
    choice: Option<String>,
}

impl CausticMap {
    /// Its name in the registry.
    pub const NAME: &'static str = "caustic-map";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: CausticMapConfig::default(),
            maps: Maps::new(sources)?,
            buffer_bytes: DeviceTraits::default().limits.max_storage_buffer_binding_size,
            choice: None,
        })
    }
}

/// The maps there are, in words.
fn words(mode: SplatSize, info: &SceneInfo, side: u32) -> String {
    let views = info.light_view_count;
    let without = info.light_count > info.punctual_count;
    let caustics = "emissive surfaces and environments have none, and their caustics are found where another light looks";
    match (views, without) {
        (0, _) => format!(
            "no map: no point, spot or directional light is there to look from, so that caustics are black; `{}` needs none",
            ScreenSpace::NAME
        ),
        (_, true) => format!("{views} maps of {side}×{side} texels, splats {mode}; {caustics}"),
        (_, false) => format!("{views} maps of {side}×{side} texels, splats {mode}"),
    }
}

impl Strategy for CausticMap {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "caustics alone, photons splatted on maps of what the lights see [WD08]; biased by the splats, consistent, no other indirect light"
    }

    fn caustics_only(&self) -> bool {
        true
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        self.config.check()?;
        let side = self.config.side(frame.info.light_view_count, self.buffer_bytes)?;
        self.choice = Some(words(self.config.mode, frame.info, side));

        let mut stats = graph.buffer("caustic_map_stats", BufferDesc::words(3));
        graph.clear_buffer(&mut stats);
        let mut indirect = graph.texture("caustic_map_indirect", radiance_desc(frame.size));
        let mut caustic = graph.texture("caustic_map_caustic", radiance_desc(frame.size));
        let receivers = self.maps.add_receivers(graph, frame, side);
        let places = self.maps.add_places(graph, frame, photons, &self.config, &receivers, &mut stats);
        if frame.info.light_view_count == 0 {
            for image in [&mut indirect, &mut caustic] {
                graph.clear_texture(image, Load::Clear([0.0, 0.0, 0.0, 1.0]));
            }
        } else {
            let map = self.maps.add_map(graph, frame, photons, self.config.mode, &receivers, &places, &mut stats);
            self.maps.project(graph, frame, &receivers, &map, [&mut indirect, &mut caustic]);
        }
        let names = &["photons_seen", "photons_unseen", "texels_overflowed"];
        Ok(Estimate { caustic: Some(caustic), stats: vec![Stats::new(stats, names)], ..Estimate::new(indirect) })
    }

    fn meet_device(&mut self, device: &DeviceTraits) {
        self.buffer_bytes = device.limits.max_storage_buffer_binding_size;
    }

    fn choice(&self) -> Option<String> {
        self.choice.clone()
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.parameters()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    #[test]
    fn what_maps_there_are_is_said() {
        let with = |light_count, punctual_count, light_view_count| {
            let info = SceneInfo { light_count, punctual_count, light_view_count, ..unit_scene() };
            words(SplatSize::Fixed, &info, 256)
        };
        assert_eq!(with(2, 2, 7), "7 maps of 256×256 texels, splats fixed");
        assert!(with(3, 2, 7).contains("emissive surfaces and environments have none"), "{}", with(3, 2, 7));
        assert!(with(3, 0, 0).contains("black") && with(3, 0, 0).contains("`screen-space`"), "{}", with(3, 0, 0));
    }
}
