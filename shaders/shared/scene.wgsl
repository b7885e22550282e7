// The scene as it lies in memory. The Rust side is `lightloom_passes::scene::gpu_types`; the graph compares the two.

// A node of the hierarchy, its eight children's boxes on a grid of 8 bits. Inner children come first, then leaves, whose
// triangles follow each other, then children that are not there.
struct BvhNode {
    // Least corner of the node, where the grid begins (m, world, bits of floats), and the grid's steps in x, y and z (m), from the
    // lowest byte up: the biased exponents of powers of two.
    grid: vec4u,
    // Index of the node that is child 0, and other inner children follow; index into `bvh_triangles`; bits of the children,
    // 24 + c: child c is a node, 3 c to 3 c + 2: as many triangles lie in child c; unused.
    links: vec4u,
    // Least x of the eight children, then their greatest, in steps of the grid, a byte each; y and z likewise.
    x_planes: vec4u,
    y_planes: vec4u,
    z_planes: vec4u,
}

// A triangle as rays meet it; the array is in leaf order of the BVH, so that a leaf is a range.
struct BvhTriangle {
    // First corner (m, world).
    v0: vec3f,
    // Index into `triangles`; bit 31 is set where alpha may let a ray pass.
    id: u32,
    // Second corner (m, world). Corners, not edges: triangles that share one must see the same bits.
    v1: vec3f,
    // Index into `materials`.
    material: u32,
    // Third corner (m, world). (v1 − v0) × (v2 − v0) points to the front side.
    v2: vec3f,
    // Index into `lights`, 0xffffffff where the triangle does not emit.
    light: u32,
}

// What shading needs of a triangle beyond its corners; the array is in the order of the scene.
struct TriangleAttributes {
    // Shading normals of the corners (world): octahedral, 2 × 16-bit snorm each.
    normals: vec3u,
    // Index into `materials`.
    material: u32,
    // Texture coordinates of the corners.
    uv0: vec2f,
    uv1: vec2f,
    uv2: vec2f,
    // Index into `lights`, 0xffffffff where the triangle does not emit.
    light: u32,
    // Index into `bvh_triangles`.
    leaf: u32,
}

// Where a texture lies among the texels of the scene and how it is looked up.
struct TextureSlot {
    // Index of its first texel, row by row from the top; 0xffffffff: no texture. Texel i lies on page i / (4096·2048),
    // at (i % 4096, (i / 4096) % 2048).
    first_texel: u32,
    // Texels across and down.
    width: u32,
    height: u32,
    // Beyond [0, 1]: bits 0-1 for u, 2-3 for v; 0 repeat, 1 clamp, 2 mirror.
    wrap: u32,
    // Coordinates on the image from those of the mesh: u' = dot(uv_x, (u, v, 1)), v' = dot(uv_y, (u, v, 1)).
    uv_x: vec3f,
    pad0: u32,
    uv_y: vec3f,
    pad1: u32,
}

// A surface of glTF's metallic-roughness model.
struct Material {
    // Linear colour and alpha.
    base_color: vec4f,
    // Radiance from the front side, or from both (W·m⁻²·sr⁻¹).
    emissive: vec3f,
    // Perceptual; GGX α is its square.
    roughness: f32,
    // σ_a of the inside (m⁻¹).
    absorption: vec3f,
    // 0 dielectric, 1 metal.
    metallic: f32,
    // Share of the light that is refracted in place of scattered back.
    transmission: f32,
    // Index of refraction of the inside.
    ior: f32,
    // Above 0: bounds a solid (m); 0: a thin wall.
    thickness: f32,
    // 0 opaque, above 0 cutoff of the mask, −1 blend.
    alpha_cutoff: f32,
    // Scales x and y of the normal map.
    normal_scale: f32,
    // Bit 0: Lambert of the base colour; bit 1: emits from both sides.
    flags: u32,
    pad0: u32,
    pad1: u32,
    // sRGB.
    base_color_texture: TextureSlot,
    // Linear; G roughness, B metallic.
    metallic_roughness_texture: TextureSlot,
    // Linear.
    normal_texture: TextureSlot,
    // sRGB.
    emissive_texture: TextureSlot,
}

// A light; punctual ones come first, then emissive triangles, then the environment. Behind these: each punctual light once
// per guide, a sphere around what refracts or mirrors, for photons that are aimed at it.
struct Light {
    // Point and spot: where it is; triangle: first corner (m, world).
    position: vec3f,
    // 0 point, 1 spot, 2 directional, 3 triangle, 4 environment.
    kind: u32,
    // Unit: travel of the light; triangle: normal of the front side, which emits.
    direction: vec3f,
    // Triangle: its area (m²); directional, environment: area of the disc that the bounding sphere shows (m²); else 0.
    area: f32,
    // Intensity (W·sr⁻¹), irradiance on a facing plane (W·m⁻²), or mean radiance over the triangle or all directions
    // (W·m⁻²·sr⁻¹).
    intensity: vec3f,
    // Probability that this light or an earlier one is selected as a sample of direct light; the last is 1.
    cdf: f32,
    // Triangle: second corner − first (m).
    edge1: vec3f,
    // Spot: cosine up to which the intensity is full.
    cos_inner: f32,
    // Triangle: third corner − first (m).
    edge2: vec3f,
    // Spot: cosine from which on it is zero; less than cos_inner.
    cos_outer: f32,
    // The guide (m, world); radius 0: photons leave into all of the light's directions.
    guide_center: vec3f,
    guide_radius: f32,
    // Probability that this light is selected: its step of `cdf`.
    probability: f32,
    // Triangle: index into `materials`, else 0xffffffff.
    material: u32,
    // Triangle: index into `triangles`, else 0xffffffff.
    triangle: u32,
    // 1: a triangle that emits from both sides.
    two_sided: u32,
    // Share of the photons that lights before this one have, in 2⁻³²; 0xffffffff: no photon is left. Uniform, guided emission.
    photon_start: vec2u,
    // Share of the photons that this light has.
    photon_probability: vec2f,
}

// Lights that follow one map of where photons go: a punctual light, or a piece of an emissive surface. In the order of their lights.
struct LightGroup {
    // Unit: normal of the piece's first triangle, near that of all; zero of a punctual light.
    axis: vec3f,
    // Index of its first light.
    first: u32,
    // Lights.
    count: u32,
    // Share of the photons that they have together.
    photon_probability: f32,
    // Its views among `light_views`; a light without any is traced.
    first_view: u32,
    view_count: u32,
}

// What a light sees, as one picture.
struct LightView {
    // Depth 1 is nearest.
    clip_from_world: mat4x4f,
}
