//! One frame as code.

use super::{Layer, Pipeline, Settings};
use crate::surface_layers::SurfaceImages;
use crate::{FrameInputs, Stats, StrategyError};
use lightloom_graph::{Graph, Handle, Texture};
use lightloom_passes::scene::{SceneHandles, SceneInfo};
use lightloom_passes::{
    AmbientOcclusion, CameraUniform, DepositCull, DirectSettings, GBuffer, PathSettings, PhotonSettings, Photons, Rsm,
};

/// What a frame is declared from.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The scene in this frame's graph.
    pub scene: &'a SceneHandles,
    /// The scene's extent and light.
    pub info: &'a SceneInfo,
    /// The eye, with this frame's jitter; its size is the image's.
    pub camera: &'a CameraUniform,
    /// Everything else; the size in it is not used here.
    pub settings: &'a Settings,
    /// Frames since the image began, from 0.
    pub frame_index: u32,
}

/// A layer of light (rgba32float, W·m⁻²·sr⁻¹).
#[derive(Debug)]
pub struct LightLayer {
    /// The mean over the frames so far; the frame itself if only one is asked for.
    pub mean: Handle<Texture>,
    /// Sum of squared deviations from it; `None` if only one frame is asked for, or if each was filtered with those before it. After n frames the standard error of the mean is
    /// √(deviations / (n (n − 1))).
    pub deviations: Option<Handle<Texture>>,
}

/// What a declared frame offers. Read back or show some of it: the passes of the rest are culled.
#[derive(Debug)]
pub struct FrameLayers {
    /// Emitted, direct and indirect light.
    pub final_radiance: LightLayer,
    /// Emitted light, and light straight from a light.
    pub direct: LightLayer,
    /// Light scattered before.
    pub indirect: LightLayer,
    /// The part of it that only specular surfaces scattered before; `None` if the strategy does not tell it apart.
    pub caustic: Option<LightLayer>,
    /// Base colour, normal, distance.
    pub surfaces: SurfaceImages,
    /// The photons, for strategies that use them.
    pub photons: Option<Photons>,
    /// The strategy's counts.
    pub stats: Vec<Stats>,
    /// Counts for the strategy itself: read them back and hand them to [`Strategy::observe`](crate::Strategy::observe).
    pub measures: Option<Stats>,
}

impl FrameLayers {
    /// The image of a layer of light.
    pub fn light(&self, layer: Layer) -> Option<&LightLayer> {
        match layer {
            Layer::Final => Some(&self.final_radiance),
            Layer::Direct => Some(&self.direct),
            Layer::Indirect => Some(&self.indirect),
            Layer::Caustic => self.caustic.as_ref(),
            Layer::Albedo | Layer::Normal | Layer::Depth => None,
        }
    }

    /// The image of a layer of surfaces.
    pub fn surface(&self, layer: Layer) -> Option<&Handle<Texture>> {
        match layer {
            Layer::Albedo => Some(&self.surfaces.albedo),
            Layer::Normal => Some(&self.surfaces.normal),
            Layer::Depth => Some(&self.surfaces.depth),
            Layer::Final | Layer::Direct | Layer::Indirect | Layer::Caustic => None,
        }
    }
}

