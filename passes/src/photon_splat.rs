//! Connects photons to the eye: the light-traced part of the reference.
//!
//! What a point or directional light sends through a mirror or a refractor cannot be found from the eye (the light has no
//! area to hit). Photons marked [`PhotonFlags::LIGHT_ONLY`](crate::PhotonFlags::LIGHT_ONLY) carry just that light; each is
//! projected to the pixel that shows it, with one ray for visibility and material.

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, Photons};
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct PhotonSplatParams {
        camera: CameraUniform,
        capacity: u32,
        splat_scale: f32,
        seed: u32,
        pad0: u32,
    }
}

/// Radiance that light tracing brought, in fixed point.
#[derive(Debug)]
pub struct Splats {
    /// Six words per pixel: indirect RGB, the caustic part of it RGB.
    pub buffer: Handle<Buffer>,
    /// One word: additions that overflowed a sum, whose pixels are too dark.
    pub overflowed: Handle<Buffer>,
    /// Radiance (W·m⁻²·sr⁻¹) of one unit.
    pub unit: f32,
}

/// The pass. Reads: scene, photons. Writes: `splats`. A thread per record.
#[derive(Clone, Debug)]
pub struct PhotonSplat {
    shader: SceneShader,
}

impl PhotonSplat {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/photon_splat.wgsl")? })
    }

    /// Declares the pass. Integer sums do not depend on the order of additions.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        camera: &CameraUniform,
        photons: &Photons,
        seed: u32,
    ) -> Splats {
        let words = u64::from(camera.size[0]) * u64::from(camera.size[1]) * 6;
        let mut buffer = graph.buffer("splats", BufferDesc::words(words));
        graph.clear_buffer(&mut buffer);
        let mut overflowed = graph.buffer("splats_overflowed", BufferDesc::words(1));
        graph.clear_buffer(&mut overflowed);
        // Were the light spread over the bounding sphere, its radiance would be Φ / (4π² R²). That is 2¹⁶ units: a pixel
        // may be 65,536 times brighter before a sum overflows.
        let radius = info.bounds_radius.max(1.0e-6);
        let spread = info.total_power.max_element() / (4.0 * std::f32::consts::PI.powi(2) * radius * radius);
        let scale = if spread > 0.0 { 65_536.0 / spread } else { 1.0 };
        let params = PhotonSplatParams { camera: *camera, capacity: photons.capacity, splat_scale: scale, seed, pad0: 0 };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .read("photons", &photons.records)
            .read("state", &photons.state)
            .write("splats", &mut buffer)
            .write("overflowed", &mut overflowed)
            .heavy()
            .dispatch_1d(photons.capacity);
        Splats { buffer, overflowed, unit: 1.0 / scale }
    }
}
