//! What tracing photons takes: 32 bytes a stored photon, and a tenth of that for all that is in flight.

use lightloom_graph::Graph;
use lightloom_passes::scene::builtin;
use lightloom_passes::{Photon, PhotonSettings, PhotonTracing, shaders};
use lightloom_tests::Lab;

#[test]
fn three_million_photons_take_their_store_and_a_tenth() {
    const EMITTED: u32 = 3_000_000;
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::cornell());
    let settings = |capacity| PhotonSettings { capacity, ..PhotonSettings::new(EMITTED, 3, 1) };
    // A store as large as what is stored: a first run counts.
    let stored = lab.photons(&gpu_scene, &settings(1)).state.total;
    let tracing = PhotonTracing::new(&shaders()).expect("the shaders are valid");
    let mut graph = Graph::new("store");
    let handles = gpu_scene.declare(&mut graph);
    let photons = tracing.add(&mut graph, &handles, &gpu_scene.info(), &settings(stored));
    graph.readback_buffer(&photons.state);
    let memory = lab.run(graph).memory;
    let store = u64::from(stored) * size_of::<Photon>() as u64;
    let share = memory.allocated_bytes as f64 / store as f64;
    println!("{stored} photons: {store} bytes, allocated {} ({share:.3})", memory.allocated_bytes);
    assert!(memory.allocated_bytes >= store, "the store is part of it");
    assert!(share <= 1.1, "{share} of the store");
}
