//! PHYSICS check 13: mean flux depends neither on roulette nor on the seed.

use crate::determinism::settings;
use lightloom_graph::WgslSources;
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_passes::{PhotonSettings, PhotonTracing, decode_flux, shaders};
use lightloom_tests::{ChiSquare, Lab, Mean, Traced};

const ROULETTE: &str = "    if rng_next4(&rng).x >= survival {";

/// The shaders, with the probability of survival changed by a statement.
fn with_survival(statement: &str) -> WgslSources {
    let (path, text) =
        lightloom_shaders::FILES.iter().find(|(path, _)| *path == "passes/photon_scatter.wgsl").expect("it is embedded");
    assert!(text.matches(ROULETTE).count() == 1, "{path} has its roulette where this test looks for it");
    shaders().with(&[(path, &text.replace(ROULETTE, &format!("    {statement}\n{ROULETTE}")))])
}

/// Flux (W) that is stored.
fn stored(lab: &mut Lab, scene: &GpuScene, settings: &PhotonSettings) -> f64 {
    let Traced { records, state } = lab.photons(scene, settings);
    assert!(state.dropped == 0 && state.flux_ledger().balances(), "{state:?}");
    records.iter().map(|photon| f64::from(decode_flux(photon.flux).y)).sum()
}

/// Coloured walls, glass and metal; none, the usual, and one that halves every chance.
#[test]
fn mean_flux_is_the_same_with_any_roulette_and_with_none() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::caustics());
    let mut measure = |statement: &str| {
        lab.tracing = PhotonTracing::new(&with_survival(statement)).expect("the shader is valid");
        let of = |seed| PhotonSettings { capacity: 300_000, ..settings(40_000, 5, seed) };
        Mean::of(&(0..12).map(|seed| stored(&mut lab, &scene, &of(seed))).collect::<Vec<_>>())
    };
    let usual = measure("");
    for (name, statement) in [("none", "survival = 1.0;"), ("half", "survival *= 0.5;"), ("square", "survival *= survival;")] {
        let other = measure(statement);
        let error = usual.standard_error.hypot(other.standard_error);
        Mean { value: other.value, standard_error: error }.assert_near(usual.value, 0.0, name);
        assert!(error < 0.01 * usual.value, "{name}: precise enough to mean something: {other:?}");
    }
}

/// In a closed box of albedo ½ a photon leaves n records with the probability 2⁻ⁿ⁻¹: the scatter between seeds is known beforehand.
#[test]
fn sixteen_seeds_have_one_mean() {
    const EMITTED: u32 = 50_000;
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::closed_box(0.5));
    let fluxes: Vec<f64> = (0..16).map(|seed| stored(&mut lab, &scene, &settings(EMITTED, 24, 1000 + seed))).collect();
    // ρ/(1 − ρ) of the emitted flux, with the variance ρ/(1 − ρ)² per photon.
    let expected = f64::from(scene.info().total_power.y);
    let error = expected * (2.0 / f64::from(EMITTED)).sqrt();
    let squares: f64 = fluxes.iter().map(|flux| ((flux - expected) / error).powi(2)).sum();
    let mean = Mean { value: fluxes.iter().sum::<f64>() / 16.0, standard_error: error / 4.0 };
    mean.assert_near(expected, 0.0, "mean of 16 seeds");
    // All fluxes together, about the closed form.
    let chi2 = ChiSquare::new(squares, 16.0);
    chi2.assert_probable(1, "16 seeds");
    // Equal ones would be no better: seeds must differ.
    assert!(chi2.p < 0.999, "16 seeds scatter too little: {chi2:?}");
}
