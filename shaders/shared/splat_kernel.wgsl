// The kernel of a splatted photon, [SA19] §24.3.1: an elliptic disc in the tangent plane of the surface that the photon hit, with a
// slab about that plane that points must lie in.
//
//              n  s_n r
//              ^                      u: along the light's direction, seen from above; s_u r, s_u = min(1 / cos θ, s_max)
//      +-------|-------+              t: across it; r
//    - | - - - o - - - | - > u        r = s_l s_d: ray length times tile density
//      +---------------+
//          kernel plane
//
// The kernel is constant, E = Φ / (π ‖u‖ ‖t‖): over its plane it integrates to one whatever its scales. It is tested against the plane and
// the ellipse rather than against the depth of a hull.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/camera.wgsl"
#import "shared/estimate.wgsl"

// What the kernels of a frame have in common.
struct SplatKernel {
    // Least and largest radius of a disc that holds one photon (m).
    disc_min: f32,
    disc_max: f32,
    // n_tile: kernel radii to such discs' radii.
    n_tile: f32,
    // Ray length of kernels of full size (m).
    l_max: f32,
    // Half the thickness of the kernel to its radius.
    s_n: f32,
    // Largest stretch towards the light.
    s_max: f32,
    // Area that a density tile covers at depth 1 m, across the axis of view (m²).
    c_tile: f32,
    // Edge of a density tile (pixels).
    tile_size: u32,
    // Density tiles in the image.
    tiles: vec2u,
    pad0: u32,
    pad1: u32,
}

struct Ellipsoid {
    // World (m).
    center: vec3f,
    // Unit axes of a right-handed frame (world): u, t and the normal n.
    u: vec3f,
    t: vec3f,
    n: vec3f,
    // Half axes along u, t and n (m).
    radii: vec3f,
    // Unit, towards where the light came from (world).
    incident: vec3f,
    // W.
    flux: vec3f,
}

// Shortest ray to the longest, in kernels' sizes.
const MIN_LENGTH_SCALE: f32 = 0.1;

// Density tile of a position in view space; the nearest one of positions off the image.
fn density_tile(camera: Camera, position_view: vec3f, kernel: SplatKernel) -> u32 {
    let depth = max(-position_view.z, camera.near_m);
    let film = camera_film(camera, vec3f(position_view.xy, -depth));
    let tile = vec2u(clamp(film / f32(kernel.tile_size), vec2f(0.0), vec2f(kernel.tiles) - 1.0));
    return tile.y * kernel.tiles.x + tile.x;
}

// Radius across the light (m), s_l s_d [SA19] Eqs. 2 to 6: `depth` along the axis of view (m), `photons_in_tile` as counted there.
fn splat_radius(ray_length: f32, depth: f32, photons_in_tile: u32, kernel: SplatKernel) -> f32 {
    let disc = abs(depth) * sqrt(kernel.c_tile / (PI * f32(max(photons_in_tile, 1u))));
    let s_d = clamp(disc, kernel.disc_min, kernel.disc_max) * kernel.n_tile;
    return s_d * clamp(ray_length / kernel.l_max, MIN_LENGTH_SCALE, 1.0);
}

fn splat_ellipsoid(photon: Photon, position_view: vec3f, photons_in_tile: u32, kernel: SplatKernel) -> Ellipsoid {
    var e: Ellipsoid;
    e.center = photon.position;
    e.flux = flux_decode(photon.flux);
    e.n = octahedral_decode(photon.normal);
    e.incident = -octahedral_decode(photon.direction);
    let cos_theta = dot(e.n, e.incident);
    let along = e.incident - cos_theta * e.n;
    let length2 = dot(along, along);
    // Light straight from above has no direction in the plane and needs none: the ellipse is a circle.
    if length2 > 1.0e-8 {
        e.u = along * inverseSqrt(length2);
    } else {
        e.u = tangent_frame(e.n)[0];
    }
    e.t = cross(e.n, e.u);
    let radius = splat_radius(unpack2x16float(photon.length_probability).x, -position_view.z, photons_in_tile, kernel);
    let s_u = min(1.0 / max(cos_theta, 1.0e-6), kernel.s_max);
    e.radii = radius * vec3f(s_u, 1.0, kernel.s_n);
    return e;
}

// Area of the kernel (m²), a = π ‖u‖ ‖t‖.
fn splat_area(e: Ellipsoid) -> f32 {
    return PI * e.radii.x * e.radii.y;
}

// Irradiance inside the kernel (W·m⁻²), [SA19] Eq. 9.
fn splat_irradiance(e: Ellipsoid) -> vec3f {
    return e.flux / splat_area(e);
}

// What a pixel tests, and takes if it passes.
struct SplatKernelTest {
    // World (m).
    center: vec3f,
    // Rows of the transform from the world to the kernel, in which it is the unit cylinder about the third axis.
    kernel_u: vec3f,
    kernel_t: vec3f,
    kernel_n: vec3f,
    // Unit, to the light (world).
    incident: vec3f,
    // W·m⁻², in whatever unit is summed.
    irradiance: vec3f,
}

fn kernel_test(e: Ellipsoid, irradiance: vec3f) -> SplatKernelTest {
    return SplatKernelTest(e.center, e.u / e.radii.x, e.t / e.radii.y, e.n / e.radii.z, e.incident, irradiance);
}

// Whether the kernel holds a position (world, m).
fn kernel_holds(kernel: SplatKernelTest, position_world: vec3f) -> bool {
    let apart = position_world - kernel.center;
    let across = vec3f(dot(apart, kernel.kernel_u), dot(apart, kernel.kernel_t), dot(apart, kernel.kernel_n));
    return dot(across.xy, across.xy) < 1.0 && abs(across.z) <= 1.0;
}

// Whether a surface of that geometric normal may take light that came from `incident` to a surface of normal `n`: it is the photon's surface,
// not another one beside it, and faces the light.
fn splat_suits(n: vec3f, incident: vec3f, normal_geometric: vec3f) -> bool {
    return dot(n, normal_geometric) >= MIN_NORMAL_COSINE && dot(incident, normal_geometric) > 0.0;
}
