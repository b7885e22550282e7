//! Reflection: the cosine's hemisphere, visible normals, and the mixture of both lobes.

use super::{Drawn, Sampler, SamplerParams, above, local, mean_weight, tilted};
use glam::DVec3;
use lightloom_tests::microfacet::{self, Reflection};
use lightloom_tests::{Cells, Lab};
use std::f64::consts::PI;

const REFLECT: &str = r"
fn brdf() -> Brdf {
    return Brdf(params.normal, params.base_color, params.roughness, params.metallic, params.f0,
        params.roughness >= 1.0 && params.metallic == 0.0 && params.f0 == 0.0, false);
}
fn drawn(u: vec4f) -> Drawn {
    let it = brdf_sample(brdf(), params.wo, u.xyz);
    return Drawn(it.direction, it.pdf, it.weight, it.glossy);
}
fn density(w: vec3f) -> f32 { return brdf_pdf(brdf(), w, params.wo); }
";
/// In the local frame of `sample_visible_normal`.
const NORMALS: &str = r"
fn drawn(u: vec4f) -> Drawn {
    let h = sample_visible_normal(params.wo, params.roughness * params.roughness, u.xy);
    return Drawn(h, density(h), vec3f(0.0), true);
}
fn density(w: vec3f) -> f32 {
    if w.z <= 0.0 { return 0.0; }
    let alpha = params.roughness * params.roughness;
    return ggx_visible_density(alpha, params.wo.z, params.normal, w) * max(dot(w, params.wo), 0.0);
}
";
/// From just above `MIN_ALPHA` on.
const ROUGHNESS: [f32; 5] = [0.032, 0.1, 0.25, 0.5, 1.0];
/// Down to 3° above the surface.
const COSINES: [f64; 4] = [1.0, 0.7, 0.2, 0.05];

fn params(normal: DVec3, cos: f64, roughness: f32) -> SamplerParams {
    let [normal_, wo] = [normal, above(normal, cos)].map(|w| w.as_vec3().to_array());
    SamplerParams { normal: normal_, wo, roughness, ..SamplerParams::default() }
}

/// Half the width of a reflected lobe across the plane of incidence, its narrow side.
fn lobe_width(alpha: f64, cos: f64) -> f64 {
    0.5 * alpha * cos
}

fn reflected(normal: DVec3, wo: DVec3) -> DVec3 {
    (2.0 * normal.dot(wo) * normal - wo).normalize()
}

#[test]
fn a_lambertian_draws_by_the_cosine() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, REFLECT);
    let normal = tilted();
    let params = SamplerParams { base_color: [1.0, 0.5, 0.25], ..params(normal, 0.3, 1.0) };
    let drawn = sampler.draw(&mut lab, &params);
    let cells = Cells::new(DVec3::X, 1.0, super::RINGS, super::SECTORS);
    sampler.assert_follows(&mut lab, &params, &drawn, &cells, 0.0, "Lambert");
    for Drawn { direction, pdf, weight, glossy } in drawn {
        // f cos / pdf = albedo, exactly: the white furnace.
        assert!(weight == DVec3::new(1.0, 0.5, 0.25) && !glossy, "{weight}");
        assert!((pdf - direction.dot(normal) / PI).abs() < 1e-6, "{pdf} towards {direction}");
    }
}

#[test]
fn normals_are_drawn_as_they_are_visible() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, NORMALS);
    for roughness in ROUGHNESS {
        for cos in COSINES {
            let params = params(DVec3::Z, cos, roughness);
            let drawn = sampler.draw(&mut lab, &params);
            let alpha = f64::from(roughness).powi(2);
            let cells = Cells::new(DVec3::Z, 0.5 * alpha, super::RINGS, super::SECTORS);
            sampler.assert_follows(&mut lab, &params, &drawn, &cells, 0.0, &format!("normals, α {alpha:.4}, cos {cos}"));
            for draw in drawn.iter().take(1000).filter(|_| alpha > 0.05) {
                let expected = microfacet::visible_normals(alpha, above(DVec3::Z, cos), draw.direction);
                assert!((draw.pdf - expected).abs() < 1e-3 * (expected + 1.0), "density {} for {expected}", draw.pdf);
            }
        }
    }
}

/// Metals, and dielectrics whose diffuse lobe is drawn as well.
#[test]
fn reflection_draws_as_it_says_and_weighs_f_cos_over_pdf() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::new(&lab, REFLECT);
    let normal = tilted();
    for roughness in ROUGHNESS {
        for cos in COSINES {
            for (metallic, base_color) in [(1.0, [1.0, 0.8, 0.3]), (0.0, [1.0, 0.5, 0.2]), (0.4, [0.9, 0.5, 0.2])] {
                let params = SamplerParams { metallic, base_color, f0: 0.04, ..params(normal, cos, roughness) };
                let what = format!("roughness {roughness}, cos {cos}, metallic {metallic}");
                let drawn = sampler.draw(&mut lab, &params);
                let wo = above(normal, cos);
                let alpha = f64::from(roughness).powi(2);
                let cells = Cells::new(reflected(normal, wo), lobe_width(alpha, cos), super::RINGS, super::SECTORS);
                sampler.assert_follows(&mut lab, &params, &drawn, &cells, 0.0, &what);

                let model = |channel: usize| Reflection {
                    base_color: f64::from(base_color[channel]),
                    roughness: f64::from(roughness),
                    metallic: f64::from(metallic),
                    f0: f64::from(params.f0),
                };
                let f_cos = |channel: usize, wi: DVec3| {
                    let wi = local(normal, wi);
                    model(channel).f(wi, local(normal, wo)) * wi.z
                };
                for draw in &drawn {
                    assert!((draw.direction.length() - 1.0).abs() < 1e-5, "{what}: unit: {}", draw.direction);
                    if draw.direction.dot(normal) < 1e-3 || alpha < 0.05 {
                        continue;
                    }
                    // A half vector in floats is off by 10⁻⁷ and D of it by 4·10⁻⁷/α² of itself at most; both sides of the quotient hold
                    // D, in other proportions.
                    let expected = f_cos(0, draw.direction) / draw.pdf;
                    assert!((draw.weight.x / expected - 1.0).abs() < 2e-3, "{what}: weight {} for {expected}", draw.weight.x);
                }
                for channel in [0, 2] {
                    let mut furnace = Cells { rings: 64, sectors: 48, ..cells };
                    furnace.sectors *= 2;
                    let albedo = furnace.integrate(4, |wi| f_cos(channel, wi));
                    // Halving the midpoints' distance changes these integrals by less than 2·10⁻³ (the horizon).
                    mean_weight(&drawn, channel).assert_near(albedo, 2e-3 * albedo, &format!("{what}, albedo {channel}"));
                    // glTF's dielectric keeps no balance: a white one reflects 1.3 at grazing angles. Its metal does.
                    assert!(metallic < 1.0 || albedo < 1.0 + 2e-3, "{what}: reflects {albedo} of the light");
                }
            }
        }
    }
}
