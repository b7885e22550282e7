// Which photons a pixel takes: stochastic selection, after [MML13] section 2.3.2.
//
// The paper steps geometrically and rescales by length / count, which is biased where few photons are taken. Here each photon is
// taken with probability p whatever became of the others, and weighs 1 / p; the geometric step is the fast way to draw that.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
#import "shared/rng.wgsl"

// Whether pixels take some of the photons only. Set from Rust (`GatherSampling`).
override STOCHASTIC: bool = false;

struct GatherSampling {
    // Of this frame.
    seed: u32,
    // 1 / ln(1 − p), p the probability with which a photon is taken.
    inverse_log: f32,
    // 1 / p.
    weight: f32,
    pad0: u32,
}

// Takes each of a sequence of photons with probability p, whatever became of the others.
struct PhotonPicker {
    rng: Rng,
    inverse_log: f32,
    // Photons to pass over before the next is taken; the sequence goes on from run to run.
    skip: u32,
}

// Photons passed over between two taken ones: geometrically distributed.
fn pick_skip(picker: ptr<function, PhotonPicker>) -> u32 {
    // naga's SPIR-V has no pointers to members as arguments.
    var rng = (*picker).rng;
    let u = rng_next4(&rng).x;
    (*picker).rng = rng;
    return u32(log(1.0 - u) * (*picker).inverse_log);
}

fn photon_picker(sampling: GatherSampling, pixel: vec2u) -> PhotonPicker {
    var picker = PhotonPicker(rng_new(sampling.seed, pixel.x, pixel.y), sampling.inverse_log, 0u);
    if STOCHASTIC {
        picker.skip = pick_skip(&picker);
    }
    return picker;
}
