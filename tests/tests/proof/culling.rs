//! Photons left out at deposit are those that no pixel gathers: the image does not change, whatever is left out.

use lightloom_passes::scene::builtin;
use lightloom_passes::{CameraUniform, DepositCull, PhotonSettings};
use lightloom_tests::{Frame, Lab, View, strategies};

#[test]
fn culling_at_deposit_changes_no_pixel() {
    const REACH_M: f32 = 0.15;
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    // A narrow look at a corner: kernels reach in from outside the frustum on all sides.
    let mut camera = scene.cameras[0].clone();
    camera.yfov *= 0.4;
    let view = View::new(camera, [48, 32]);
    let uniform = CameraUniform::new(&view.camera, view.size, view.jitter, gpu_scene.info().bounds_radius);
    let mut all = strategies(&lab.sources, REACH_M, REACH_M);
    let mut render = |cull| {
        let photons = PhotonSettings { cull, ..PhotonSettings::new(40_000, 4, 2) };
        lab.estimate(&gpu_scene, &view, Frame { photons, maps: None, deterministic: true }, &mut all)
    };
    let whole = render(None);
    let culled = render(Some(DepositCull::new(&uniform, REACH_M)));
    let (before, after) = (whole.traced.state, culled.traced.state);
    println!("{} records, {} with culling", before.stored, after.stored);
    assert_eq!(after.stored + after.culled, before.stored, "each record is stored or counted as culled");
    assert!(after.stored * 3 < before.stored, "most of the room is out of sight: {} of {}", after.stored, before.stored);
    assert_eq!(before.ledger, after.ledger, "the light is the same");
    for (strategy, (whole, culled)) in whole.layers.iter().zip(&culled.layers).enumerate() {
        assert!(whole[0].mean()[0] > 0.0, "strategy {strategy} sees light");
        // In one order, sums of the same photons are equal to the last bit.
        assert!(whole == culled, "strategy {strategy}: culling changed the image");
    }
    // And it does change where the reach is left out of account.
    let without_reach = render(Some(DepositCull::new(&uniform, 0.0)));
    assert!(without_reach.layers[0] != whole.layers[0], "the check sees light that is lost");

    // Radii by neighbours look for photons as far again.
    for strategy in &mut all {
        strategy.set("r_min", "0.02").and_then(|()| strategy.set("nearest", "30")).expect("every strategy has them");
    }
    let mut render = |cull| {
        let photons = PhotonSettings { cull, ..PhotonSettings::new(40_000, 4, 2) };
        lab.estimate(&gpu_scene, &view, Frame { photons, maps: None, deterministic: true }, &mut all).layers
    };
    let whole = render(None);
    assert!(render(Some(DepositCull::new(&uniform, 2.0 * REACH_M))) == whole, "culling changed the radii");
    assert!(render(Some(DepositCull::new(&uniform, REACH_M))) != whole, "the check sees neighbours that are lost");
}
