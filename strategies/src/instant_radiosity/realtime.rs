//! One shadow ray a pixel: lights resampled among many and in time.

use super::{InstantRadiosityConfig, Lights, VirtualLight};
use crate::{FrameInputs, Settings, StrategyError};
use lightloom_graph::wgpu::Limits;
use lightloom_graph::{BufferDesc, Graph, Handle, Texture, WgslSources, shader_struct};
use lightloom_passes::{CameraUniform, SceneShader, radiance_desc};

shader_struct! {
    /// What a pixel keeps of its frames' lights, beside one of them; see `shared/light_reservoir.wgsl`.
    struct LightReservoir {
        position: [f32; 3],
        weight: f32,
        normal: u32,
        normal_geometric: u32,
        frames: f32,
        pad0: u32,
    }
}

/// Lights that a workgroup sorts.
const SORT_BLOCK: u32 = 2048;

shader_struct! {
    /// Parameters of `instant_radiosity_sort`.
    struct SortParams {
        bounds_center: [f32; 3],
        bounds_radius: f32,
        lights: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `instant_radiosity_resample`.
    struct ResampleParams {
        previous: CameraUniform,
        camera_position_world: [f32; 3],
        least2: f32,
        size: [u32; 2],
        seed: u32,
        tile: u32,
        history: f32,
        pixel_angle: f32,
        lights: u32,
        frame: u32,
        sequence_seed: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `instant_radiosity_shade`.
    struct ShadeParams {
        camera_position_world: [f32; 3],
        least2: f32,
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// The passes, and the frame that they remember. State on the device: a light and a [`LightReservoir`] a pixel, twice.
#[derive(Debug)]
pub(super) struct Realtime {
    sort: SceneShader,
    resample: SceneShader,
    shade: SceneShader,
    /// The eye of the frame before; `None`: nothing is remembered.
    previous: Option<CameraUniform>,
}

impl Realtime {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            sort: SceneShader::new(sources, "strategies/instant_radiosity_sort.wgsl")?,
            resample: SceneShader::new(sources, "strategies/instant_radiosity_resample.wgsl")?,
            shade: SceneShader::new(sources, "strategies/instant_radiosity_shade.wgsl")?,
            previous: None,
        })
    }

    /// The next frame finds no lights of earlier ones.
    pub(super) fn forget(&mut self) {
        self.previous = None;
    }

    /// Declares the passes. Returns radiance (W·m⁻²·sr⁻¹).
    pub(super) fn add(
        &mut self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        config: &InstantRadiosityConfig,
        lights: &Lights<'_>,
    ) -> Result<Handle<Texture>, StrategyError> {
        let [width, height] = frame.size;
        let pixels = u64::from(width) * u64::from(height);
        if pixels * size_of::<VirtualLight>() as u64 > Limits::defaults().max_storage_buffer_binding_size {
            return Err(StrategyError::BadSetting {
                setting: "size",
                value: format!("{width}×{height}"),
                expected: "strategy `instant-radiosity` keeps lights for at most 2796202 pixels in mode `realtime`; choose `progressive`",
            });
        }
        let mut sorted = graph.buffer("virtual_lights_sorted", lights.made.desc().clone());
        let params = SortParams {
            bounds_center: frame.info.bounds_center.to_array(),
            bounds_radius: frame.info.bounds_radius.max(f32::MIN_POSITIVE),
            lights: lights.wanted,
            ..SortParams::default()
        };
        graph
            .compute(&self.sort.variant(frame.scene))
            .params(&params)
            .read("lights_made", &lights.made)
            .read("photon_state", &lights.photons.state)
            .write("lights_sorted", &mut sorted)
            .dispatch([lights.wanted.div_ceil(SORT_BLOCK), 1, 1]);

        let camera_position_world = frame.camera_position_world();
        let least2 = config.clamp_m * config.clamp_m;
        let previous = self.previous.replace(*frame.camera).filter(|previous| previous.size == frame.size);
        let mut kept = graph.history_buffer("instant_radiosity_lights", BufferDesc::array_of::<VirtualLight>(pixels));
        let mut reservoirs = graph.history_buffer("instant_radiosity_reservoirs", BufferDesc::array_of::<LightReservoir>(pixels));
        let before = previous.unwrap_or(*frame.camera);
        let params = ResampleParams {
            previous: before,
            camera_position_world,
            least2,
            size: frame.size,
            seed: frame.seed,
            tile: config.tile,
            history: previous.map_or(0.0, |_| history(config.history, frame.frame_index)),
            pixel_angle: before.pixel_angle(),
            lights: lights.wanted,
            frame: frame.frame_index,
            sequence_seed: Settings::first_seed(frame.seed, frame.frame_index),
            ..ResampleParams::default()
        };
        graph
            .compute(&self.resample.variant(frame.scene))
            .params(&params)
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .read("virtual_lights", &sorted)
            .read("photon_state", &lights.photons.state)
            .read("lights_before", &kept.previous)
            .read("reservoirs_before", &reservoirs.previous)
            .write("lights_kept", &mut kept.current)
            .write("reservoirs", &mut reservoirs.current)
            .heavy()
            .dispatch_threads([width, height, 1]);
        let mut indirect = graph.texture("instant_radiosity_indirect", radiance_desc(frame.size));
        frame
            .scene
            .bind(graph.compute(&self.shade.variant(frame.scene)).params(&ShadeParams {
                camera_position_world,
                least2,
                size: frame.size,
                pad0: 0,
                pad1: 0,
            }))
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .read("lights_kept", &kept.current)
            .read("reservoirs", &reservoirs.current)
            .write("indirect", &mut indirect)
            .heavy()
            .dispatch_threads([width, height, 1]);
        Ok(indirect)
    }
}

/// Frames for which what was kept may stand in frame `index` of an image.
///
/// Frames that share a light share its shadow: their mean is calmer for each frame's candidates, and noisier for its rays. The more frames an image is
/// the mean of, the less it needs the former.
fn history(most: u32, index: u32) -> f32 {
    most.saturating_sub(index) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_gives_way_to_the_mean() {
        assert_eq!([0, 3, 8, 1000].map(|index| history(8, index) as u32), [8, 5, 0, 0]);
    }
}
