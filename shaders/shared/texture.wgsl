// Texture lookups without samplers: all textures of a scene lie one after the other in a paged array texture, so that any
// thread can read any of them within WebGPU's binding limits. Bilinear at the finest level; wrap modes per texture.
#import "shared/scene_bindings.wgsl"
#import "shared/scene_traits.wgsl"

// A page is 4096 × 2048 texels.
const PAGE_WIDTH_BITS: u32 = 12u;
const PAGE_HEIGHT_BITS: u32 = 11u;
const NO_TEXTURE: u32 = 0xffffffffu;

// Two neighbouring texels along one axis and the weight of the second.
struct TexelPair {
    first: u32,
    second: u32,
    weight: f32,
}

// `mode`: 0 repeat, 1 clamp, 2 mirror. Only the coordinate is folded, once; integer remainders would cost more than the
// rest of the lookup.
fn texel_pair(coordinate: f32, size: u32, mode: u32) -> TexelPair {
    let repeated = coordinate - floor(coordinate);
    let half = coordinate * 0.5;
    let mirrored = 1.0 - abs(1.0 - 2.0 * (half - floor(half)));
    let inside = select(select(mirrored, clamp(coordinate, 0.0, 1.0), mode == 1u), repeated, mode == 0u);
    let at = inside * f32(size) - 0.5;
    let base = floor(at);
    let first = i32(base);
    let last = i32(size) - 1;
    // Past the edge: the other side of a repeated image, else the edge itself.
    let before = select(0, last, mode == 0u);
    let after = select(last, 0, mode == 0u);
    return TexelPair(
        u32(select(min(first, last), before, first < 0)),
        u32(select(first + 1, after, first >= last)),
        at - base,
    );
}

fn load_texel(slot: TextureSlot, x: u32, y: u32, srgb: bool) -> vec4f {
    let i = slot.first_texel + y * slot.width + x;
    let at = vec2u(i & ((1u << PAGE_WIDTH_BITS) - 1u), (i >> PAGE_WIDTH_BITS) & ((1u << PAGE_HEIGHT_BITS) - 1u));
    let page = i >> (PAGE_WIDTH_BITS + PAGE_HEIGHT_BITS);
    if srgb {
        return textureLoad(texels_srgb, at, page, 0);
    }
    return textureLoad(texels, at, page, 0);
}

// Linear RGBA at `uv`; white where the slot is empty. `srgb`: the stored colour is sRGB-encoded.
fn sample_texture(slot: TextureSlot, uv: vec2f, srgb: bool) -> vec4f {
    if !SCENE_TEXTURES || slot.first_texel == NO_TEXTURE {
        return vec4f(1.0);
    }
    let x = texel_pair(dot(slot.uv_x, vec3f(uv, 1.0)), slot.width, slot.wrap & 3u);
    let y = texel_pair(dot(slot.uv_y, vec3f(uv, 1.0)), slot.height, (slot.wrap >> 2u) & 3u);
    let top = mix(load_texel(slot, x.first, y.first, srgb), load_texel(slot, x.second, y.first, srgb), x.weight);
    let bottom = mix(load_texel(slot, x.first, y.second, srgb), load_texel(slot, x.second, y.second, srgb), x.weight);
    return mix(top, bottom, y.weight);
}
