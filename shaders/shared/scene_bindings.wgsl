// The scene, at bind group 1. Entry points that use only part of it bind only that part.
#import "shared/scene.wgsl"

@group(1) @binding(0) var<storage, read> bvh_nodes: array<BvhNode>;
@group(1) @binding(1) var<storage, read> bvh_triangles: array<BvhTriangle>;
@group(1) @binding(2) var<storage, read> triangles: array<TriangleAttributes>;
@group(1) @binding(3) var<storage, read> materials: array<Material>;
@group(1) @binding(4) var<storage, read> lights: array<Light>;
@group(1) @binding(5) var texels: texture_2d_array<f32>;
@group(1) @binding(6) var texels_srgb: texture_2d_array<f32>;
// See shared/environment.wgsl.
@group(1) @binding(7) var environment: texture_2d<f32>;
// Binding 8 is that of shared/ray_query.wgsl.
@group(1) @binding(9) var<storage, read> light_groups: array<LightGroup>;
@group(1) @binding(10) var<storage, read> light_views: array<LightView>;
