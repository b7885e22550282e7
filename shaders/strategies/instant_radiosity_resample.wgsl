// Chooses a light for each pixel in proportion to what it brings unshadowed: among its share of the frame's lights, and the one chosen before
// for the same place. A thread per pixel.
//
// A pixel of an n × n tile has every n²th light y of the frame. It takes one with a probability in proportion to p = luminance(f(y)), by the inverse of
// the distribution, and W = n² Σ p / p(y) [Talbot05]. The light kept from before stands for M frames: both are chosen between by p W and M p W, and
//
//   W = (Σ p + M p W) / (p(y) Z),   Z = 1 + M if y could have been chosen before, else 1 [Bitterli20, Alg. 6].
//
// Without bias, wherever the light was kept: what is taken for the same place only decides how much it helps.
//
// [Talbot05]: "Importance Resampling for Global Illumination", EGSR 2005.
#import "shared/camera.wgsl"
#import "shared/light_reservoir.wgsl"
#import "shared/virtual_light.wgsl"

struct ResampleParams {
    previous: Camera,
    camera_position_world: vec3f,
    // ε² (m²).
    least2: f32,
    size: vec2u,
    seed: u32,
    // Edge of a tile (pixels).
    tile: u32,
    // Frames that what was kept may stand for; 0: there is nothing.
    history: f32,
    // Height of a pixel at a distance of 1 m (m), in the previous image.
    pixel_angle: f32,
    // Lights wanted.
    lights: u32,
    // Which frame this is, and the seed of the sequence over frames.
    frame: u32,
    sequence_seed: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: ResampleParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
@group(0) @binding(5) var<storage, read> lights_before: array<VirtualLight>;
@group(0) @binding(6) var<storage, read> reservoirs_before: array<LightReservoir>;
@group(0) @binding(7) var<storage, read_write> lights_kept: array<VirtualLight>;
@group(0) @binding(8) var<storage, read_write> reservoirs: array<LightReservoir>;

// Runs of a pixel's lights whose sums are kept.
const RUNS: u32 = 16u;
// Cosine of the normals, and distances off the plane and along it (pixels), of what shows one place.
const SAME_NORMAL: f32 = 0.9;
const SAME_PLANE: f32 = 1.0;
const SAME_PLACE: f32 = 8.0;

// Where the previous image showed the point: an index into what was kept, or −1.
fn place_before(point: VisiblePoint) -> i32 {
    let view = (params.previous.view_from_world * vec4f(point.position, 1.0)).xyz;
    let film = camera_film(params.previous, vec3f(view.xy, min(view.z, -1.0e-20)));
    let inside = (view.z < 0.0) & all(film >= vec2f(0.0)) & all(film < vec2f(params.size));
    let texel = vec2u(clamp(film, vec2f(0.0), vec2f(params.size) - 1.0));
    let index = texel.y * params.size.x + texel.x;
    let before = reservoirs_before[index];
    let apart = before.position - point.position;
    let pixel = -view.z * params.pixel_angle;
    let same = (before.frames > 0.0) & (abs(dot(point.normal_geometric, apart)) < SAME_PLANE * pixel)
        & (dot(apart, apart) < SAME_PLACE * SAME_PLACE * pixel * pixel)
        & (dot(octahedral_decode(before.normal_geometric), point.normal_geometric) > SAME_NORMAL);
    return select(-1, i32(index), inside & same & (params.history > 0.0));
}

fn brings(at: Surface, to_eye: vec3f, light: VirtualLight) -> f32 {
    return luminance(lit_by(at, to_eye, light, params.least2).radiance);
}

@compute @workgroup_size(8, 8)
fn instant_radiosity_resample(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let index = pixel.y * params.size.x + pixel.x;
    let point = visible_point(
        textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
    );
    if !point.gatherable {
        reservoirs[index] = LightReservoir();
        return;
    }
    let at = lit_surface(point);

    // Each pixel of a tile begins at another light, which one is drawn anew for each frame: every light is as often a pixel's as any other.
    let count = light_count(params.lights, photon_state.stored);
    let stride = params.tile * params.tile;
    let drawn = pcg4d(vec4u(params.seed, 0x54494c45u, 0u, 0u)).x;
    let first = (pixel.x % params.tile + params.tile * (pixel.y % params.tile) + drawn) % stride;
    let run = ((count + stride - 1u) / stride + RUNS - 1u) / RUNS * stride;
    var sums: array<f32, RUNS>;
    var fresh = 0.0;
    for (var r = 0u; r < RUNS; r += 1u) {
        var sum = 0.0;
        let end = min(first + (r + 1u) * run, count);
        for (var i = first + r * run; i < end; i += stride) {
            sum += brings(at, point.to_eye, virtual_lights[i]);
        }
        sums[r] = sum;
        fresh += sum;
    }
    // The light at the part `u` of the sum. Over frames the parts of a pixel are evenly apart, multiples of the golden ratio: in a list in the
    // order of space they are lights from everywhere.
    let bits = pcg4d(vec4u(params.sequence_seed, 0x53455155u, index, 0u)).x + params.frame * 2654435769u;
    var rest = unit_float(bits) * fresh;
    var r = 0u;
    while r + 1u < RUNS && rest >= sums[r] {
        rest -= sums[r];
        r += 1u;
    }
    var chosen = first;
    var brought = 0.0;
    let end = min(first + (r + 1u) * run, count);
    for (var i = first + r * run; i < end && rest >= 0.0; i += stride) {
        let p = brings(at, point.to_eye, virtual_lights[i]);
        rest -= p;
        chosen = select(chosen, i, p > 0.0);
        brought = select(brought, p, p > 0.0);
    }
    var rng = rng_new(params.seed, 0x52455356u, index);
    fresh *= f32(stride) * light_weight(params.lights, photon_state.stored);
    var light = virtual_lights[min(chosen, arrayLength(&virtual_lights) - 1u)];

    let place = place_before(point);
    var kept = 0.0;
    var frames = 0.0;
    var could = 0.0;
    if place >= 0 {
        let before = reservoirs_before[place];
        let light_before = lights_before[place];
        frames = min(before.frames, params.history);
        let p = brings(at, point.to_eye, light_before);
        kept = frames * p * before.weight;
        if rng_next4(&rng).x * (fresh + kept) < kept {
            light = light_before;
            brought = p;
        }
        var then = at;
        then.position = before.position;
        then.normal_geometric = octahedral_decode(before.normal_geometric);
        then.brdf.normal = octahedral_decode(before.normal);
        could = select(0.0, frames, brings(then, point.to_eye, light) > 0.0);
    }
    let weight = select(0.0, (fresh + kept) / (brought * (1.0 + could)), brought > 0.0);
    lights_kept[index] = light;
    reservoirs[index] = LightReservoir(point.position, weight, octahedral_encode(point.brdf.normal),
        octahedral_encode(point.normal_geometric), frames + 1.0, 0u);
}
