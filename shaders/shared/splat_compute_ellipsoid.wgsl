// Ellipsoid splats of compute shaders, [SA19] §24.3.2: to each pixel whose visible point the kernel holds, its irradiance. Sums irradiance, and
// the direction of its light weighted with it. A kernel narrower than a pixel is one addition.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/splat_ellipsoid.wgsl"
#import "shared/splat_sums.wgsl"
#import "shared/splat_walk.wgsl"

@group(0) @binding(4) var position: texture_2d<f32>;
@group(0) @binding(5) var surface: texture_2d<u32>;

struct Splat {
    kernel: SplatKernelTest,
    rect: PixelRect,
}

fn photon_splat(index: u32) -> Splat {
    let photon = splat_photon(index);
    let center = splat_view(photon.position);
    let e = photon_ellipsoid(photon, center);
    var rect = PixelRect(vec2u(0u), vec2u(0u));
    if left_out(photon) {
        return Splat(drawn_kernel(e), rect);
    }
    if !ellipsoid_is_written(e, -center.z) {
        return Splat(drawn_kernel(e), bound_pixels(ellipsoid_bound(e, center)));
    }
    let pixel = written_texel(center);
    if all(pixel >= vec2f(0.0)) && all(pixel < vec2f(params.camera.size)) {
        rect = PixelRect(vec2u(pixel), vec2u(pixel) + 1u);
    }
    return Splat(written_kernel(e, center), rect);
}

fn splat_rect(splat: Splat) -> PixelRect {
    return splat.rect;
}

fn splat_pixel(splat: Splat, pixel: vec2u) {
    if !kernel_holds(splat.kernel, textureLoad(position, pixel, 0).xyz) {
        return;
    }
    let code = textureLoad(surface, pixel, 0);
    if !gathers(code) || !kernel_suits(splat.kernel, octahedral_decode(code.y)) {
        return;
    }
    let irradiance = splat.kernel.irradiance;
    add_light(pixel.y * params.camera.size.x + pixel.x, irradiance, luminance(irradiance) * splat.kernel.incident);
}
