//! Rough dielectrics: both lobes of `scatter`, against the density of `surface_response` and f of [Walter07] in f64.

use super::{Sampler, SamplerParams, above, local, mean_weight, tilted};
use glam::DVec3;
use lightloom_tests::microfacet::Interface;
use lightloom_tests::{Cells, Lab, Mean};

const GLASS: &str = r"
fn glass() -> Surface {
    var s: Surface;
    s.brdf = Brdf(params.normal, params.base_color, params.roughness, 0.0, params.f0, false, false);
    s.normal_geometric = params.normal;
    s.front = params.front != 0u;
    s.transmission = params.transmission;
    s.ior = params.ior;
    s.thickness = params.thickness;
    s.rough_dielectric = true;
    return s;
}
fn density(w: vec3f) -> f32 { return surface_response(glass(), w, params.wo, params.radiance != 0u).pdf; }
";
const SCATTER: &str = r"
fn drawn(u: vec4f) -> Drawn {
    let it = scatter(glass(), params.wo, u, params.radiance != 0u);
    return Drawn(it.direction, it.pdf, it.weight, it.glossy);
}
";
/// f both ways: as radiance from `ω_i` to `ω_o`, as radiance back, and as flux that comes from `ω_i`.
const BOTH_WAYS: &str = r"
fn drawn(u: vec4f) -> Drawn {
    let wi = scatter(glass(), params.wo, u, true).direction;
    let there = surface_response(glass(), wi, params.wo, true).value.x / abs(dot(wi, params.normal));
    var other = glass();
    if dot(wi, params.normal) < 0.0 {
        other.brdf.normal = -params.normal;
        other.normal_geometric = -params.normal;
        other.front = params.front == 0u;
    }
    let back = surface_response(other, params.wo, wi, true).value.x / abs(dot(params.wo, params.normal));
    let flux = surface_response(other, params.wo, wi, false).value.x / abs(dot(params.wo, params.normal));
    return Drawn(wi, 1.0, vec3f(there, back, flux), true);
}
";
const IOR: f64 = 1.5;
/// From just above `MIN_ALPHA` on.
const ROUGHNESS: [f32; 4] = [0.032, 0.2, 0.5, 1.0];
const COSINES: [f64; 3] = [1.0, 0.6, 0.15];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// `ω_o` is outside of a solid.
    Outside,
    /// Inside; two of the cosines are beyond the critical angle.
    Inside,
    Thin,
}

const KINDS: [Kind; 3] = [Kind::Outside, Kind::Inside, Kind::Thin];

fn params(kind: Kind, cos: f64, roughness: f32) -> SamplerParams {
    let normal = tilted();
    SamplerParams {
        normal: normal.as_vec3().to_array(),
        wo: above(normal, cos).as_vec3().to_array(),
        roughness,
        base_color: [1.0, 0.5, 0.25],
        ior: IOR as f32,
        thickness: if kind == Kind::Thin { 0.0 } else { 1.0 },
        transmission: 1.0,
        front: u32::from(kind != Kind::Inside),
        ..SamplerParams::default()
    }
}

/// The same in f64, `ω_o` above.
fn interface(kind: Kind, roughness: f32) -> Interface {
    let (above, below) = if kind == Kind::Inside { (IOR, 1.0) } else { (1.0, IOR) };
    Interface { alpha: f64::from(roughness).powi(2), above, below, thin: kind == Kind::Thin }
}

/// Where a smooth interface sends light from `wo`: the reflected and the transmitted direction, along the surface if there is none.
fn smooth(kind: Kind, normal: DVec3, wo: DVec3) -> [DVec3; 2] {
    let eta = match kind {
        Kind::Outside => IOR,
        Kind::Inside => 1.0 / IOR,
        Kind::Thin => 1.0,
    };
    let along = (normal * wo.dot(normal) - wo) / eta;
    let cos2 = 1.0 - along.length_squared();
    [2.0 * normal * wo.dot(normal) - wo, along - normal * cos2.max(0.0).sqrt()].map(DVec3::normalize)
}

