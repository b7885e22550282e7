// Sums at each visible point the photons of the rows that its search sphere touches, each row as one run of the sorted photons.
#import "shared/gather_run.wgsl"
#import "shared/gather_sampling.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/sorted_grid.wgsl"
#import "shared/sorted_grid_gather.wgsl"

// Whether the sphere of the photon holds `position`.
fn in_reach(i: u32, position: vec3f) -> bool {
    let sphere = textureLoad(sorted_spheres, sorted_texel(i), 0);
    let offset = sphere.xyz - position;
    return dot(offset, offset) < sphere.w * sphere.w;
}

fn add_candidate(sum: ptr<function, RadianceSum>, point: VisiblePoint, i: u32) {
    let sphere = textureLoad(sorted_spheres, sorted_texel(i), 0);
    let light = textureLoad(sorted_light, sorted_texel(i), 0);
    add_photon(sum, point, Photon(sphere.xyz, light.x, light.y, light.z, 0u, light.w), sphere.w);
}

@compute @workgroup_size(8, 8)
fn sorted_grid_gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    var picker = photon_picker(params.sampling, id.xy);
    var sum: RadianceSum;
    var expected = 0u;
    var rows = 0u;
    var expected_rows = 0u;
    if point.gatherable {
        let first = vec2i(floor(cell_place(params.grid, point.position - params.reach).yz));
        let last = vec2i(floor(cell_place(params.grid, point.position + params.reach).yz));
        let span = vec2u(last - first) + 1u;
        expected_rows = span.x * span.y;
        for (var z = first.y; z <= last.y; z++) {
            for (var y = first.x; y <= last.x; y++) {
                let buckets = row_buckets(params.grid, vec2i(y, z), point.position, point.position, params.reach);
                let run = vec2u(bucket_offsets[buckets.x], bucket_offsets[buckets.y]);
                rows += 1u;
                expected += run.y - run.x;
                gather(&sum, &picker, point, run);
            }
        }
    }
    finish_sum(&sum, params.sampling);
    if sum_is_cut(sum, expected) || rows != expected_rows {
        atomicAdd(&stats[4], 1u);
    }
    textureStore(indirect, id.xy, vec4f(sum.indirect, 1.0));
    textureStore(caustic, id.xy, vec4f(sum.caustic, 1.0));
}
