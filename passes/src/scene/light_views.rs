//! How punctual lights are rasterised: the views that show, together, all that their light meets first.
//!
//! A directional light has one parallel view, a spot up to [`WIDEST`] a perspective one, a wider spot and a point the six faces of a
//! cube. One perspective view of a wide cone would stop short of a half space and spend its texels on the edge.

use super::gpu_types::{Light, LightGroup, LightKind, LightView};
use glam::camera::rh::view::look_to_mat4;
use glam::{Mat4, Vec3, Vec4};

/// Views at most: the layers of an array texture that every WebGPU device has.
const MOST_VIEWS: usize = 256;
/// Tangent of half the angle of the widest spot that one view shows (63°): its middle has a fifth of the texels per solid angle of a
/// cube's there.
const WIDEST: f32 = 2.0;
/// Distance of a perspective view's near plane, in radii of the scene. Depth is near / distance, whose precision does not hang on it.
const NEAR: f32 = 1e-6;

/// Gives `groups` their views, in their order, as long as there is room; those without are traced.
pub(super) fn views(groups: &mut [LightGroup], lights: &[Light], center: Vec3, radius: f32) -> Vec<LightView> {
    let mut all = Vec::new();
    for group in groups {
        let of_light = of_light(&lights[group.first as usize], center, radius);
        if all.len() + of_light.len() <= MOST_VIEWS {
            group.first_view = all.len() as u32;
            group.view_count = of_light.len() as u32;
            all.extend(of_light.into_iter().map(|clip| LightView { clip_from_world: clip.to_cols_array_2d() }));
        }
    }
    all
}

fn of_light(light: &Light, center: Vec3, radius: f32) -> Vec<Mat4> {
    let (position, direction) = (Vec3::from(light.position), Vec3::from(light.direction));
    let perspective = |direction: Vec3, tan_half: f32| {
        let lens = Mat4::from_cols(
            Vec4::X / tan_half,
            Vec4::Y / tan_half,
            Vec4::NEG_W,
            Vec4::Z * (NEAR * radius.max(f32::MIN_POSITIVE)),
        );
        lens * look_to_mat4(position, direction, direction.any_orthonormal_vector())
    };
    let tan_outer = (1.0 - light.cos_outer * light.cos_outer).max(0.0).sqrt() / light.cos_outer.max(1e-6);
    match light.kind {
        kind if kind == LightKind::Directional as u32 => {
            // The whole bounding sphere between the planes, the nearest at depth 1.
            let deep = 0.5 / (1.001 * radius);
            let lens = Mat4::from_cols(Vec4::X / radius, Vec4::Y / radius, Vec4::Z * deep, Vec4::new(0.0, 0.0, 0.5, 1.0));
            vec![lens * look_to_mat4(center, direction, direction.any_orthonormal_vector())]
        }
        kind if kind == LightKind::Spot as u32 && tan_outer <= WIDEST => vec![perspective(direction, tan_outer)],
        kind if kind == LightKind::Point as u32 || kind == LightKind::Spot as u32 => {
            [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]).map(|axis| perspective(axis, 1.0)).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(light: Light) -> Vec<Mat4> {
        of_light(&light, Vec3::new(1.0, 2.0, 3.0), 4.0)
    }

    /// How many views show the point.
    fn showing(views: &[Mat4], point: Vec3) -> usize {
        let seen = |view: &&Mat4| {
            let clip = **view * point.extend(1.0);
            clip.w > 0.0 && clip.x.abs().max(clip.y.abs()) <= clip.w && (0.0..=clip.w).contains(&clip.z)
        };
        views.iter().filter(seen).count()
    }

    #[test]
    fn every_direction_of_a_light_is_seen_once() {
        let position = Vec3::new(0.5, 1.0, -1.0);
        let direction = Vec3::new(0.36, 0.48, 0.8);
        let spot = Light { kind: LightKind::Spot as u32, direction: direction.to_array(), ..Light::default() };
        let narrow = of(Light { position: position.to_array(), cos_outer: 0.5, ..spot });
        let wide = of(Light { position: position.to_array(), cos_outer: -0.5, ..spot });
        let point = of(Light { position: position.to_array(), kind: LightKind::Point as u32, ..Light::default() });
        assert_eq!((narrow.len(), wide.len(), point.len()), (1, 6, 6));
        for i in 0..500_u32 {
            // No direction of this spiral lies between two faces.
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let ray = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            let at = position + 0.7 * ray;
            assert_eq!((showing(&point, at), showing(&wide, at)), (1, 1), "{ray}");
            assert!(ray.dot(direction) < 0.5 || showing(&narrow, at) == 1, "{ray} is in the cone");
        }
    }

    #[test]
    fn a_parallel_view_shows_the_bounding_sphere() {
        let direction = Vec3::new(0.0, -0.6, -0.8);
        let sun = of(Light { kind: LightKind::Directional as u32, direction: direction.to_array(), ..Light::default() });
        let center = Vec3::new(1.0, 2.0, 3.0);
        for offset in [Vec3::ZERO, direction, -direction, Vec3::X, Vec3::NEG_X] {
            assert_eq!(showing(&sun, center + 3.999 * offset), 1, "{offset}");
        }
        let depth = |offset: Vec3| (sun[0] * (center + offset).extend(1.0)).z;
        assert!(depth(-direction) > depth(direction), "the nearer has the greater depth");
    }

    #[test]
    fn lights_past_the_last_layer_have_no_view() {
        let lights = [Light { kind: LightKind::Point as u32, ..Light::default() }];
        let mut groups = vec![LightGroup { count: 1, ..LightGroup::default() }; 50];
        assert_eq!(views(&mut groups, &lights, Vec3::ZERO, 1.0).len(), 252);
        assert_eq!((groups[41].first_view, groups[41].view_count, groups[42].view_count), (246, 6, 0));
    }
}