#[test]
fn both_lobes_follow_their_density_and_weigh_f_cos_over_pdf() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, &format!("{GLASS}{SCATTER}"));
    let normal = tilted();
    for kind in KINDS {
        for roughness in ROUGHNESS {
            for cos in COSINES {
                let params = params(kind, cos, roughness);
                let what = format!("{kind:?}, roughness {roughness}, cos {cos}");
                let drawn = sampler.draw(&mut lab, &params);
                let wo = above(normal, cos);
                let model = interface(kind, roughness);
                // Refraction bends by a third of a facet's tilt.
                let poles = smooth(kind, normal, wo).into_iter().zip([0.5, 0.2]);
                let cells = poles.map(|(pole, width)| Cells::new(pole, width * model.alpha * cos, super::RINGS, super::SECTORS));
                for ((cells, side), lobe) in cells.clone().zip([1.0, -1.0]).zip(["reflected", "transmitted"]) {
                    sampler.assert_follows(&mut lab, &params, &drawn, &cells, side, &format!("{what}, {lobe}"));
                }
                let f_cos = |wi: DVec3| {
                    let wi = local(normal, wi);
                    // A photon that came from ω_o.
                    if wi.z == 0.0 { 0.0 } else { model.f(local(normal, wo), wi) * wi.z.abs() }
                };
                for draw in &drawn {
                    let length = draw.direction.length();
                    assert!(draw.pdf == 0.0 || (length - 1.0).abs() < 1e-5, "{what}: unit: {}", draw.direction);
                    // As for reflection: D of the density is off by 4·10⁻⁷/α², near the horizon the cosine by 10⁻⁷ of 10⁻².
                    if draw.direction.dot(normal).abs() > 1e-2 && draw.pdf > 1e-3 && model.alpha > 0.02 {
                        let expected = f_cos(draw.direction) / draw.pdf;
                        assert!((draw.weight.x - expected).abs() < 2e-3 * expected, "{what}: {} for {expected}", draw.weight.x);
                    }
                }
                let on_side = |side: f64, cells: &Cells| {
                    let fine = Cells { rings: 96, sectors: 96, ..*cells };
                    fine.integrate(4, |w| if w.dot(normal) * side > 0.0 { f_cos(w) } else { 0.0 })
                };
                let [reflected, passed] = [1.0, -1.0].map(|side| {
                    let cells = cells.clone().nth(usize::from(side < 0.0)).expect("two poles");
                    on_side(side, &cells)
                });
                // Four points each way in a cell; the horizon is off by their distance at most.
                let bias = 1e-3;
                mean_weight(&drawn, 0).assert_near(reflected + passed, bias, &format!("{what}: energy"));
                mean_weight(&drawn, 2).assert_near(reflected + 0.25 * passed, bias, &format!("{what}: tinted"));
                assert!(reflected + passed < 1.0 + bias, "{what}: scatters {reflected} + {passed} of the light");
                // Radiance is denser inside by η²; of a thin wall both sides are outside.
                let radiance = sampler.draw(&mut lab, &SamplerParams { radiance: 1, ..params });
                let eta2 = if kind == Kind::Thin { 1.0 } else { (model.below / model.above).powi(2) };
                mean_weight(&radiance, 0).assert_near(
                    reflected + passed / eta2,
                    bias / eta2.min(1.0),
                    &format!("{what}: radiance"),
                );
            }
        }
    }
}

/// Half is transmitted, half reflected by the base below: one density, from which both are drawn.
#[test]
fn a_frosted_coat_draws_from_all_its_lobes() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, &format!("{GLASS}{SCATTER}"));
    let normal = tilted();
    let params = SamplerParams { transmission: 0.6, f0: 0.04, ..params(Kind::Outside, 0.2, 1.0) };
    let drawn = sampler.draw(&mut lab, &params);
    let [reflected, transmitted] = smooth(Kind::Outside, normal, above(normal, 0.2));
    for (pole, side) in [(reflected, 1.0), (transmitted, -1.0)] {
        let cells = Cells::new(pole, 0.1, super::RINGS, super::SECTORS);
        sampler.assert_follows(&mut lab, &params, &drawn, &cells, side, &format!("coat, side {side}"));
    }
}

#[test]
fn scattering_is_reciprocal_but_for_the_square_of_the_index() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, &format!("{GLASS}{BOTH_WAYS}"));
    let normal = tilted();
    for kind in KINDS {
        for roughness in [0.2, 0.5, 1.0] {
            for cos in COSINES {
                let model = interface(kind, roughness);
                let what = format!("{kind:?}, roughness {roughness}, cos {cos}");
                let mut sides = [0; 2];
                // Whoever looks from the other side sees the same tint.
                let params = SamplerParams { base_color: [1.0; 3], ..params(kind, cos, roughness) };
                for draw in sampler.draw(&mut lab, &params).iter().take(20_000) {
                    let below = draw.direction.dot(normal) < 0.0;
                    let DVec3 { x: there, y: back, z: flux } = draw.weight;
                    if draw.direction.dot(normal).abs() < 1e-2 || there < 1e-3 {
                        continue;
                    }
                    sides[usize::from(below)] += 1;
                    let n_o = model.above;
                    let n_i = if below && kind != Kind::Thin { model.below } else { model.above };
                    // Both halve the same angle, in floats: D is off by 4·10⁻⁷/α² of itself.
                    let bound = 1e-3 * there;
                    assert!((back * (n_o / n_i).powi(2) - there).abs() < bound, "{what}: {there} there and {back} back");
                    assert!((flux - there).abs() < bound, "{what}: {there} of radiance and {flux} of flux");
                }
                assert!(sides.iter().sum::<u32>() > 5_000, "{what}: {sides:?} directions");
            }
        }
    }
}

/// α → 0 is Fresnel's split and Snell's direction.
#[test]
fn the_finest_frost_is_a_smooth_interface() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, &format!("{GLASS}{SCATTER}"));
    let normal = tilted();
    for kind in KINDS {
        for cos in [1.0, 0.8, 0.3] {
            let params = params(kind, cos, 0.032);
            let what = format!("{kind:?}, cos {cos}");
            let drawn = sampler.draw(&mut lab, &params);
            let model = interface(kind, 0.032);
            let (alpha, reflectance) = (model.alpha, model.reflectance(cos, true));
            let up: Vec<f64> = drawn.iter().map(|d| f64::from(u8::from(d.direction.dot(normal) > 0.0))).collect();
            // R changes by less than 2 per radian down to 17° above the surface, the mean tilt of facets is below 2α.
            Mean::of(&up).assert_near(reflectance, 4.0 * alpha, &format!("{what}: reflected"));
            let directions = smooth(kind, normal, above(normal, cos));
            let near = |d: &super::Drawn| directions.iter().any(|w| w.distance(d.direction) < 40.0 * alpha);
            let share = drawn.iter().filter(|d| near(d)).count() as f64 / drawn.len() as f64;
            // Beyond a slope of 10 α lies 1/101 of GGX's facets; they turn light by twice their tilt, and no more than twice that where
            // it leaves at 44°.
            assert!(share > 0.985, "{what}: {share} of the light goes where a smooth interface sends it");
        }
    }
}
