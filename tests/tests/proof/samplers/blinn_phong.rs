//! [MML13]'s glossy model: half vectors of its own lobe, beside the cosine's hemisphere.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"

use super::{Sampler, SamplerParams, above, local, mean_weight, tilted};
use glam::DVec3;
use lightloom_tests::microfacet::BlinnPhong;
use lightloom_tests::{Cells, Lab};

const REFLECT: &str = r"
fn brdf() -> Brdf {
    return Brdf(params.normal, params.base_color, params.roughness, params.metallic, params.f0, false, true);
}
fn drawn(u: vec4f) -> Drawn {
    let it = brdf_sample(brdf(), params.wo, u.xyz);
    return Drawn(it.direction, it.pdf, it.weight, it.glossy);
}
fn density(w: vec3f) -> f32 { return brdf_pdf(brdf(), w, params.wo); }
";

#[test]
fn blinn_phong_draws_as_it_says_and_weighs_f_cos_over_pdf() {
    let Some(mut lab) = Lab::open() else { return };
    let sampler = Sampler::with_constants(&lab, REFLECT, &[("SCENE_PHONG", 1.0)]);
    let normal = tilted();
    let (mut largest, mut glossy) = (0.0_f64, 0);
    // From just above `MIN_ALPHA`, s = 1.8·10⁶, to s = 0.
    for roughness in [0.032_f32, 0.15, 0.4, 1.0] {
        for cos in [1.0, 0.6, 0.1] {
            for (metallic, base_color) in [(1.0_f32, [1.0, 0.8, 0.3]), (0.2, [0.9, 0.5, 0.2])] {
                let [normal_, wo] = [normal, above(normal, cos)].map(|w| w.as_vec3().to_array());
                let params =
                    SamplerParams { normal: normal_, wo, roughness, metallic, base_color, f0: 0.04, ..SamplerParams::default() };
                let what = format!("roughness {roughness}, cos {cos}, metallic {metallic}");
                let drawn = sampler.draw(&mut lab, &params);
                glossy += drawn.iter().filter(|draw| draw.glossy).count();
                let wo = above(normal, cos);
                let model = |channel: usize| BlinnPhong {
                    base_color: f64::from(base_color[channel]),
                    roughness: f64::from(roughness),
                    metallic: f64::from(metallic),
                    f0: f64::from(params.f0),
                };
                // The reflected lobe's narrow side is across the plane of incidence.
                let pole = (2.0 * normal.dot(wo) * normal - wo).normalize();
                let width = 0.5 * f64::from(roughness).powi(2) * cos;
                let cells = Cells::new(pole, width, super::RINGS, super::SECTORS);
                sampler.assert_follows(&mut lab, &params, &drawn, &cells, 0.0, &what);

                let f_cos = |channel: usize, wi: DVec3| {
                    let wi = local(normal, wi);
                    model(channel).f(wi, local(normal, wo)) * wi.z
                };
                for draw in drawn.iter().filter(|draw| draw.direction.dot(normal) > 1e-3) {
                    // A half vector in floats is off by 10⁻⁷: ln (h·n)ˢ by 2 s sin θ 10⁻⁷, below 10⁻³ where s < 5000.
                    if model(0).exponent() < 5e3 {
                        let expected = f_cos(0, draw.direction) / draw.pdf;
                        assert!((draw.weight.x / expected - 1.0).abs() < 2e-3, "{what}: weight {} for {expected}", draw.weight.x);
                    }
                }
                for channel in [0, 2] {
                    let fine = Cells { rings: 64, sectors: 96, ..cells };
                    let albedo = fine.integrate(4, |wi| f_cos(channel, wi));
                    largest = largest.max(albedo);
                    // Halving the midpoints' distance changes these integrals by less than 2·10⁻³ (the horizon).
                    mean_weight(&drawn, channel).assert_near(albedo, 2e-3 * albedo, &format!("{what}, albedo {channel}"));
                }
            }
        }
    }
    assert!(glossy > 0, "the lobe is drawn from");
    assert!(largest > 1.0, "the model keeps no balance, and says so: {largest}");
}
