// Finds or claims the slot of each photon's cell and counts the photons of the slot.
//
// A slot is claimed by writing the index of the claiming photon, plus 1, into it in one atomic step; the cell of the slot is
// the cell of that photon. So all three coordinates of a cell are compared, and no thread can see half of them written.
#import "shared/dispatch.wgsl"
#import "shared/hash_grid.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    grid: HashGrid,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read_write> slot_owners: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> slot_counts: array<atomic<u32>>;
// Slot of each photon and its rank in the slot's list.
@group(0) @binding(5) var<storage, read_write> photon_places: array<vec2u>;

@compute @workgroup_size(64)
fn hash_grid_insert(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let cell = grid_cell(params.grid, photon_position(photons[index], photon_state.grid));
    var slot = hash_cell(cell) & params.grid.slot_mask;
    // At most half of the slots are ever taken, so the search ends long before the bound.
    for (var attempt = 1u; attempt <= params.grid.slot_mask; attempt++) {
        var owner = atomicLoad(&slot_owners[slot]);
        // The weak exchange may fail although the slot is free; then it is tried again.
        while owner == 0u {
            let claim = atomicCompareExchangeWeak(&slot_owners[slot], 0u, index + 1u);
            owner = select(claim.old_value, index + 1u, claim.exchanged);
        }
        if all(grid_cell(params.grid, photon_position(photons[owner - 1u], photon_state.grid)) == cell) {
            photon_places[index] = vec2u(slot, atomicAdd(&slot_counts[slot], 1u));
            return;
        }
        slot = next_slot(params.grid, slot, attempt);
    }
}
