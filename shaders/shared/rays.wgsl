// Rays, how many there are, and what they met, as they lie in buffers.

struct Ray {
    // World (m).
    origin: vec3f,
    // Length in units of `direction`; 0 or less: there is no ray here.
    t_max: f32,
    direction: vec3f,
    // Index into `bvh_triangles` + 1 of what is taken to be the first, if the ray meets it; 0: nothing is known.
    seen: u32,
}

struct RayHit {
    // In units of the ray's direction; its t_max on a miss.
    t: f32,
    // Triangle of the scene, 0xffffffff: none.
    triangle: u32,
    // Barycentric weights of the second and third corner.
    bary: vec2f,
}

// How many paths, each with its ray, there are: as the arguments of a dispatch.
struct LivePaths {
    groups: u32,
    one_y: u32,
    one_z: u32,
    count: u32,
}
