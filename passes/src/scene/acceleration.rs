//! The structure that ray queries search: one bottom level of one geometry, and one instance of it that stands where it is.
//!
//! The geometry's vertices are the buffer `bvh_triangles` itself: a triangle there is three corners, each at the begin of 16 bytes.
//! So the structure knows a triangle by the index that the hierarchy's leaves know it by, and nothing is in memory twice.
//!
//! ```text
//! bvh_triangles   v0 id | v1 material | v2 light | v0 id | v1 material | v2 light | …
//! vertex          0       1             2          3       4             5
//! primitive       0                                1
//! ```
//!
//! Where alpha lets rays pass anywhere in a scene, no triangle is opaque to the device, and the shader sees each candidate. A second
//! geometry for the opaque ones would spare it those, but number its triangles by itself.

use super::gpu_types::CORNER_BYTES;
use lightloom_graph::wgpu;

/// Vertices of `triangles` triangles: what wgpu compares with `max_blas_primitive_count`.
pub(super) fn vertices(triangles: u32) -> u64 {
    3 * u64::from(triangles)
}

/// Both levels, and what they are made of.
#[derive(Debug)]
pub(super) struct Acceleration {
    size: wgpu::BlasTriangleGeometrySizeDescriptor,
    blas: wgpu::Blas,
    /// What ray queries search.
    pub(super) tlas: wgpu::Tlas,
}

impl Acceleration {
    /// Room for that many triangles. `opaque`: every hit counts, and the shader need not look at it.
    pub(super) fn new(device: &wgpu::Device, triangles: u32, opaque: bool) -> Self {
        let flags = wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE;
        let update_mode = wgpu::AccelerationStructureUpdateMode::Build;
        let size = wgpu::BlasTriangleGeometrySizeDescriptor {
            vertex_format: wgpu::VertexFormat::Float32x3,
            vertex_count: 3 * triangles,
            index_format: None,
            index_count: None,
            flags: if opaque {
                wgpu::AccelerationStructureGeometryFlags::OPAQUE
            } else {
                wgpu::AccelerationStructureGeometryFlags::empty()
            },
        };
        let blas = device.create_blas(
            &wgpu::CreateBlasDescriptor { label: Some("scene_triangles"), flags, update_mode },
            wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors: vec![size.clone()] },
        );
        let label = Some("ray_query_scene");
        let mut tlas = device.create_tlas(&wgpu::CreateTlasDescriptor { label, max_instances: 1, flags, update_mode });
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        tlas[0] = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
        Self { size, blas, tlas }
    }

    /// Triangles that it is made for.
    pub(super) fn triangles(&self) -> u32 {
        self.size.vertex_count / 3
    }

    /// Builds it over the triangles of `bvh_triangles`, a buffer with the usage `BLAS_INPUT`, as they are when the queue comes to it.
    ///
    /// When triangles have moved it is built again in its memory: wgpu 30 takes `AccelerationStructureUpdateMode::PreferUpdate`
    /// and builds anew all the same. The submission is one of its own, which wgpu runs behind the frames submitted before it.
    pub(super) fn build(&self, device: &wgpu::Device, queue: &wgpu::Queue, bvh_triangles: &wgpu::Buffer) {
        let geometry = wgpu::BlasTriangleGeometry {
            size: &self.size,
            vertex_buffer: bvh_triangles,
            first_vertex: 0,
            vertex_stride: CORNER_BYTES,
            index_buffer: None,
            first_index: None,
            transform_buffer: None,
            transform_buffer_offset: None,
        };
        let geometry = wgpu::BlasGeometries::TriangleGeometries(vec![geometry]);
        let entry = wgpu::BlasBuildEntry { blas: &self.blas, geometry };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("ray_query_scene") });
        encoder.build_acceleration_structures([&entry], [&self.tlas]);
        queue.submit([encoder.finish()]);
    }
}
