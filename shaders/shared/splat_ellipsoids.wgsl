// Ellipsoid splats, [SA19] §24.3.2: each adds its irradiance, and the direction of its light weighted with that, to the pixels whose visible
// points the kernel holds.
//
// Kernels narrower than a texel are not drawn but written: the texel that shows the photon takes all of its flux, spread over the piece of
// surface that the texel shows ([SA19] §24.6.1).
//
// A coarse texel is lit where its nearest and its farthest visible point both lie in the kernel's slab, so that no light bleeds between
// surfaces ([SA19] §24.3.2.1); the ellipse is tested at the farthest alone, or the plane would lose light all along the ellipses' rims.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/splat_target.wgsl"

@group(0) @binding(3) var<storage, read> tile_photons: array<u32>;
// Of the texel's farthest visible point.
@group(0) @binding(4) var position: texture_2d<f32>;
@group(0) @binding(5) var surface: texture_2d<u32>;
@group(0) @binding(6) var nearest: texture_2d<f32>;

struct Varyings {
    @builtin(position) clip: vec4f,
    // World (m).
    @location(0) @interpolate(flat) center: vec3f,
    // Rows of the transform from the world to the kernel, in which it is the unit cylinder about the third axis.
    @location(1) @interpolate(flat) kernel_u: vec3f,
    @location(2) @interpolate(flat) kernel_t: vec3f,
    @location(3) @interpolate(flat) kernel_n: vec3f,
    // Unit, to the light (world).
    @location(4) @interpolate(flat) incident: vec3f,
    // W·m⁻² times `params.scale`.
    @location(5) @interpolate(flat) irradiance: vec3f,
}

struct Targets {
    // Irradiance (W·m⁻²); x of the direction, weighted with the irradiance's luminance; both times `params.scale`.
    @location(0) irradiance_x: vec4f,
    // y and z of the direction.
    @location(1) direction_yz: vec2f,
}

fn photon_ellipsoid(photon: Photon, position_view: vec3f) -> Ellipsoid {
    let tile = density_tile(params.camera, position_view, params.kernel);
    return splat_ellipsoid(photon, position_view, tile_photons[tile], params.kernel);
}

// Radius (m) of a sphere around the kernel.
fn ellipsoid_radius(e: Ellipsoid) -> f32 {
    return length(vec2f(max(e.radii.x, e.radii.y), e.radii.z));
}

// Whether the kernel is narrower than a texel at `depth` (m) and therefore written to one.
fn ellipsoid_is_written(e: Ellipsoid, depth: f32) -> bool {
    return depth > params.camera.near_m && 2.0 * max(e.radii.x, e.radii.y) < pixel_size(depth) * f32(params.texel);
}

fn ellipsoid_varyings(clip: vec4f, e: Ellipsoid) -> Varyings {
    let irradiance = splat_irradiance(e) * params.scale;
    return Varyings(clip, e.center, e.u / e.radii.x, e.t / e.radii.y, e.n / e.radii.z, e.incident, irradiance);
}

// Corner `vertex` (0 to 5) of the texel that shows the photon, NOWHERE for more of them.
fn written_varyings(vertex: u32, e: Ellipsoid, position_view: vec3f) -> Varyings {
    let depth = -position_view.z;
    let edges = 2.0 * params.camera.tan_half / vec2f(params.camera.size) * (depth * f32(params.texel));
    // A texel's area across the axis of view, seen along the ray to the photon on a surface that is tilted.
    let ray = e.center - camera_position(params.camera);
    let facing = max(abs(dot(e.n, ray)) / depth, 1.0e-3);
    let irradiance = e.flux * (params.scale * facing / (edges.x * edges.y));
    // Any point of the texel will do, in a slab as thick for it as kernels are for their width.
    let thickness = max(e.radii.z, params.kernel.s_n * max(edges.x, edges.y));
    var clip = NOWHERE;
    if vertex < 6u {
        let texel = f32(params.texel);
        let first = floor((camera_film(params.camera, position_view) + splat_shift()) / texel) * texel;
        clip = box_corner(first, first + texel, vertex);
    }
    return Varyings(clip, e.center, vec3f(0.0), vec3f(0.0), e.n / thickness, e.incident, irradiance);
}

fn splat_ellipsoid_fragment(in: Varyings) -> Targets {
    let texel = vec2u(in.clip.xy);
    let farthest = textureLoad(position, texel, 0);
    let code = textureLoad(surface, texel, 0);
    let apart = farthest.xyz - in.center;
    let across = vec3f(dot(apart, in.kernel_u), dot(apart, in.kernel_t), dot(apart, in.kernel_n));
    let gathers = (code.w & (SURFACE_VALID | SURFACE_SPECULAR)) == SURFACE_VALID;
    if !gathers || dot(across.xy, across.xy) >= 1.0 || abs(across.z) > 1.0 {
        discard;
    }
    if params.texel > 1u && abs(dot(textureLoad(nearest, texel, 0).xyz - in.center, in.kernel_n)) > 1.0 {
        discard;
    }
    if !splat_suits(normalize(in.kernel_n), in.incident, octahedral_decode(code.y)) {
        discard;
    }
    let direction = luminance(in.irradiance) * in.incident;
    return Targets(vec4f(in.irradiance, direction.x), direction.yz);
}
