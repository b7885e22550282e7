// A pinhole camera; view space looks along −z with y up. Needs: nothing.

struct Camera {
    world_from_view: mat4x4f,
    view_from_world: mat4x4f,
    // Tangents of half the horizontal and vertical angle.
    tan_half: vec2f,
    // Image size in pixels.
    size: vec2u,
    // Sample position inside the pixel, in [0, 1)².
    jitter: vec2f,
    // Distance of the near plane (m).
    near_m: f32,
    pad0: u32,
}

fn camera_position(camera: Camera) -> vec3f {
    return camera.world_from_view[3].xyz;
}

// Unit direction (world) through the point `film` of the image in pixels, (0, 0) at the top left corner.
fn camera_direction(camera: Camera, film: vec2f) -> vec3f {
    let ndc = (film / vec2f(camera.size)) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let view = vec3f(ndc * camera.tan_half, -1.0);
    return normalize((camera.world_from_view * vec4f(view, 0.0)).xyz);
}

// Image point in pixels of a position in view space; meaningful where z < 0.
fn camera_film(camera: Camera, position_view: vec3f) -> vec2f {
    let ndc = position_view.xy / (-position_view.z * camera.tan_half);
    return (ndc * vec2f(0.5, -0.5) + 0.5) * vec2f(camera.size);
}
