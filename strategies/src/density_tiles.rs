//! Counts photons per screen tile, to size splats by [SA19, section 24.3.1.1].
//!
//! Reads: photons. Writes: `tile_photons`, a word per tile. One thread per photon.
//!
//! [SA19, section 24.3.1.1]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

use crate::StrategyError;
use crate::splat_kernel::SplatKernelUniform;
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::{CameraUniform, Photons};

shader_struct! {
    /// Parameters of `density_tiles`.
    struct DensityParams {
        camera: CameraUniform,
        kernel: SplatKernelUniform,
    }
}

/// The pass.
#[derive(Debug)]
pub struct DensityTiles {
    shader: ComputeShader,
}

impl DensityTiles {
    /// Parses the shader.
    ///
    /// # Errors
    /// If `sources` lack it or it is invalid.
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { shader: ComputeShader::new(sources, "strategies/density_tiles.wgsl")? })
    }

    /// Declares the pass. Returns the photons of each tile of `kernel`, row by row from the top.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        photons: &Photons,
        camera: &CameraUniform,
        kernel: &SplatKernelUniform,
    ) -> Handle<Buffer> {
        let [x, y] = kernel.tiles.map(u64::from);
        let mut tile_photons = graph.buffer("tile_photons", BufferDesc::words(x * y));
        graph.clear_buffer(&mut tile_photons);
        graph
            .compute(&self.shader)
            .params(&DensityParams { camera: *camera, kernel: *kernel })
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .write("tile_photons", &mut tile_photons)
            .dispatch_1d(photons.capacity);
        tile_photons
    }
}
