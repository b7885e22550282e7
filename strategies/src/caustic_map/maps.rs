//! The passes between photons and image.

use super::config::{FOUR_WORDS, ONE_WORDS};
use super::{CausticMapConfig, SplatSize};
use crate::screen_space::SURFACE_SLACK;
use crate::splat::inverse_power_of_two;
use crate::{FrameInputs, StrategyError};
use lightloom_graph::wgpu::{CompareFunction, TextureFormat};
use lightloom_graph::{
    Buffer, BufferDesc, ComputePass, ComputeShader, Graph, Handle, Load, RasterShader, Subresources, Texture, TextureDesc,
    WgslSources, shader_struct,
};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{PhotonGrid, Photons, SceneRasterShader, SceneShader};

shader_struct! {
    struct CausticViewParams {
        view: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    struct PlaceParams {
        groups: u32,
        side: u32,
        slack: f32,
        diameter: f32,
        spread: f32,
        most: f32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    struct LensParams {
        grid: PhotonGrid,
        spread: f32,
        most: f32,
        thick: u32,
        pad0: u32,
    }
}

shader_struct! {
    struct SplatParams {
        side: u32,
        slack: f32,
        scale: f32,
        pad0: u32,
    }
}

shader_struct! {
    struct BlendParams {
        side: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    struct ResolveParams {
        side: u32,
        unit: f32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    struct ProjectParams {
        camera_position_world: [f32; 3],
        slack: f32,
        size: [u32; 2],
        groups: u32,
        side: u32,
    }
}

shader_struct! {
    /// The struct `CausticPlace` of `shared/caustic_places.wgsl`.
    struct CausticPlace {
        photon: u32,
        views: u32,
        diameter: f32,
        unrefracted: f32,
    }
}

/// All passes.
#[derive(Debug)]
pub(super) struct Maps {
    view: SceneRasterShader,
    place: SceneShader,
    lens: SceneShader,
    arguments: ComputeShader,
    four: SceneShader,
    blend: ComputeShader,
    splat: SceneShader,
    splat_blended: SceneShader,
    resolve: SceneShader,
    project: SceneShader,
}

/// What the lights would see without glass and mirrors.
#[derive(Debug)]
pub(super) struct Receivers {
    /// `rg32uint`, a layer for each of the lights' views: depth (m, bits of a float), normal.
    texels: Handle<Texture>,
    /// Texels across and down a view.
    side: u32,
}

/// Photons that some light sees.
#[derive(Debug)]
pub(super) struct Places {
    list: Handle<Buffer>,
    count: Handle<Buffer>,
    /// Of dispatches over the list.
    arguments: Handle<Buffer>,
}

impl Maps {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let scene_shader = |name: &str| SceneShader::new(sources, &format!("strategies/caustic_map_{name}.wgsl"));
        let view = RasterShader::new(sources, "strategies/caustic_map_view.wgsl")?.with_depth_compare(CompareFunction::Greater);
        Ok(Self {
            view: SceneRasterShader::new(view),
            place: scene_shader("place")?,
            lens: scene_shader("lens")?,
            arguments: ComputeShader::new(sources, "strategies/caustic_map_arguments.wgsl")?,
            four: scene_shader("four")?,
            blend: ComputeShader::new(sources, "strategies/caustic_map_blend.wgsl")?,
            splat: scene_shader("splat")?,
            splat_blended: scene_shader("splat")?.with_constant("BLENDED", 1.0)?,
            resolve: scene_shader("resolve")?,
            project: scene_shader("project")?,
        })
    }

    /// Rasterises the receivers of all views, a pass each, as [`Rsm`](lightloom_passes::Rsm) does.
    pub(super) fn add_receivers(&self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>, side: u32) -> Receivers {
        let views = frame.info.light_view_count;
        if views == 0 {
            // A texture is bound all the same.
            let mut texels = graph.texture("caustic_map_receivers", TextureDesc::new_2d([1; 2], TextureFormat::Rg32Uint));
            graph.clear_texture(&mut texels, Load::Clear([0.0; 4]));
            return Receivers { texels, side: 1 };
        }
        let desc = TextureDesc::new_2d([side; 2], TextureFormat::Rg32Uint).layers(views);
        let mut texels = graph.texture("caustic_map_receivers", desc);
        let mut depth = graph.texture("caustic_map_depth", TextureDesc::new_2d([side; 2], TextureFormat::Depth32Float));
        let shader = self.view.variant(frame.scene);
        for view in 0..views {
            frame
                .scene
                .bind_raster(graph.raster(&shader).params(&CausticViewParams { view, ..CausticViewParams::default() }))
                .color_at("receivers", &mut texels, Subresources::mip(0).layer(view), Load::Clear([0.0; 4]))
                .depth(&mut depth, Load::ClearDepth(0.0))
                .draw(3 * frame.info.triangle_count, 1);
        }
        Receivers { texels, side }
    }

    /// Finds the map and the splat of each caustic photon. `stats`: counts those seen and unseen.
    pub(super) fn add_places(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
        config: &CausticMapConfig,
        receivers: &Receivers,
        stats: &mut Handle<Buffer>,
    ) -> Places {
        let FrameInputs { scene, info, .. } = *frame;
        let mut places = Places {
            list: graph.buffer("caustic_map_places", BufferDesc::array_of::<CausticPlace>(photons.capacity.into())),
            count: graph.buffer("caustic_map_place_count", BufferDesc::words(1)),
            arguments: graph.buffer("caustic_map_arguments", BufferDesc::words(6)),
        };
        graph.clear_buffer(&mut places.count);
        let params = PlaceParams {
            groups: info.light_group_count,
            side: receivers.side,
            slack: SURFACE_SLACK * info.bounds_radius,
            diameter: config.diameter().unwrap_or(0.0),
            spread: config.spread,
            most: config.diameter().unwrap_or(config.most),
            ..PlaceParams::default()
        };
        scene
            .bind(graph.compute(&self.place.variant(scene)).params(&params))
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("receivers", &receivers.texels)
            .write("places", &mut places.list)
            .write("place_count", &mut places.count)
            .write("stats", stats)
            .heavy()
            .dispatch_1d(photons.capacity);
        graph
            .compute(&self.arguments)
            .read("place_count", &places.count)
            .write("arguments", &mut places.arguments)
            .dispatch([1, 1, 1]);
        if let Some(thick) = config.mode.lens() {
            let grid = PhotonGrid::of(info);
            let params = LensParams { grid, spread: config.spread, most: config.most, thick: thick.into(), pad0: 0 };
            scene
                .bind(graph.compute(&self.lens.variant(scene)).params(&params))
                .read("photons", &photons.records)
                .write("places", &mut places.list)
                .read("place_count", &places.count)
                .heavy()
                .dispatch_indirect(&places.arguments, 12);
        }
        places
    }

    /// Splats the photons. Returns irradiance (W·m⁻²), a layer per view; `stats` counts texels that overflowed.
    #[expect(clippy::too_many_arguments, reason = "what a map is made of")]
    pub(super) fn add_map(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
        mode: SplatSize,
        receivers: &Receivers,
        places: &Places,
        stats: &mut Handle<Buffer>,
    ) -> Handle<Texture> {
        let FrameInputs { scene, info, .. } = *frame;
        let (side, views) = (receivers.side, info.light_view_count);
        let params =
            SplatParams { side, slack: SURFACE_SLACK * info.bounds_radius, scale: scale(info, photons.emitted), pad0: 0 };
        let blended = mode == SplatSize::MultiResolution;
        let blend = if blended {
            self.add_blend(graph, frame, photons, params, receivers, places)
        } else {
            // A texture is bound all the same.
            let mut none = graph.texture("caustic_map_blend", TextureDesc::new_2d([1; 2], TextureFormat::Rgba16Float));
            graph.clear_texture(&mut none, Load::Clear([0.0; 4]));
            none
        };
        let mut sums = zeros(graph, "caustic_map_sums", side, views, ONE_WORDS);
        let shader = if blended { &self.splat_blended } else { &self.splat };
        splat(graph, &shader.variant(scene), frame, photons, params, receivers, places)
            .read("blend", &blend)
            .write("sums", &mut sums)
            .heavy()
            .dispatch_indirect(&places.arguments, 0);
        let mut map = graph.texture("caustic_map", TextureDesc::new_2d([side; 2], TextureFormat::Rgba32Float).layers(views));
        let params = ResolveParams { side, unit: 1.0 / params.scale, ..ResolveParams::default() };
        scene
            .bind(graph.compute(&self.resolve.variant(scene)).params(&params))
            .read("receivers", &receivers.texels)
            .read("sums", &sums)
            .write("map", &mut map)
            .write("stats", stats)
            .dispatch_threads([side, side, views]);
        map
    }

    /// How much of each of four splats every texel takes: `rgba16float`, a layer per view.
    fn add_blend(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
        params: SplatParams,
        receivers: &Receivers,
        places: &Places,
    ) -> Handle<Texture> {
        let (side, views) = (receivers.side, frame.info.light_view_count);
        let mut sums = zeros(graph, "caustic_map_four_sums", side, views, FOUR_WORDS);
        splat(graph, &self.four.variant(frame.scene), frame, photons, params, receivers, places)
            .write("sums", &mut sums)
            .heavy()
            .dispatch_indirect(&places.arguments, 0);
        let desc = TextureDesc::new_2d([side; 2], TextureFormat::Rgba16Float).layers(views);
        let mut blend = graph.texture("caustic_map_blend", desc);
        graph
            .compute(&self.blend)
            .params(&BlendParams { side, ..BlendParams::default() })
            .read("sums", &sums)
            .write("blend", &mut blend)
            .dispatch_threads([side, side, views]);
        blend
    }

    /// Projects the map on what the eye sees: radiance (W·m⁻²·sr⁻¹), the same in both images.
    pub(super) fn project(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        receivers: &Receivers,
        map: &Handle<Texture>,
        [indirect, caustic]: [&mut Handle<Texture>; 2],
    ) {
        let FrameInputs { scene, info, size, gbuffer, .. } = *frame;
        let params = ProjectParams {
            camera_position_world: frame.camera_position_world(),
            slack: SURFACE_SLACK * info.bounds_radius,
            size,
            groups: info.light_group_count,
            side: receivers.side,
        };
        scene
            .bind(graph.compute(&self.project.variant(scene)).params(&params))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("receivers", &receivers.texels)
            .read("map", map)
            .write("indirect", indirect)
            .write("caustic", caustic)
            .dispatch_threads([size[0], size[1], 1]);
    }
}

/// A pass over the places, with what all splats are given.
fn splat<'p, 'g>(
    graph: &'p mut Graph<'g>,
    shader: &ComputeShader,
    frame: &FrameInputs<'_>,
    photons: &Photons,
    params: SplatParams,
    receivers: &Receivers,
    places: &Places,
) -> ComputePass<'p, 'g> {
    frame
        .scene
        .bind(graph.compute(shader).params(&params))
        .read("photons", &photons.records)
        .read("photon_state", &photons.state)
        .read("receivers", &receivers.texels)
        .read("places", &places.list)
        .read("place_count", &places.count)
}

/// Sums of `words` for each texel of the views, all 0.
fn zeros(graph: &mut Graph<'_>, name: &str, side: u32, views: u32, words: u64) -> Handle<Buffer> {
    let mut sums = graph.buffer(name, BufferDesc::words(u64::from(side) * u64::from(side) * u64::from(views) * words));
    graph.clear_buffer(&mut sums);
    sums
}

/// 1 / flux of a mean photon (W⁻¹), to the nearest power of two.
fn scale(info: &SceneInfo, emitted: u32) -> f32 {
    inverse_power_of_two(info.total_power.max_element() / emitted.max(1) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;
    use glam::Vec3;

    #[test]
    fn sums_count_photons() {
        let with = |power: f32| SceneInfo { total_power: Vec3::new(0.1, 1.0, 0.0) * power, ..unit_scene() };
        assert_eq!(scale(&with(1024.0), 1024).to_bits(), 1.0_f32.to_bits());
        assert_eq!(scale(&with(3.0), 1 << 20).to_bits(), 2.0_f32.powi(18).to_bits());
        assert_eq!([scale(&with(0.0), 4), scale(&with(f32::INFINITY), 4)].map(f32::to_bits), [1.0_f32.to_bits(); 2]);
    }
}
