// The last four levels of the sums of importance, from 16² texels to one; a workgroup per map.

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var sums8: texture_storage_2d_array<r32float, write>;
@group(0) @binding(2) var sums4: texture_storage_2d_array<r32float, write>;
@group(0) @binding(3) var sums2: texture_storage_2d_array<r32float, write>;
@group(0) @binding(4) var sums1: texture_storage_2d_array<r32float, write>;

// Row by row, 8 to a row at every level.
var<workgroup> sums: array<f32, 64>;

fn quad(corner: vec2u) -> f32 {
    let i = corner.y * 8u + corner.x;
    return sums[i] + sums[i + 1u] + sums[i + 8u] + sums[i + 9u];
}

@compute @workgroup_size(8, 8)
fn rsm_pyramid_top(@builtin(local_invocation_id) local: vec3u, @builtin(workgroup_id) group: vec3u) {
    let map = group.z;
    let texel = local.xy;
    let corner = texel * 2u;
    let own = texel.y * 8u + texel.x;
    var sum = textureLoad(finer, corner, map, 0).x + textureLoad(finer, corner + vec2u(1u, 0u), map, 0).x
        + textureLoad(finer, corner + vec2u(0u, 1u), map, 0).x + textureLoad(finer, corner + vec2u(1u, 1u), map, 0).x;
    textureStore(sums8, texel, map, vec4f(sum, 0.0, 0.0, 0.0));
    sums[own] = sum;
    for (var width = 4u; width > 0u; width /= 2u) {
        workgroupBarrier();
        let inside = all(texel < vec2u(width));
        if inside {
            sum = quad(corner);
        }
        workgroupBarrier();
        if inside {
            sums[own] = sum;
            let value = vec4f(sum, 0.0, 0.0, 0.0);
            switch width {
                case 4u: { textureStore(sums4, texel, map, value); }
                case 2u: { textureStore(sums2, texel, map, value); }
                default: { textureStore(sums1, texel, map, value); }
            }
        }
    }
}
