//! Scattering in f64, as the papers write it: glTF 2.0 appendix B, [MML13] and [Walter07].
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
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

/// GGX, [Walter07] Eq. 33, in tan θ.
///
/// [Walter07]: https://diglib.eg.org/handle/10.2312/EGWR.EGSR07.195-206 "Microfacet models for refraction through rough surfaces, Walter, Marschner, Li and Torrance, EGSR 2007"
pub fn ggx(alpha: f64, m: DVec3) -> f64 {
    let cos2 = m.z * m.z;
    let tan2 = (1.0 - cos2).max(0.0) / cos2;
    alpha * alpha / (PI * cos2 * cos2 * (alpha * alpha + tan2).powi(2))
}

/// Λ of Smith's masking [Heitz14] Eq. 72.
///
/// [Heitz14]: https://jcgt.org/published/0003/02/03/ "Understanding the masking-shadowing function in microfacet-based BRDFs, Heitz, JCGT 3(2), 2014"
pub fn smith_lambda(alpha: f64, w: DVec3) -> f64 {
    let tan2 = (1.0 - w.z * w.z).max(0.0) / (w.z * w.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Density of the normals visible from `wo` [Heitz18] Eq. 3.
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

/// The glossy model of [MML13] Eq. 6–8, one channel, with the exponent of the GGX lobe of that roughness.
///
/// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
#[derive(Clone, Copy, Debug)]
pub struct BlinnPhong {
    /// Base colour.
    pub base_color: f64,
    /// Perceptual; α is its square.
    pub roughness: f64,
    /// 0 dielectric, 1 metal.
    pub metallic: f64,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: f64,
}

impl BlinnPhong {
    /// s.
    pub fn exponent(&self) -> f64 {
        2.0 / self.roughness.powi(4) - 2.0
    }

    /// f (sr⁻¹).
    pub fn f(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let h = (wi + wo).normalize();
        let f0 = self.metallic * self.base_color + (1.0 - self.metallic) * self.f0;
        let s = self.exponent();
        let diffuse = self.base_color * (1.0 - self.metallic) / PI;
        diffuse + (8.0 + s) * schlick(f0, h.dot(wi).max(0.0)) / (8.0 * PI) * h.z.powf(s)
    }
}

/// A rough interface between two media, as [Walter07] writes it. Radiance that comes from `ω_i` leaves to `ω_o`.
///
/// [Walter07]: https://diglib.eg.org/handle/10.2312/EGWR.EGSR07.195-206 "Microfacet models for refraction through rough surfaces, Walter, Marschner, Li and Torrance, EGSR 2007"
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// α of GGX.
    pub alpha: f64,
    /// Index of refraction above, where z > 0.
    pub above: f64,
    /// Index of refraction below.
    pub below: f64,
    /// Two faces at once: nothing is bent, `below` is the index inside.
    pub thin: bool,
}

/// Fresnel reflectance, [Walter07] Eq. 22, under the cosine `c` towards a medium of relative index `n`.
///
/// [Walter07]: https://diglib.eg.org/handle/10.2312/EGWR.EGSR07.195-206 "Microfacet models for refraction through rough surfaces, Walter, Marschner, Li and Torrance, EGSR 2007"
pub fn fresnel(c: f64, n: f64) -> f64 {
    let g2 = n * n - 1.0 + c * c;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    0.5 * ((g - c) / (g + c)).powi(2) * (1.0 + ((c * (g + c) - 1.0) / (c * (g - c) + 1.0)).powi(2))
}

impl Interface {
    /// Reflectance of a facet, in light from above if `from_above`.
    pub fn reflectance(&self, cos: f64, from_above: bool) -> f64 {
        let ratio = self.below / self.above;
        let single = fresnel(cos, if from_above || self.thin { ratio } else { 1.0 / ratio });
        // R + T R T + T R³ T + …
        if self.thin { single + (1.0 - single).powi(2) * single / (1.0 - single * single) } else { single }
    }

    /// f (sr⁻¹); both directions may lie on either side.
    pub fn f(&self, wi: DVec3, wo: DVec3) -> f64 {
        let index = |w: DVec3| if w.z > 0.0 { self.above } else { self.below };
        let transmits = wi.z * wo.z < 0.0;
        let upwards = |m: DVec3| if m.z < 0.0 { -m } else { m };
        let cosines = (wi.z * wo.z).abs();
        let lambda = |w: DVec3| smith_lambda(self.alpha, w);
        if !transmits || self.thin {
            let mirrored = if transmits { DVec3::new(wi.x, wi.y, -wi.z) } else { wi };
            let m = upwards((mirrored + wo).normalize());
            let g = 1.0 / (1.0 + lambda(wi) + lambda(wo));
            let reflectance = self.reflectance(wo.dot(m).abs(), wo.z > 0.0);
            let share = if transmits { 1.0 - reflectance } else { reflectance };
            return share * g * ggx(self.alpha, m) / (4.0 * cosines);
        }
        let [n_i, n_o] = [index(wi), index(wo)];
        let m = upwards(-(n_i * wi + n_o * wo).normalize());
        let [dot_i, dot_o] = [wi.dot(m), wo.dot(m)];
        // χ⁺ of Eq. 34: facets that show each direction their right side.
        if dot_i * wi.z <= 0.0 || dot_o * wo.z <= 0.0 {
            return 0.0;
        }
        let g = 1.0 / ((1.0 + lambda(wi)) * (1.0 + lambda(wo)));
        let passed = 1.0 - self.reflectance(dot_i.abs(), wi.z > 0.0);
        (dot_i * dot_o).abs() / cosines * n_o * n_o * passed * g * ggx(self.alpha, m) / (n_i * dot_i + n_o * dot_o).powi(2)
    }
}
