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

use super::gpu_types::BvhTriangle;
use lightloom_graph::wgpu;

/// Bytes from one corner to the next.
const VERTEX_BYTES: u64 = 16;
const _: () = assert!(size_of::<BvhTriangle>() as u64 == 3 * VERTEX_BYTES, "a triangle is three corners");

/// Vertices of `triangles` triangles: what wgpu compares with `max_blas_primitive_count`.
pub(super) fn vertices(triangles: u32) -> u64 {
    3 * u64::from(triangles)
}

/// Builds the structure over the first `triangles` of `bvh_triangles`, a buffer with the usage `BLAS_INPUT`.
pub(super) fn build(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    bvh_triangles: &wgpu::Buffer,
    triangles: u32,
    opaque: bool,
) -> wgpu::Tlas {
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
    let geometry = wgpu::BlasTriangleGeometry {
        size: &size,
        vertex_buffer: bvh_triangles,
        first_vertex: 0,
        vertex_stride: VERTEX_BYTES,
        index_buffer: None,
        first_index: None,
        transform_buffer: None,
        transform_buffer_offset: None,
    };
    let entry = wgpu::BlasBuildEntry { blas: &blas, geometry: wgpu::BlasGeometries::TriangleGeometries(vec![geometry]) };
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
    encoder.build_acceleration_structures([&entry], [&tlas]);
    queue.submit([encoder.finish()]);
    tlas
}
