//! The peer: a kd-tree over the photons, and [MML13] Eq. 1 at each pixel on all cores.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::process_cpu_ms;
use glam::{DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use lightloom_passes::{Photon, decode_flux, decode_octahedral};
use std::error::Error;
use std::f32::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// Points that a thread takes at once.
const RUN: usize = 512;

/// A visible point of a Lambertian surface.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    position: Vec3,
    normal_geometric: Vec3,
    normal: Vec3,
    base_color: Vec3,
    to_eye: Vec3,
    gathers: bool,
}

impl Point {
    /// From the texels of a G-buffer.
    pub(crate) fn new(position: [f32; 4], surface: [u32; 4], eye: Vec3) -> Self {
        let unit = |bits| decode_octahedral(bits);
        let at = Vec3::new(position[0], position[1], position[2]);
        let root = |bits: u32, most: u32| (bits & most) as f32 / most as f32;
        let base = Vec3::new(root(surface[2], 2047), root(surface[2] >> 11, 2047), root(surface[2] >> 22, 1023));
        Self {
            position: at,
            normal_geometric: unit(surface[1]),
            normal: unit(surface[0]),
            base_color: base * base,
            to_eye: (eye - at).normalize_or_zero(),
            gathers: surface[3] & 0x3_0000 == 0x1_0000,
        }
    }
}

/// A photon with everything decoded: the peer need not do it at every pixel.
struct Decoded {
    incident: Vec3,
    normal: Vec3,
    flux: Vec3,
}

/// What the peer took, and found.
pub(crate) struct Gathered {
    pub(crate) build_ms: f64,
    pub(crate) gather_ms: f64,
    /// Of all threads.
    pub(crate) cpu_ms: f64,
    /// Radiance (W·m⁻²·sr⁻¹) of each point.
    pub(crate) radiance: Vec<Vec3>,
    /// Photons in reach, over all points.
    pub(crate) found: usize,
}

impl Gathered {
    /// Build and gathering.
    pub(crate) fn ms(&self) -> f64 {
        self.build_ms + self.gather_ms
    }
}

/// Gathers the photons within `radius` (m) of each point.
pub(crate) fn gather(photons: &[Photon], points: &[Point], radius: f32) -> Result<Gathered, Box<dyn Error>> {
    let decode = |photon: &Photon| Decoded {
        incident: -decode_octahedral(photon.direction),
        normal: decode_octahedral(photon.normal),
        flux: decode_flux(photon.flux),
    };
    let decoded: Vec<_> = photons.iter().map(decode).collect();
    let positions: Vec<[f32; 3]> = photons.iter().map(|photon| photon.position).collect();

    let cpu = process_cpu_ms();
    let start = Instant::now();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&positions).map_err(|error| format!("{error:?}"))?;
    let build_ms = start.elapsed().as_secs_f64() * 1e3;

    let start = Instant::now();
    let next = AtomicUsize::new(0);
    let cores = thread::available_parallelism()?.get();
    let work = || {
        let (mut runs, mut found) = (Vec::new(), 0);
        loop {
            let first = next.fetch_add(RUN, Ordering::Relaxed);
            let Some(run) = points.get(first..points.len().min(first + RUN)).filter(|run| !run.is_empty()) else {
                return (runs, found);
            };
            let sum = |point: &Point| {
                let (sum, count) = sum_at(&tree, &decoded, point, radius);
                found += count;
                sum
            };
            runs.push((first, run.iter().map(sum).collect::<Vec<_>>()));
        }
    };
    let mut radiance = vec![Vec3::ZERO; points.len()];
    let mut found = 0;
    thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        for thread in threads {
            let (runs, count) = thread.join().expect("the sum does not panic");
            found += count;
            for (first, run) in runs {
                radiance[first..first + run.len()].copy_from_slice(&run);
            }
        }
    });
    let gather_ms = start.elapsed().as_secs_f64() * 1e3;
    Ok(Gathered { build_ms, gather_ms, cpu_ms: process_cpu_ms() - cpu, radiance, found })
}

fn sum_at(tree: &ImmutableKdTree<f32, 3>, decoded: &[Decoded], point: &Point, radius: f32) -> (Vec3, usize) {
    if !point.gathers {
        return (Vec3::ZERO, 0);
    }
    const CUT: f32 = 0.2;
    let integral = PI * radius * radius * CUT * (CUT * CUT / 3.0 - CUT + 1.0);
    let near = tree.query(&point.position.to_array()).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().execute();
    let mut sum = Vec3::ZERO;
    for item in &near {
        let photon = &decoded[item.item as usize];
        let cosine = photon.incident.dot(point.normal_geometric);
        if cosine <= 0.0 || photon.normal.dot(point.normal_geometric) < 0.5 {
            continue;
        }
        let shading = photon.incident.dot(point.normal);
        if shading <= 0.0 || point.normal.dot(point.to_eye) <= 0.0 {
            continue;
        }
        let correction = (shading / (cosine + 1e-4)).min(4.0);
        sum += photon.flux * (correction * CUT.min(1.0 - item.distance.sqrt() / radius) / integral);
    }
    (sum * point.base_color / PI, near.len())
}

/// Ratio of the sums of two images, and the root mean square of their difference over the root mean square of the second.
pub(crate) fn compare(found: &[[f32; 4]], expected: &[Vec3]) -> [f64; 2] {
    let (mut sums, mut squares) = ([DVec3::ZERO; 2], [0.0; 2]);
    for (found, expected) in found.iter().zip(expected) {
        let (found, expected) = (Vec3::new(found[0], found[1], found[2]).as_dvec3(), expected.as_dvec3());
        sums[0] += found;
        sums[1] += expected;
        squares[0] += (found - expected).length_squared();
        squares[1] += expected.length_squared();
    }
    [sums[0].element_sum() / sums[1].element_sum(), (squares[0] / squares[1]).sqrt()]
}
