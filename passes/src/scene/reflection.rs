//! How glossy surfaces reflect.

/// The model by which a scene's glossy surfaces reflect: all that are neither Lambertian nor transmit nor mirror. These keep the meaning that
/// glTF gives them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reflection {
    /// glTF 2.0 appendix B: GGX, masked, above a diffuse base that gives way to it. The default.
    #[default]
    Gltf,
    /// [MML13] Eq. 6–8, a normalised Blinn-Phong lobe beside a diffuse one:
    ///
    /// ```text
    /// F = F₀ + (1 − F₀)(1 − max(0, ω_h·ω_i))⁵,    f = ρ_L/π + (8 + s) F/(8π) max(0, ω_h·n)ˢ
    /// ```
    ///
    /// with `ρ_L` = base colour · (1 − metallic), F₀ as in glTF and s = 2/α² − 2, α = roughness² ≥ 10⁻³: from 0 for roughness 1 to 2·10⁶.
    ///
    /// It keeps no balance. The lobe is normalised for light that arrives head-on, and the diffuse part is not lessened by what the lobe
    /// reflects: the albedo may exceed 1, up to `ρ_L` plus what the lobe reflects.
    /// Estimates stay unbiased: a photon that gains flux is never ended by roulette and goes on with more than it had, which the ledger
    /// counts as negative absorption. Between white surfaces alone light would grow from bounce to bounce until the bounces end; such scenes
    /// have no solution in nature either.
    ///
    /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
    BlinnPhong,
}
