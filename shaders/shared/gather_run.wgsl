// A run of candidates summed at a point. Needs two functions of whoever imports it: whether the candidate `i` is near `position`,
//
//     fn in_reach(i: u32, position: vec3f) -> bool
//
// and what it adds to the sum, if it is:
//
//     fn add_candidate(sum: ptr<function, RadianceSum>, point: VisiblePoint, i: u32)
#import "shared/gather_sampling.wgsl"
#import "shared/radiance_sum.wgsl"

// Bit `i` where candidate `first + i` is in reach.
fn reach_bit(first: u32, i: u32, last: u32, position: vec3f) -> u32 {
    return select(0u, 1u << i, in_reach(min(first + i, last), position));
}

// Adds the candidates of a run, in their order. Tests 32 of them first and then sums those near the point: threads run in
// lockstep, and a contribution should cost once per photon that counts, not once per candidate. Eight tests to a turn of
// the loop: drivers that count turns allow runs eight times as long.
fn gather_run(sum: ptr<function, RadianceSum>, point: VisiblePoint, run: vec2u) {
    for (var first = run.x; first < run.y; first += 32u) {
        var near = 0u;
        let batch = min(32u, run.y - first);
        let last = run.y - 1u;
        for (var i = 0u; i < batch; i += 8u) {
            near |= reach_bit(first, i, last, point.position) | reach_bit(first, i + 1u, last, point.position)
                | reach_bit(first, i + 2u, last, point.position) | reach_bit(first, i + 3u, last, point.position)
                | reach_bit(first, i + 4u, last, point.position) | reach_bit(first, i + 5u, last, point.position)
                | reach_bit(first, i + 6u, last, point.position) | reach_bit(first, i + 7u, last, point.position);
        }
        near &= 0xffffffffu >> (32u - batch);
        (*sum).tested += batch;
        (*sum).pending += countOneBits(near);
        while near != 0u {
            let i = first + firstTrailingBit(near);
            near &= near - 1u;
            add_candidate(sum, point, i);
        }
    }
}

// Adds those candidates of a run that `picker` takes; without their weight, see `finish_sum`.
fn gather_picked(sum: ptr<function, RadianceSum>, picker: ptr<function, PhotonPicker>, point: VisiblePoint, run: vec2u) {
    var begin = run.x;
    while begin + (*picker).skip < run.y {
        let i = begin + (*picker).skip;
        (*sum).tested += i + 1u - begin;
        begin = i + 1u;
        (*picker).skip = pick_skip(picker);
        if in_reach(i, point.position) {
            (*sum).pending += 1u;
            add_candidate(sum, point, i);
        }
    }
    // The rest is passed over; unless the loop was ended early.
    let rest = run.y - begin;
    if (*picker).skip >= rest {
        (*picker).skip -= rest;
        (*sum).tested += rest;
    }
}

// Adds the candidates of a run, or those of them that `picker` takes.
fn gather(sum: ptr<function, RadianceSum>, picker: ptr<function, PhotonPicker>, point: VisiblePoint, run: vec2u) {
    if STOCHASTIC {
        gather_picked(sum, picker, point, run);
    } else {
        gather_run(sum, point, run);
    }
}

// Makes up for the photons that were not taken, after the last run.
fn finish_sum(sum: ptr<function, RadianceSum>, sampling: GatherSampling) {
    if STOCHASTIC {
        (*sum).indirect *= sampling.weight;
        (*sum).caustic *= sampling.weight;
    }
}
