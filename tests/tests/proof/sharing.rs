//! The object pool shares memory between resources whose lifetimes do not overlap, and no picture shows it.

use crate::determinism::settings;
use lightloom_graph::Sharing;
use lightloom_passes::scene::builtin;
use lightloom_tests::{Frame, Lab, View, strategies};

#[test]
fn a_frame_is_the_same_with_and_without_sharing() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    // Few pixels, for `exact` looks at every photon from each.
    let view = View::new(scene.cameras[0].clone(), [48, 27]);
    // All strategies and both batches of photons in one frame: much to share.
    let mut all = strategies(&lab.sources, 0.04, 0.12);
    let frame = Frame { photons: settings(70_000, 4, 13), maps: None, deterministic: true };
    lab.executor.set_sharing(Sharing::Off);
    let apart = lab.estimate(&gpu_scene, &view, frame, &mut all);
    lab.executor.set_sharing(Sharing::Merged);
    // The second frame finds the pool's memory full of the first one's contents.
    for round in 0..2 {
        let shared = lab.estimate(&gpu_scene, &view, frame, &mut all);
        assert!(apart.traced.records == shared.traced.records, "round {round}: the photons differ");
        assert_eq!(apart.traced.state, shared.traced.state, "round {round}: the counts differ");
        assert!(apart.positions == shared.positions, "round {round}: the G-buffers differ");
        for ((strategy, apart), shared) in all.iter().zip(&apart.layers).zip(&shared.layers) {
            assert!(apart == shared, "round {round}: {} differs", strategy.name());
            assert!(apart[0].mean()[1] > 0.0, "{} sees light", strategy.name());
        }
        let memory = &shared.memory;
        println!("{memory:?}");
        assert!(memory.allocated_bytes < memory.unshared_bytes, "sharing saves nothing: {memory:?}");
        assert!(memory.ordered_peak_live_bytes <= memory.allocated_bytes, "below the lower bound: {memory:?}");
    }
}
