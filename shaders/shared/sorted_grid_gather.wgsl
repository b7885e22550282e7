// What the gathers of `sorted-grid` are given, a pixel to a thread or sixteen.
#import "shared/gather_sampling.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    grid: SortedGrid,
    camera_position_world: vec3f,
    // Largest kernel radius, and the rounding of a distance at its edge (m).
    reach: f32,
    size: vec2u,
    pad0: u32,
    pad1: u32,
    sampling: GatherSampling,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var sorted_spheres: texture_2d<f32>;
@group(0) @binding(4) var sorted_light: texture_2d<u32>;
@group(0) @binding(5) var<storage, read> bucket_offsets: array<u32>;
@group(0) @binding(6) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var caustic: texture_storage_2d<rgba32float, write>;
// Word 4: pixels whose sum was cut.
@group(0) @binding(8) var<storage, read_write> stats: array<atomic<u32>>;
