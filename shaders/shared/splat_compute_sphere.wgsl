// Spherical splats of compute shaders: to each pixel whose visible point lies in the photon's sphere, what every gathering strategy adds there.
// Sums radiance, and the part of it that caustics bring.
#import "shared/splat_sums.wgsl"
#import "shared/splat_walk.wgsl"

@group(0) @binding(4) var position: texture_2d<f32>;
@group(0) @binding(5) var surface: texture_2d<u32>;

struct Splat {
    // World (m).
    center: vec3f,
    // m.
    radius: f32,
    light: PhotonLight,
    caustic: bool,
}

fn photon_splat(index: u32) -> Splat {
    let photon = splat_photon(index);
    let caustic = (photon.bounce_flags & PHOTON_CAUSTIC) != 0u;
    return Splat(photon.position, photon_radius(photon, params.r_min, params.r_max), photon_light(photon), caustic);
}

fn splat_rect(splat: Splat) -> PixelRect {
    // The kernel is 0 at its edge; the slack covers the rounding of the distance there.
    return bound_pixels(sphere_bound(splat_view(splat.center), splat.radius * 1.0001));
}

fn splat_pixel(splat: Splat, pixel: vec2u) {
    let place = textureLoad(position, pixel, 0);
    let apart = splat.center - place.xyz;
    let distance2 = dot(apart, apart);
    if distance2 >= splat.radius * splat.radius {
        return;
    }
    let point = visible_point(place, textureLoad(surface, pixel, 0), camera_position(params.camera));
    if !point.gatherable {
        return;
    }
    let radiance = light_contribution(point, splat.light, distance2, splat.radius) * params.scale;
    add_light(pixel.y * params.camera.size.x + pixel.x, radiance, select(vec3f(0.0), radiance, splat.caustic));
}
