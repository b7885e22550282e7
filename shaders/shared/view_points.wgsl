// The order of the points that gather: in tiles of 8 × 8, each tile's points together, so that neighbours have near numbers.

const TILE_POINTS: u32 = 64u;

// Where the point with this number lies in the image; beyond it in tiles that reach over its edge.
fn point_pixel(number: u32, tiles_x: u32) -> vec2u {
    let tile = number / TILE_POINTS;
    let inside = number % TILE_POINTS;
    return vec2u(tile % tiles_x, tile / tiles_x) * 8u + vec2u(inside % 8u, inside / 8u);
}

// Of a point that does not gather, in place of its bucket.
const NO_BUCKET: u32 = 0xffffffffu;
