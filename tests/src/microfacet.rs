//! Scattering in f64, as the papers write it: glTF 2.0 appendix B and [Walter07].
//!
//! [Walter07]: https://diglib.eg.org/handle/10.2312/EGWR.EGSR07.195-206 "Microfacet models for refraction through rough surfaces, Walter, Marschner, Li and Torrance, EGSR 2007"

use glam::DVec3;
use std::f64::consts::PI;

/// glTF's metallic-roughness reflection, one channel. Normals are +z here and below; directions point away.
#[derive(Clone, Copy, Debug)]
pub struct Reflection {
    /// Base colour.
    pub base_color: f64,
    /// Perceptual; α is its square.
    pub roughness: f64,
    /// 0 dielectric, 1 metal.
    pub metallic: f64,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: f64,
}

/// GGX [Walter07, Eq. 33] in tan θ.
pub fn ggx(alpha: f64, m: DVec3) -> f64 {
    let cos2 = m.z * m.z;
    let tan2 = (1.0 - cos2).max(0.0) / cos2;
    alpha * alpha / (PI * cos2 * cos2 * (alpha * alpha + tan2).powi(2))
}

/// Λ of Smith's masking [Heitz14, Eq. 72].
///
/// [Heitz14]: https://jcgt.org/published/0003/02/03/ "Understanding the masking-shadowing function in microfacet-based BRDFs, Heitz, JCGT 3(2), 2014"
pub fn smith_lambda(alpha: f64, w: DVec3) -> f64 {
    let tan2 = (1.0 - w.z * w.z).max(0.0) / (w.z * w.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Density of the normals visible from `wo` [Heitz18, Eq. 3].
///
/// [Heitz18]: https://jcgt.org/published/0007/04/01/ "Sampling the GGX distribution of visible normals, Heitz, JCGT 7(4), 2018"
pub fn visible_normals(alpha: f64, wo: DVec3, m: DVec3) -> f64 {
    if m.z <= 0.0 || wo.dot(m) <= 0.0 {
        return 0.0;
    }
    ggx(alpha, m) * wo.dot(m) / ((1.0 + smith_lambda(alpha, wo)) * wo.z)
}

fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

impl Reflection {
    /// α.
    pub fn alpha(&self) -> f64 {
        self.roughness.powi(2)
    }

    /// f (sr⁻¹), as glTF's appendix B mixes it: a metal, and a dielectric whose diffuse base lies below its reflection.
    pub fn f(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let h = (wi + wo).normalize();
        let g = 1.0 / (1.0 + smith_lambda(self.alpha(), wi) + smith_lambda(self.alpha(), wo));
        let facets = ggx(self.alpha(), h) * g / (4.0 * wi.z * wo.z);
        let cos = wo.dot(h);
        let metal = schlick(self.base_color, cos) * facets;
        // `fresnel_mix` in the spec's words.
        let fresnel = schlick(self.f0, cos);
        let dielectric = (1.0 - fresnel) * self.base_color / PI + fresnel * facets;
        (1.0 - self.metallic) * dielectric + self.metallic * metal
    }
}
