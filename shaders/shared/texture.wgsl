// Texture lookups without samplers: all textures of a scene lie one after the other in a paged array texture, so that any
// thread can read any of them within WebGPU's binding limits. Bilinear at the finest level; wrap modes per texture.
#import "shared/scene_bindings.wgsl"
#import "shared/scene_traits.wgsl"

const TEXEL_PAGE_WIDTH: u32 = 4096u;
const TEXEL_PAGE_HEIGHT: u32 = 2048u;
const NO_TEXTURE: u32 = 0xffffffffu;

fn wrap_texel(i: i32, size: i32, mode: u32) -> i32 {
    if mode == 1u {
        return clamp(i, 0, size - 1);
    }
    if mode == 2u {
        let period = 2 * size;
        let m = ((i % period) + period) % period;
        return select(m, period - 1 - m, m >= size);
    }
    return ((i % size) + size) % size;
}

fn load_texel(slot: TextureSlot, x: i32, y: i32, srgb: bool) -> vec4f {
    let wx = u32(wrap_texel(x, i32(slot.width), slot.wrap & 3u));
    let wy = u32(wrap_texel(y, i32(slot.height), (slot.wrap >> 2u) & 3u));
    let i = slot.first_texel + wy * slot.width + wx;
    let at = vec2u(i % TEXEL_PAGE_WIDTH, (i / TEXEL_PAGE_WIDTH) % TEXEL_PAGE_HEIGHT);
    let page = i / (TEXEL_PAGE_WIDTH * TEXEL_PAGE_HEIGHT);
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
    let transformed = vec2f(dot(slot.uv_x, vec3f(uv, 1.0)), dot(slot.uv_y, vec3f(uv, 1.0)));
    // Repeat before scaling, so that far coordinates keep their fraction; mirrored textures repeat every second time.
    let p = (transformed - 2.0 * floor(transformed * 0.5)) * vec2f(f32(slot.width), f32(slot.height)) - 0.5;
    let clamped = (transformed) * vec2f(f32(slot.width), f32(slot.height)) - 0.5;
    let at = select(p, clamp(clamped, vec2f(-1.0), vec2f(f32(slot.width), f32(slot.height))),
        vec2<bool>((slot.wrap & 3u) == 1u, ((slot.wrap >> 2u) & 3u) == 1u));
    let base = floor(at);
    let f = at - base;
    let i = vec2i(base);
    let top = mix(load_texel(slot, i.x, i.y, srgb), load_texel(slot, i.x + 1, i.y, srgb), f.x);
    let bottom = mix(load_texel(slot, i.x, i.y + 1, srgb), load_texel(slot, i.x + 1, i.y + 1, srgb), f.x);
    return mix(top, bottom, f.y);
}
