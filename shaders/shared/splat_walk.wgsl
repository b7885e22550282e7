// Walks over the pixels that a splat may reach: small splats by one thread each, larger ones block by block, a workgroup to a block, so that no
// splat keeps a device waiting. Needs of whoever imports it what a splat is,
//
//     struct Splat
//     fn photon_splat(index: u32) -> Splat
//
// the pixels it may reach, and what it adds to one of them:
//
//     fn splat_rect(splat: Splat) -> PixelRect
//     fn splat_pixel(splat: Splat, pixel: vec2u)
#import "shared/splat_bound.wgsl"

// First pixel and the one past the last.
struct PixelRect {
    first: vec2u,
    end: vec2u,
}

// Pixels that one thread walks.
const SMALL_SPLAT: u32 = 64u;
// Least edge of a block (pixels), and most blocks of a splat along either axis.
const BLOCK_EDGE: u32 = 16u;
const MAX_BLOCKS: f32 = 16.0;
// A little less than the words' 2³²: what all blocks of all splats may number.
const MAX_ALL_BLOCKS: f32 = 4.0e9;

// Pixels whose centres lie in the bound's box.
fn bound_pixels(bound: SplatBound) -> PixelRect {
    if !bound.visible {
        return PixelRect(vec2u(0u), vec2u(0u));
    }
    let size = vec2f(params.camera.size);
    let first = clamp(ceil(bound.center - bound.half_size - 0.5), vec2f(0.0), size);
    let end = clamp(floor(bound.center + bound.half_size + 0.5), first, size);
    return PixelRect(vec2u(first), vec2u(end));
}

// Blocks along either axis; none for a small splat.
fn block_grid(rect: PixelRect) -> vec2u {
    let size = rect.end - rect.first;
    if size.x * size.y <= SMALL_SPLAT {
        return vec2u(0u);
    }
    let most = u32(clamp(floor(sqrt(MAX_ALL_BLOCKS / f32(arrayLength(&photons)))), 1.0, MAX_BLOCKS));
    return min((size + BLOCK_EDGE - 1u) / BLOCK_EDGE, vec2u(most));
}

// Adds a small splat; of a larger one, returns the number of blocks.
fn walk_small_splat(index: u32) -> u32 {
    let splat = photon_splat(index);
    let rect = splat_rect(splat);
    let blocks = block_grid(rect);
    if blocks.x * blocks.y == 0u {
        for (var y = rect.first.y; y < rect.end.y; y++) {
            for (var x = rect.first.x; x < rect.end.x; x++) {
                splat_pixel(splat, vec2u(x, y));
            }
        }
    }
    return blocks.x * blocks.y;
}

// Adds a block of a larger splat; the `threads` of a workgroup call it together.
fn walk_block(index: u32, block: u32, thread: u32, threads: u32) {
    let splat = photon_splat(index);
    let rect = splat_rect(splat);
    let blocks = block_grid(rect);
    let edge = (rect.end - rect.first + blocks - 1u) / blocks;
    let first = rect.first + vec2u(block % blocks.x, block / blocks.x) * edge;
    let size = min(first + edge, rect.end) - min(first, rect.end);
    for (var i = thread; i < size.x * size.y; i += threads) {
        splat_pixel(splat, first + vec2u(i % size.x, i / size.x));
    }
}