impl Pipeline {
    /// Declares one frame; runs nothing and needs no device. `gbuffer`: an engine's own; `None` has it rasterised here.
    pub fn declare_frame(
        &mut self,
        graph: &mut Graph<'_>,
        frame: &Frame<'_>,
        gbuffer: Option<GBuffer>,
    ) -> Result<FrameLayers, StrategyError> {
        let Frame { scene, info, camera, settings, frame_index } = *frame;
        let seed = settings.frame_seed(frame_index);

        let (gbuffer, visibility) = if let Some(gbuffer) = gbuffer {
            (gbuffer, None)
        } else {
            let visibility = self.visibility.add(graph, scene, camera, info.triangle_count);
            (self.gbuffer.add(graph, scene, camera, &visibility), Some(visibility))
        };
        let surfaces = self.surface.add(graph, camera, &gbuffer);
        let photons = self.strategy.uses_photons().then(|| {
            let mut wanted = settings.photon_settings(frame_index);
            wanted.cull = self.strategy.reach_m(info, wanted.emitted).map(|reach_m| DepositCull::new(camera, reach_m));
            wanted.caustics_only = self.strategy.caustics_only();
            wanted.light_vertices = self.strategy.light_vertices();
            self.trace_photons(graph, frame, &wanted)
        });
        let photons = photons.transpose()?;

        let inputs = FrameInputs {
            scene,
            info,
            gbuffer: &gbuffer,
            photons: photons.as_ref(),
            camera,
            size: camera.size,
            frame_index,
            seed,
            max_bounces: settings.bounces,
            deterministic: settings.deterministic,
        };
        let mut estimate = self.strategy.declare(graph, &inputs)?;
        let mut openness = None;
        if let Some(wanted) = settings.ambient_occlusion {
            let occlusion = match &mut self.occlusion {
                Some(occlusion) => occlusion,
                none => none.insert(AmbientOcclusion::new(&self.sources)?),
            };
            openness = Some(occlusion.add(graph, scene, camera, &gbuffer, wanted, seed, frame_index));
        }
        let seen = (&gbuffer, visibility.as_ref());
        self.filtering.add(graph, &self.sources, frame, seen, &mut estimate, &mut openness)?;
        let direct = estimate.direct.unwrap_or_else(|| {
            let sampling = DirectSettings { seed, frame: frame_index, emissive_samples: settings.emissive_samples };
            self.direct.add(graph, scene, info, camera, &gbuffer, sampling)
        });
        let indirect = if estimate.covers_specular || !scene.traits.specular() {
            estimate.indirect
        } else {
            let path = PathSettings { seed, frame: frame_index, max_bounces: settings.bounces };
            self.specular.add(graph, scene, info, camera, &gbuffer, &estimate.indirect, path)
        };
        let sum = self.compose.add(graph, camera.size, &direct, &indirect, openness.as_ref());

        let mut over_frames = |name, image| self.over_frames(graph, frame, name, image);
        Ok(FrameLayers {
            final_radiance: over_frames("final", sum),
            direct: over_frames("direct", direct),
            indirect: over_frames("indirect", indirect),
            caustic: estimate.caustic.map(|image| over_frames("caustic", image)),
            surfaces,
            photons,
            stats: estimate.stats,
            measures: estimate.measures,
        })
    }

    /// Photons as the settings have them leave the lights.
    fn trace_photons(
        &mut self,
        graph: &mut Graph<'_>,
        frame: &Frame<'_>,
        wanted: &PhotonSettings,
    ) -> Result<Photons, StrategyError> {
        let Frame { scene, info, settings, .. } = *frame;
        let Some(maps) = settings.emission_maps else {
            return Ok(self.photons.add(graph, scene, info, wanted));
        };
        let rsm = match &mut self.rsm {
            Some(rsm) => rsm,
            none => none.insert(Rsm::new(&self.sources)?),
        };
        let maps = rsm.add(graph, scene, info, maps);
        Ok(self.photons.add_from(graph, scene, info, wanted, &rsm.source(&maps)))
    }

    fn over_frames(&self, graph: &mut Graph<'_>, frame: &Frame<'_>, name: &str, image: Handle<Texture>) -> LightLayer {
        let wanted = frame.settings.layers.iter().any(|layer| layer.name() == name);
        if frame.settings.frames <= 1 || !wanted {
            return LightLayer { mean: image, deviations: None };
        }
        // Filtered frames remember those before them, later ones more: the nth of them has the weight n, and what one brought alone has
        // nearly the same in the mean as what every other did. They are not independent, so that their deviations tell no error.
        let filtered = frame.settings.filter.is_some() && name != Layer::Direct.name();
        let n = frame.frame_index as f32 + 1.0;
        let share = if filtered { 2.0 / (n + 1.0) } else { 1.0 / n };
        let sums = self.accumulate.add(graph, name, frame.camera.size, &image, share);
        LightLayer { mean: sums.mean, deviations: (!filtered).then_some(sums.deviations) }
    }
}
