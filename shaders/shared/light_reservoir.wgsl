// What a pixel keeps of its frames' lights [Bitterli20]: one of them, chosen in proportion to what it brings, at where it was chosen. The
// light itself lies beside this.
//
// [Bitterli20]: "Spatiotemporal Reservoir Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting", SIGGRAPH 2020.

struct LightReservoir {
    // World (m).
    position: vec3f,
    // W of [Bitterli20, Eq. 6]: times what the light brings, an estimate of what all lights bring.
    weight: f32,
    // Shading and geometric normal, octahedral.
    normal: u32,
    normal_geometric: u32,
    // Frames whose candidates it stands for; 0: nothing is kept.
    frames: f32,
    pad0: u32,
}
