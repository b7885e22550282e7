// Projects the maps of all lights on what the eye sees: L = E R / π, E interpolated between the texels that show the pixel's surface. A
// thread per pixel.
#import "shared/caustic_receivers.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/reflectance.wgsl"

struct ProjectParams {
    camera_position_world: vec3f,
    // How far (m) a receiver may lie off the pixel's surface, however small the texels.
    slack: f32,
    size: vec2u,
    // Groups of lights.
    groups: u32,
    side: u32,
}

@group(0) @binding(0) var<uniform> params: ProjectParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var receivers: texture_2d_array<u32>;
@group(0) @binding(4) var map: texture_2d_array<f32>;
// The same radiance (W·m⁻²·sr⁻¹) twice.
@group(0) @binding(5) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(6) var caustic: texture_storage_2d<rgba32float, write>;

// E (W·m⁻²) of one view at `q`, on a surface of that normal; 0 where the view does not show it.
fn irradiance_of(index: u32, position: vec3f, normal: vec3f) -> vec3f {
    let view = caustic_view(index);
    let side = f32(params.side);
    let q = position - view.origin;
    let depth = dot(view.forward, q);
    let film = map_film(view, q, side);
    if !(depth > 0.0 && all(film >= vec2f(0.0)) && all(film < vec2f(side)) && dot(to_light(view, q), normal) > 0.0) {
        return vec3f(0.0);
    }
    let allowed = texel_width(view, side, depth) + params.slack;
    let place = bilinear(film);
    let x = vec2f(1.0 - place.fraction.x, place.fraction.x);
    let y = vec2f(1.0 - place.fraction.y, place.fraction.y);
    var sum = vec4f(0.0);
    for (var corner = 0u; corner < 4u; corner += 1u) {
        let texel = bilinear_texel(place, corner, side);
        let shown = receiver_off_plane(view, texel, index, side, q, normal) <= allowed;
        let weight = select(0.0, x[corner & 1u] * y[corner >> 1u], shown);
        sum += vec4f(textureLoad(map, texel, index, 0).rgb, 1.0) * weight;
    }
    return sum.rgb / max(sum.a, 1.0e-6);
}

@compute @workgroup_size(8, 8)
fn caustic_map_project(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    var irradiance = vec3f(0.0);
    if point.gatherable {
        for (var group = 0u; group < params.groups; group += 1u) {
            let of_light = light_groups[group];
            for (var index = of_light.first_view; index < of_light.first_view + of_light.view_count; index += 1u) {
                irradiance += irradiance_of(index, point.position, point.normal_geometric);
            }
        }
    }
    let radiance = irradiance * reflectance(point.brdf, point.to_eye) / PI;
    textureStore(indirect, id.xy, vec4f(radiance, 1.0));
    textureStore(caustic, id.xy, vec4f(radiance, 1.0));
}
