// Which splat a block belongs to: the inverse of the prefix sum over the splats' numbers of blocks.

// Blocks before those of each splat; the last word is the number of all.
@group(0) @binding(6) var<storage, read> splat_offsets: array<u32>;

// The splat whose blocks begin at or before `block` and end after it; `block` is less than their number.
fn block_splat(block: u32) -> u32 {
    var low = 0u;
    var high = arrayLength(&splat_offsets) - 1u;
    // splat_offsets[low] ≤ block < splat_offsets[high].
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if splat_offsets[middle] <= block {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}
