// Sorting eight numbers by a network of 19 comparisons, the least that there can be [Knuth98], "The Art of Computer Programming",
// volume 3, section 5.3.4.

// The numbers of both vectors in ascending order.
fn sort8(low: vec4i, high: vec4i) -> array<i32, 8> {
    // (0, 2) (1, 3) (4, 6) (5, 7)
    let a01 = min(low.xy, low.zw);
    let a23 = max(low.xy, low.zw);
    let a45 = min(high.xy, high.zw);
    let a67 = max(high.xy, high.zw);
    // (0, 4) (1, 5) (2, 6) (3, 7)
    let b01 = min(a01, a45);
    let b45 = max(a01, a45);
    let b23 = min(a23, a67);
    let b67 = max(a23, a67);
    // (0, 1) (2, 3) (4, 5) (6, 7)
    let even = vec4i(b01.x, b23.x, b45.x, b67.x);
    let odd = vec4i(b01.y, b23.y, b45.y, b67.y);
    // .x: 0, .y: 2, .z: 4, .w: 6, and 1, 3, 5, 7.
    let c_even = min(even, odd);
    let c_odd = max(even, odd);
    // (2, 4) (3, 5)
    let d24 = vec2i(min(c_even.y, c_even.z), max(c_even.y, c_even.z));
    let d35 = vec2i(min(c_odd.y, c_odd.z), max(c_odd.y, c_odd.z));
    // (1, 4) (3, 6)
    let e14 = vec2i(min(c_odd.x, d24.y), max(c_odd.x, d24.y));
    let e36 = vec2i(min(d35.x, c_even.w), max(d35.x, c_even.w));
    // (1, 2) (3, 4) (5, 6)
    return array<i32, 8>(
        c_even.x,
        min(e14.x, d24.x), max(e14.x, d24.x),
        min(e36.x, e14.y), max(e36.x, e14.y),
        min(d35.y, e36.y), max(d35.y, e36.y),
        c_odd.w);
}
