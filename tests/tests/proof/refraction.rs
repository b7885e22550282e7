//! Flat refractors and a ball lens, smooth, against closed forms: how much light passes, and where it goes. PHYSICS checks 8 and 9.

use crate::beams::horizontal;
use glam::{DVec3, Vec3};
use lightloom_passes::scene::{Emission, Light, Material, Scene, Triangle, builtin};
use lightloom_passes::{Photon, PhotonFlags, PhotonSettings, decode_flux, decode_octahedral};
use lightloom_tests::microfacet::fresnel;
use lightloom_tests::{Lab, Mean};
use std::f64::consts::TAU;

/// Scatterings in a pane: R²⁴ of the light is left out.
const BOUNCES: u32 = 24;
const EMITTED: u32 = 100_000;
/// Of the lamp above the black floor (m).
const HEIGHT: f32 = 2.0;

/// A lamp that shines through `faces`, planes at those heights (m) that look up or down, on a black floor.
#[derive(Clone, Debug)]
struct Refractor {
    faces: Vec<(f32, bool)>,
    ior: f64,
    /// `σ_a` (1/m).
    absorption: f64,
    /// Between the lamp's axis and the normal (rad).
    tilt: f64,
}

/// The narrowest cone there is.
const COS_OUTER: f64 = 0.999;

impl Refractor {
    fn scene(&self) -> Scene {
        let glass = Material {
            attenuation_color: [(-self.absorption).exp() as f32; 3],
            attenuation_distance_m: 1.0,
            ..Material::glass("glass", self.ior as f32, 1.0)
        };
        let mut triangles = horizontal(0.0, 30.0, true, 0).to_vec();
        triangles.extend(self.faces.iter().flat_map(|&(y, up)| horizontal(y, 30.0, up, 1)));
        Scene {
            triangles,
            materials: vec![Material::lambert("floor", Vec3::ZERO), glass],
            lights: vec![Light::Spot {
                position_world: Vec3::new(0.0, HEIGHT, 0.0),
                direction_world: self.axis().as_vec3(),
                intensity: Vec3::ONE,
                cos_inner: 1.0,
                cos_outer: COS_OUTER as f32,
            }],
            ..Scene::default()
        }
    }

    fn axis(&self) -> DVec3 {
        DVec3::new(self.tilt.sin(), -self.tilt.cos(), 0.0)
    }

    fn records(&self, lab: &mut Lab) -> Vec<Photon> {
        let scene = lab.upload(&self.scene());
        let settings = PhotonSettings { capacity: EMITTED, ..PhotonSettings::new(EMITTED, BOUNCES, 7) };
        let records = lab.photons(&scene, &settings).records;
        records.into_iter().filter(|photon| photon.position[1].abs() < 1e-4).collect()
    }

    /// Integral (W) of the lamp's intensity times `transmittance` of the cosine with the normal.
    fn flux(&self, transmittance: impl Fn(f64) -> f64) -> f64 {
        let (steps, turns) = (200, 64);
        let across = self.axis().any_orthonormal_vector();
        let along = self.axis().cross(across);
        let mut sum = 0.0;
        for step in 0..steps {
            let cos = 1.0 - (1.0 - COS_OUTER) * (f64::from(step) + 0.5) / f64::from(steps);
            let falloff = ((cos - COS_OUTER) / (1.0 - COS_OUTER)).powi(2);
            for turn in 0..turns {
                let (y, x) = (TAU * f64::from(turn) / f64::from(turns)).sin_cos();
                let direction = self.axis() * cos + (across * x + along * y) * (1.0 - cos * cos).sqrt();
                sum += falloff * transmittance(-direction.y);
            }
        }
        sum * TAU * (1.0 - COS_OUTER) / f64::from(steps * turns)
    }
}

/// Flux (W) of the records; its standard error from their scatter, one or none of each photon emitted.
fn stored(records: &[Photon]) -> Mean {
    let flux = |photon: &Photon| f64::from(decode_flux(photon.flux).y);
    let (sum, squares) = records.iter().map(flux).fold((0.0, 0.0), |(sum, squares), flux| (sum + flux, squares + flux * flux));
    Mean { value: sum, standard_error: (squares - sum * sum / f64::from(EMITTED)).sqrt() }
}

