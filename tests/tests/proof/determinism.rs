//! The same seed gives the same photons in the same order, always; with `deterministic` the same images bit for bit.

use lightloom_graph::bytemuck;
use lightloom_graph::wgpu::DeviceType;
use lightloom_passes::scene::builtin;
use lightloom_passes::{Photon, PhotonSettings};
use lightloom_tests::{Frame, Lab, View, strategies};

/// `emitted` photons, with room for three records each.
pub(crate) fn settings(emitted: u32, max_bounces: u32, seed: u32) -> PhotonSettings {
    PhotonSettings { emitted, capacity: 3 * emitted, max_bounces, seed, caustics_only: false, light_vertices: false, cull: None }
}

#[test]
fn one_seed_gives_the_same_photons_in_the_same_order() {
    let Some(mut lab) = Lab::open() else { return };
    for scene in [builtin::cornell(), builtin::caustics()] {
        let gpu_scene = lab.upload(&scene);
        // More than one batch of 65,536.
        let settings = settings(80_000, 4, 5);
        let first = lab.photons(&gpu_scene, &settings);
        let second = lab.photons(&gpu_scene, &settings);
        assert_eq!(first.state, second.state, "{}: counts and ledger", scene.name);
        assert!(first.records.len() > 30_000, "{}: {} records", scene.name, first.records.len());
        let bytes = [&first, &second].map(|traced| bytemuck::cast_slice::<_, u8>(&traced.records));
        assert!(bytes[0] == bytes[1], "{}: the records differ", scene.name);

        let other = lab.photons(&gpu_scene, &PhotonSettings { seed: 6, ..settings });
        let place = |photon: &Photon| photon.position.map(f32::to_bits);
        let same = first.records.iter().zip(&other.records).filter(|(a, b)| place(a) == place(b)).count();
        assert!(same * 1000 < first.records.len(), "{}: {same} positions are those of another seed", scene.name);
    }
}

#[test]
fn deterministic_images_are_equal_bit_for_bit() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    let view = View::new(scene.cameras[0].clone(), [96, 54]);
    let mut all = strategies(&lab.sources, 0.04, 0.12);
    let frame = Frame { photons: settings(30_000, 5, 3), maps: None, deterministic: true };
    let first = lab.estimate(&gpu_scene, &view, frame, &mut all);
    if lab.gpu.adapter.get_info().device_type == DeviceType::Cpu {
        // Lists in ascending order are summed as `exact` sums; where both shaders are compiled alike, which a compiler for a GPU need not
        // do, that shows in every bit. Threads may happen never to race: then only this tells sorted lists from others.
        assert!(first.layers[0] == first.layers[1], "tiled sums in another order than exact");
    }
    for round in 0..3 {
        let again = lab.estimate(&gpu_scene, &view, frame, &mut all);
        for ((strategy, first), again) in all.iter().zip(&first.layers).zip(&again.layers) {
            assert!(first == again, "{}: round {round} differs", strategy.name());
            assert!(first[0].mean()[0] > 0.0 && first[1].mean()[0] > 0.0, "{} sees light", strategy.name());
        }
    }
}
