// Ellipsoid splats, [SA19] §24.3.2: each adds its irradiance, and the direction of its light weighted with that, to the pixels whose visible
// points the kernel holds.
//
// A coarse texel is lit where its nearest and its farthest visible point both lie in the kernel's slab, so that no light bleeds between
// surfaces ([SA19] §24.3.2.1); the ellipse is tested at the farthest alone, or the plane would lose light all along the ellipses' rims.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/splat_ellipsoid.wgsl"

// Of the texel's farthest visible point.
@group(0) @binding(4) var position: texture_2d<f32>;
@group(0) @binding(5) var surface: texture_2d<u32>;
@group(0) @binding(6) var nearest: texture_2d<f32>;

// A `SplatKernelTest` and where it is drawn.
struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) center: vec3f,
    @location(1) @interpolate(flat) kernel_u: vec3f,
    @location(2) @interpolate(flat) kernel_t: vec3f,
    @location(3) @interpolate(flat) kernel_n: vec3f,
    @location(4) @interpolate(flat) incident: vec3f,
    @location(5) @interpolate(flat) irradiance: vec3f,
}

struct Targets {
    // Irradiance (W·m⁻²); x of the direction, weighted with the irradiance's luminance; both times `params.scale`.
    @location(0) irradiance_x: vec4f,
    // y and z of the direction.
    @location(1) direction_yz: vec2f,
}

fn kernel_varyings(clip: vec4f, k: SplatKernelTest) -> Varyings {
    return Varyings(clip, k.center, k.kernel_u, k.kernel_t, k.kernel_n, k.incident, k.irradiance);
}

fn ellipsoid_varyings(clip: vec4f, e: Ellipsoid) -> Varyings {
    return kernel_varyings(clip, drawn_kernel(e));
}

// Corner `vertex` (0 to 5) of the texel that shows the photon, NOWHERE for more of them.
fn written_varyings(vertex: u32, e: Ellipsoid, position_view: vec3f) -> Varyings {
    var clip = NOWHERE;
    if vertex < 6u {
        let first = written_texel(position_view);
        clip = box_corner(first, first + f32(params.texel), vertex);
    }
    return kernel_varyings(clip, written_kernel(e, position_view));
}

fn splat_ellipsoid_fragment(in: Varyings) -> Targets {
    let texel = vec2u(in.clip.xy);
    let kernel = SplatKernelTest(in.center, in.kernel_u, in.kernel_t, in.kernel_n, in.incident, in.irradiance);
    let code = textureLoad(surface, texel, 0);
    if !gathers(code) || !kernel_holds(kernel, textureLoad(position, texel, 0).xyz) {
        discard;
    }
    if params.texel > 1u && abs(dot(textureLoad(nearest, texel, 0).xyz - in.center, in.kernel_n)) > 1.0 {
        discard;
    }
    if !kernel_suits(kernel, octahedral_decode(code.y)) {
        discard;
    }
    let direction = luminance(in.irradiance) * in.incident;
    return Targets(vec4f(in.irradiance, direction.x), direction.yz);
}