fn inside(cos: f64, ior: f64) -> f64 {
    (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt()
}

#[test]
fn an_interface_passes_what_fresnel_leaves() {
    let Some(mut lab) = Lab::open() else { return };
    for (ior, tilt) in [(1.5, 0.0), (2.4, 0.0), (1.5, 1.1), (1.33, 1.4)] {
        let refractor = Refractor { faces: vec![(1.0, true)], ior, absorption: 0.0, tilt };
        let expected = refractor.flux(|cos| 1.0 - fresnel(cos, ior));
        stored(&refractor.records(&mut lab)).assert_near(expected, 0.0, &format!("n = {ior}, {tilt} rad"));
    }
}

/// T = (1 − R)² τ (1 + R²τ² + …), τ = exp(−σ d / cos θ'). Light inside meets both faces under one angle, and R is the same from either
/// side; it is the mean of both polarisations at each, as light is not followed by polarisation.
#[test]
fn a_slab_passes_the_series_of_its_reflections() {
    const THICKNESS: f64 = 0.25;
    let Some(mut lab) = Lab::open() else { return };
    for (ior, tilt, absorption) in [(2.4, 0.0, 0.0), (2.4, 0.9, 0.0), (1.5, 1.2, 0.0), (2.4, 0.6, 1.5)] {
        let refractor = Refractor { faces: vec![(1.0, true), (0.75, false)], ior, absorption, tilt };
        let expected = refractor.flux(|cos| {
            let r = fresnel(cos, ior);
            let tau = (-absorption * THICKNESS / inside(cos, ior)).exp();
            (1.0 - r).powi(2) * tau / (1.0 - (r * tau).powi(2))
        });
        let what = format!("n = {ior}, {tilt} rad, σ = {absorption}");
        stored(&refractor.records(&mut lab)).assert_near(expected, 0.0, &what);
    }
}

/// d sin(θ − θ') / cos θ' between the lines before and behind a slab.
#[test]
fn a_slab_moves_light_aside_as_snell_says() {
    const THICKNESS: f64 = 0.75;
    const IOR: f64 = 1.5;
    let Some(mut lab) = Lab::open() else { return };
    for tilt in [0.3_f64, 0.8, 1.2] {
        let faces = vec![(1.25, true), (0.5, false)];
        let records = Refractor { faces, ior: IOR, absorption: 0.0, tilt }.records(&mut lab);
        let straight: Vec<_> = records.iter().filter(|photon| photon.bounces() == 2).collect();
        assert!(straight.len() > 1000, "{} photons passed without a reflection", straight.len());
        for photon in straight {
            let direction = decode_octahedral(photon.direction).as_dvec3();
            let from_lamp = Vec3::from(photon.position).as_dvec3() - DVec3::Y * f64::from(HEIGHT);
            let offset = from_lamp.cross(direction).length();
            let theta = (-direction.y).acos();
            let expected = THICKNESS * (theta - inside(theta.cos(), IOR).acos()).sin() / inside(theta.cos(), IOR);
            // A direction's code is off by 4·10⁻⁵ rad, over the way from the lamp.
            let bound = 6e-5 * from_lamp.length();
            assert!((offset - expected).abs() < bound, "{theta} rad: {offset} m aside, {expected} m by Snell");
        }
    }
}

/// A ray that enters at height b leaves it turned by 2(asin(b/R) − asin(b/nR)), at the same height above the centre: it crosses the axis
/// b / sin of that beyond the centre, for b → 0 at EFL = nD/(4(n − 1)).
#[test]
fn a_ball_lens_focuses_at_its_focal_length() {
    const RADIUS: f64 = 0.5;
    let Some(mut lab) = Lab::open() else { return };
    for ior in [1.33, 1.5, 1.8] {
        let ball = builtin::closed_sphere(5).triangles.into_iter().map(|triangle| {
            // The fronts of the sphere look inwards.
            let [a, b, c] = triangle.positions_world.map(|p| p.normalize() * RADIUS as f32);
            Triangle { positions_world: [a, c, b], normals_world: [a, c, b].map(Vec3::normalize), material: 1, ..triangle }
        });
        let scene = Scene {
            triangles: ball.chain(horizontal(-1.5, 1.0, true, 0)).collect(),
            materials: vec![Material::lambert("screen", Vec3::ZERO), Material::glass("ball", ior as f32, 1.0)],
            lights: vec![Light::Directional { direction_world: Vec3::NEG_Y, irradiance: Vec3::ONE }],
            ..Scene::default()
        };
        let settings = PhotonSettings::new(200_000, 2, 3);
        let records = lab.photons_by(Emission::Guided, &lab.upload(&scene), &settings).records;
        let focal_length = ior * 2.0 * RADIUS / (4.0 * (ior - 1.0));
        let (mut ratios, mut paraxial) = (Vec::new(), Vec::new());
        for photon in records.iter().filter(|p| p.bounces() == 2 && p.bounce_flags & PhotonFlags::CAUSTIC != 0) {
            let direction = decode_octahedral(photon.direction).as_dvec3();
            let height = Vec3::from(photon.position).as_dvec3().cross(direction).length();
            // Nearer to the axis the code of the direction is too coarse to tell the angle.
            if (0.05..0.5).contains(&(height / RADIUS)) && photon.position[1] < -1.4 {
                let crossing = height / direction.cross(DVec3::NEG_Y).length();
                let turned = 2.0 * ((height / RADIUS).asin() - (height / (ior * RADIUS)).asin());
                ratios.push(crossing / (height / turned.sin()));
                if height < 0.1 * RADIUS {
                    paraxial.push(crossing);
                }
            }
        }
        assert!(paraxial.len() > 500 && ratios.len() > 10_000, "{} and {} photons", paraxial.len(), ratios.len());
        // Facets of 0.035 rad lie up to 1.5·10⁻⁴ of the radius below the sphere, at entry and at exit.
        Mean::of(&ratios).assert_near(1.0, 5e-4, &format!("n = {ior}: crossing"));
        // Spherical aberration at a tenth of the radius is below 0.4 % for these indices.
        Mean::of(&paraxial).assert_near(focal_length, 4e-3 * focal_length, &format!("n = {ior}: focal length"));
    }
}
