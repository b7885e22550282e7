//! Spheres around what refracts or mirrors, for photons that are aimed at it.
//!
//! Triangles of specular materials that share corners are one object. More objects than [`MAX_GUIDES`] are put together by
//! halving the largest group, so that a light with many of them in sight still tests few.

use super::{Material, Scene};
use glam::Vec3;
use std::collections::HashMap;

/// Spheres at most: a photon's weight looks at all of its light's.
const MAX_GUIDES: usize = 8;

/// A sphere in world space (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sphere {
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

/// Spheres that together hold every specular triangle.
pub(super) fn guides(scene: &Scene) -> Vec<Sphere> {
    let specular: Vec<bool> = scene.materials.iter().map(Material::may_be_specular).collect();
    let triangles = scene.triangles.iter().filter(|t| specular.get(t.material as usize).is_some_and(|&s| s));
    let mut corners: Vec<Vec3> = Vec::new();
    let mut index_of: HashMap<[u32; 3], usize> = HashMap::new();
    let mut joined = Joined::default();
    for triangle in triangles {
        let indices = triangle.positions_world.map(|p| {
            // `+ 0.0` makes one of both zeros.
            *index_of.entry((p + 0.0).to_array().map(f32::to_bits)).or_insert_with(|| {
                corners.push(p);
                joined.add()
            })
        });
        joined.join(indices[0], indices[1]);
        joined.join(indices[0], indices[2]);
    }
    let mut objects: HashMap<usize, usize> = HashMap::new();
    let mut points: Vec<Vec<Vec3>> = Vec::new();
    for (index, &corner) in corners.iter().enumerate() {
        let object = *objects.entry(joined.root(index)).or_insert_with(|| {
            points.push(Vec::new());
            points.len() - 1
        });
        points[object].push(corner);
    }
    let spheres = points.iter().map(|points| around(points.iter().map(|&p| Sphere { center: p, radius: 0.0 })));
    // A pose may shrink an object to nothing; nothing can be aimed at that.
    grouped(spheres.filter(|sphere| sphere.radius > 0.0).collect())
}

/// A sphere around spheres: about the middle of the box of their centres.
fn around(spheres: impl Iterator<Item = Sphere> + Clone) -> Sphere {
    let (least, most) = extent(spheres.clone());
    let center = 0.5 * (least + most);
    let radius = spheres.map(|s| s.center.distance(center) + s.radius).fold(0.0, f32::max);
    // A hair larger, against rounding.
    Sphere { center, radius: radius * 1.000_1 }
}

fn extent(spheres: impl Iterator<Item = Sphere>) -> (Vec3, Vec3) {
    let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    spheres.fold(empty, |(least, most), s| (least.min(s.center), most.max(s.center)))
}

/// At most [`MAX_GUIDES`] spheres around all of `spheres`.
fn grouped(spheres: Vec<Sphere>) -> Vec<Sphere> {
    if spheres.is_empty() {
        return spheres;
    }
    let mut groups = vec![(around(spheres.iter().copied()), spheres)];
    while groups.len() < MAX_GUIDES {
        let largest = groups
            .iter()
            .enumerate()
            .filter(|(_, (_, members))| members.len() > 1)
            .max_by(|(_, (a, _)), (_, (b, _))| a.radius.total_cmp(&b.radius));
        let Some((index, _)) = largest else { break };
        let (_, mut members) = groups.swap_remove(index);
        let (least, most) = extent(members.iter().copied());
        let axis = (most - least).max_position();
        members.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let upper = members.split_off(members.len() / 2);
        for half in [members, upper] {
            groups.push((around(half.iter().copied()), half));
        }
    }
    groups.into_iter().map(|(sphere, members)| if let [one] = members[..] { one } else { sphere }).collect()
}

/// Disjoint sets.
#[derive(Default)]
struct Joined(Vec<usize>);

impl Joined {
    fn add(&mut self) -> usize {
        self.0.push(self.0.len());
        self.0.len() - 1
    }

    fn root(&mut self, mut index: usize) -> usize {
        while self.0[index] != index {
            self.0[index] = self.0[self.0[index]];
            index = self.0[index];
        }
        index
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a] = b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn objects_are_found_and_held() {
        let scene = builtin::caustics();
        let spheres = guides(&scene);
        // The glass sphere, the two walls of the ring and its rim, whose corners are those of the walls.
        assert!(spheres.len() >= 2 && spheres.len() <= 4, "{spheres:?}");
        let glass = spheres.iter().find(|s| s.center.abs_diff_eq(Vec3::new(0.44, 0.42, -0.3), 0.01)).expect("the glass sphere");
        assert!((glass.radius - 0.36).abs() < 0.01, "{glass:?}");
        for triangle in scene.triangles.iter().filter(|t| scene.materials[t.material as usize].may_be_specular()) {
            let held = spheres.iter().any(|s| triangle.positions_world.iter().all(|p| p.distance(s.center) <= s.radius));
            assert!(held, "{triangle:?}");
        }
        assert!(guides(&builtin::cornell()).is_empty(), "nothing is specular");
    }

    #[test]
    fn many_objects_become_few() {
        let grid = (0..100_u8).map(|i| Sphere { center: Vec3::new(f32::from(i % 10), f32::from(i / 10), 0.0), radius: 0.1 });
        let all: Vec<Sphere> = grid.collect();
        let few = grouped(all.clone());
        assert_eq!(few.len(), MAX_GUIDES);
        for sphere in all {
            assert!(few.iter().any(|f| f.center.distance(sphere.center) + sphere.radius <= f.radius), "{sphere:?} is held");
        }
    }
}
