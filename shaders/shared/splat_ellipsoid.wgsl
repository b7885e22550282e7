// Kernels of ellipsoid splats as pixels test them, and what they cover of the image.
//
// Kernels narrower than a texel are not drawn but written: the texel that shows the photon takes all of its flux, spread over the piece of
// surface that the texel shows ([SA19] §24.6.1).
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/splat_bound.wgsl"
#import "shared/splat_target.wgsl"

@group(0) @binding(3) var<storage, read> tile_photons: array<u32>;

// The kernel is a cylinder: of the ellipsoids about it this one is wider by little and higher by much, for the kernels are flat.
// 1/w² + 1/h² = 1.
const WIDER: f32 = 1.0690450;
const HIGHER: f32 = 2.8284271;

fn photon_ellipsoid(photon: Photon, position_view: vec3f) -> Ellipsoid {
    let tile = density_tile(params.camera, position_view, params.kernel);
    return splat_ellipsoid(photon, position_view, tile_photons[tile], params.kernel);
}

// Radius (m) of a sphere around the kernel.
fn ellipsoid_radius(e: Ellipsoid) -> f32 {
    return length(vec2f(max(e.radii.x, e.radii.y), e.radii.z));
}

// What the kernel covers of the image.
fn ellipsoid_bound(e: Ellipsoid, center_view: vec3f) -> SplatBound {
    let to_view = mat3x3f(
        params.camera.view_from_world[0].xyz, params.camera.view_from_world[1].xyz, params.camera.view_from_world[2].xyz
    );
    let half_axes = to_view * mat3x3f(e.u * (WIDER * e.radii.x), e.t * (WIDER * e.radii.y), e.n * (HIGHER * e.radii.z));
    // The sphere must hold the ellipsoid, which has no corners.
    let radius = max(WIDER * max(e.radii.x, e.radii.y), HIGHER * e.radii.z);
    return splat_bound(center_view, half_axes, radius);
}

// Whether the kernel is narrower than a texel at `depth` (m) and therefore written to one.
fn ellipsoid_is_written(e: Ellipsoid, depth: f32) -> bool {
    return depth > params.camera.near_m && 2.0 * max(e.radii.x, e.radii.y) < pixel_size(depth) * f32(params.texel);
}

fn drawn_kernel(e: Ellipsoid) -> SplatKernelTest {
    return kernel_test(e, splat_irradiance(e) * params.scale);
}

fn written_kernel(e: Ellipsoid, position_view: vec3f) -> SplatKernelTest {
    let depth = -position_view.z;
    let edges = 2.0 * params.camera.tan_half / vec2f(params.camera.size) * (depth * f32(params.texel));
    // A texel's area across the axis of view, seen along the ray to the photon on a surface that is tilted.
    let ray = e.center - camera_position(params.camera);
    let facing = max(abs(dot(e.n, ray)) / depth, 1.0e-3);
    let irradiance = e.flux * (params.scale * facing / (edges.x * edges.y));
    // Any point of the texel will do, in a slab as thick for it as kernels are for their width.
    let thickness = max(e.radii.z, params.kernel.s_n * max(edges.x, edges.y));
    return SplatKernelTest(e.center, vec3f(0.0), vec3f(0.0), e.n / thickness, e.incident, irradiance);
}

// First pixel (of the image) of the texel to which a kernel is written.
fn written_texel(position_view: vec3f) -> vec2f {
    let texel = f32(params.texel);
    return floor((camera_film(params.camera, position_view) + splat_shift()) / texel) * texel;
}

// Whether a surface of that geometric normal may take the kernel's light.
fn kernel_suits(kernel: SplatKernelTest, normal_geometric: vec3f) -> bool {
    return splat_suits(normalize(kernel.kernel_n), kernel.incident, normal_geometric);
}
