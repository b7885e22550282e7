// The scene's triangles for the rasteriser: their corners pulled from `bvh_triangles`, three vertices each, in its order.
#import "shared/hit.wgsl"

struct PulledVertex {
    // World (m).
    position: vec3f,
    // Barycentric weights of the second and third corner.
    bary: vec2f,
    // Index into `bvh_triangles`.
    index: u32,
}

fn pulled_vertex(vertex: u32) -> PulledVertex {
    let index = vertex / 3u;
    let corner = vertex % 3u;
    let triangle = bvh_triangles[index];
    let bary = vec2f(select(0.0, 1.0, corner == 1u), select(0.0, 1.0, corner == 2u));
    return PulledVertex(select(select(triangle.v0, triangle.v1, corner == 1u), triangle.v2, corner == 2u), bary, index);
}

// Whether alpha lets through what looks at `bary` of the triangle. `place`: where in the picture, for the coins of blended ones.
fn fragment_passes(index: u32, bary: vec2f, place: vec3f) -> bool {
    let id = bvh_triangles[index].id;
    if SCENE_ALPHA && (id & ALPHA_TESTED) != 0u {
        return alpha_passes(id & ~ALPHA_TESTED, bary, place);
    }
    return false;
}
