// Counts the photons of each screen tile: the estimate of photon density of [SA19] §24.3.1.1.
//
// A photon counts where it lies in the image and its surface faces the eye; whether something hides it is not asked.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/splat_kernel.wgsl"

struct Params {
    camera: Camera,
    kernel: SplatKernel,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read_write> tile_photons: array<atomic<u32>>;

@compute @workgroup_size(64)
fn density_tiles(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let photon = photon_load(photons[index], photon_state.grid);
    let position_view = (params.camera.view_from_world * vec4f(photon.position, 1.0)).xyz;
    let outside = abs(position_view.xy) > -position_view.z * params.camera.tan_half;
    if any(outside) || -position_view.z < params.camera.near_m {
        return;
    }
    if dot(octahedral_decode(photon.normal), camera_position(params.camera) - photon.position) <= 0.0 {
        return;
    }
    atomicAdd(&tile_photons[density_tile(params.camera, position_view, params.kernel)], 1u);
}
