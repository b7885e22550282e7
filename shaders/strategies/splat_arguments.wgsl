// Arguments of the draw of one hull per stored photon.
#import "shared/photon_store.wgsl"

struct Params {
    vertices: u32,
    // Records that the store holds.
    capacity: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photon_state: PhotonState;
// Vertices, instances, first vertex, first instance.
@group(0) @binding(2) var<storage, read_write> arguments: vec4u;

@compute @workgroup_size(1)
fn splat_arguments() {
    arguments = vec4u(params.vertices, min(photon_state.stored, params.capacity), 0u, 0u);
}
