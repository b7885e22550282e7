//! PHYSICS check 3: emitted = absorbed + escaped + ended by roulette or depth, in integers; and what a full store drops.

use crate::determinism::settings;
use lightloom_graph::bytemuck;
use lightloom_passes::scene::builtin;
use lightloom_passes::{Photon, PhotonSettings};
use lightloom_tests::Lab;

#[test]
fn flux_balances_to_the_last_bit() {
    let Some(mut lab) = Lab::open() else { return };
    for (scene, closed) in [(builtin::cornell(), false), (builtin::caustics(), false), (builtin::closed_sphere(4), true)] {
        let name = &scene.name;
        let gpu_scene = lab.upload(&scene);
        let settings = settings(100_000, 6, 1);
        let state = lab.photons(&gpu_scene, &settings).state;
        let ledger = state.flux_ledger();
        println!("{name}: {ledger:?}");
        assert!(ledger.balances(), "{name}: {ledger:?}");
        // On grey walls roulette does all the absorbing, and says so under `terminated`.
        for kind in [Some(ledger.emitted), Some(ledger.terminated), (!closed).then_some(ledger.absorbed)].into_iter().flatten() {
            assert!(kind.iter().all(|&flux| flux > 0), "{name}: {ledger:?}");
        }
        // What was emitted is the lights' flux: rounding to whole units, of which a photon has about 2²⁰, is the only error
        // where all photons carry the same flux.
        let scale = f64::from(settings.ledger_scale(&gpu_scene.info()));
        for (channel, &emitted) in ledger.emitted.iter().enumerate() {
            let power = f64::from(gpu_scene.info().total_power[channel]);
            let error = emitted as f64 / scale / power - 1.0;
            assert!(error.abs() < 1e-5, "{name}: channel {channel} emitted {error:e} more than the lights' power");
        }
        // A ray may slip between two facets where both tests of their common edge round against it: a chance of about one ulp
        // of an edge's width per ray, 10⁻⁶ of some 300,000 rays.
        let photon = ledger.emitted[1] / i64::from(settings.emitted);
        assert!(!closed || ledger.escaped[1] <= 2 * photon, "{name} leaks {} photons", ledger.escaped[1] / photon);
        assert!(closed || ledger.escaped[1] > 100 * photon, "{name}: light leaves through the open side");
    }
}

#[test]
fn a_full_store_counts_what_it_drops_and_changes_nothing_else() {
    const CAPACITY: u32 = 30_001;
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::cornell());
    // Two batches; the store is full within the first.
    let roomy = settings(100_000, 4, 9);
    let whole = lab.photons(&gpu_scene, &roomy);
    let tight = lab.photons(&gpu_scene, &PhotonSettings { capacity: CAPACITY, ..roomy });
    assert_eq!(whole.state.dropped, 0, "the roomy store holds all");
    assert_eq!(whole.state.stored, whole.state.total, "the roomy store holds all");
    assert!(whole.state.total > 2 * CAPACITY, "the tight store overflows");
    assert_eq!(tight.state.stored, CAPACITY, "the tight store is full");
    assert_eq!(tight.state.dropped, whole.state.total - CAPACITY, "the rest is counted");
    assert_eq!(tight.state.total, whole.state.total, "stored and dropped");
    assert_eq!(tight.state.ledger, whole.state.ledger, "the light is the same");
    let bytes = |records: &[Photon]| bytemuck::cast_slice::<_, u8>(records).to_vec();
    assert!(bytes(&tight.records) == bytes(&whole.records[..CAPACITY as usize]), "the first records are the same");
}
