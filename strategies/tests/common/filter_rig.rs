//! The filters on surfaces and light made by hand.

use super::{Bench, Random, SPECULAR, View, camera};
use glam::Vec3;
use lightloom_graph::Graph;
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_passes::{CameraUniform, Filter, FilterInputs, FilterSettings, Irradiance, shaders};
use lightloom_strategies::Settings;

pub(crate) const SIZE: [u32; 2] = [48, 32];
/// What a surface is hit by.
pub(crate) type Hit = fn(Vec3, Vec3) -> (f32, Vec3);

/// The plane z = 0, facing the camera.
pub(crate) fn wall(eye: Vec3, direction: Vec3) -> (f32, Vec3) {
    (-eye.z / direction.z, Vec3::Z)
}

/// Two walls that meet in the line x = 0 at a right angle, open towards +z.
pub(crate) fn corner(eye: Vec3, direction: Vec3) -> (f32, Vec3) {
    let [left, right] = [1.0, -1.0].map(|x| {
        let n = Vec3::new(x, 0.0, 1.0).normalize();
        let t = -eye.dot(n) / direction.dot(n);
        (if t > 0.0 { t } else { f32::INFINITY }, n)
    });
    if left.0 < right.0 { left } else { right }
}

/// Where x < 0 the plane z = 0; a plane 5 m behind it elsewhere.
pub(crate) fn step(eye: Vec3, direction: Vec3) -> (f32, Vec3) {
    let front = -eye.z / direction.z;
    let x = eye.x + front * direction.x;
    (if x < 0.0 { front } else { -(eye.z + 5.0) / direction.z }, Vec3::Z)
}

/// A view without specular pixels.
pub(crate) fn view(hit: Hit, eye: Vec3, target: Vec3, jitter: [f32; 2]) -> View {
    let mut view = View::new(camera(eye, target, SIZE, jitter), |eye, direction| Some(hit(eye, direction)));
    view.surface.iter_mut().for_each(|surface| surface[3] &= !SPECULAR);
    view
}

pub(crate) fn still(hit: Hit) -> View {
    view(hit, Vec3::new(0.3, 0.2, 5.0), Vec3::new(0.3, 0.0, 0.0), [0.5; 2])
}

pub(crate) fn jittered(hit: Hit, frame: u32) -> View {
    view(hit, Vec3::new(0.3, 0.2, 5.0), Vec3::new(0.3, 0.0, 0.0), Settings::default().jitter(frame))
}

pub(crate) fn only(history: f32) -> FilterSettings {
    FilterSettings { history, iterations: 0, ..FilterSettings::default() }
}

/// As what an image is filtered.
#[derive(Clone, Copy)]
enum Kind {
    Image,
    Radiance,
    Irradiance,
}

/// The filter and what it remembers.
pub(crate) struct Rig {
    pub(crate) bench: Bench,
    filter: Filter,
    /// Any: without visibility none of its triangles is seen.
    scene: GpuScene,
    pub(crate) previous: Option<CameraUniform>,
}

impl Rig {
    pub(crate) fn new() -> Option<Self> {
        let bench = Bench::new()?;
        let filter = Filter::new(&shaders()).expect("the shaders are valid");
        let (device, queue) = (bench.executor.device(), bench.executor.queue());
        let scene = GpuScene::upload(device, queue, &builtin::cornell()).expect("it fits");
        Some(Self { bench, filter, scene, previous: None })
    }

    /// One more frame, in which `light` is filtered as radiance or as any image.
    pub(crate) fn frame(&mut self, view: &View, settings: FilterSettings, light: &[Vec3], radiance: bool) -> Vec<Vec3> {
        let kind = if radiance { Kind::Radiance } else { Kind::Image };
        self.frame_of(view, settings, kind, &[light], None).remove(0)
    }

    /// One more frame, in which irradiance and direction are filtered.
    pub(crate) fn irradiance(&mut self, view: &View, settings: FilterSettings, light: [&[Vec3]; 2]) -> Vec<Vec<Vec3>> {
        self.frame_of(view, settings, Kind::Irradiance, &light, None)
    }

    /// One more frame of an image, with an engine's motion vectors.
    pub(crate) fn moved(&mut self, view: &View, settings: FilterSettings, light: &[Vec3], motion: &[[f32; 4]]) -> Vec<Vec3> {
        self.frame_of(view, settings, Kind::Image, &[light], Some(motion)).remove(0)
    }

    fn frame_of(
        &mut self,
        view: &View,
        settings: FilterSettings,
        kind: Kind,
        light: &[&[Vec3]],
        motion: Option<&[[f32; 4]]>,
    ) -> Vec<Vec<Vec3>> {
        let mut graph = Graph::new("filter");
        let mut gbuffer = self.bench.gbuffer(&mut graph, view);
        gbuffer.motion = motion.map(|motion| self.bench.image(&mut graph, "motion", SIZE, super::POSITION, motion));
        let mut images: Vec<_> = light
            .iter()
            .map(|light| {
                let texels: Vec<[f32; 4]> = light.iter().map(|l| l.extend(1.0).to_array()).collect();
                self.bench.image(&mut graph, "light", SIZE, super::POSITION, &texels)
            })
            .collect();
        let (scene, info) = (self.scene.declare(&mut graph), self.scene.info());
        let previous = self.previous.take();
        let inputs = FilterInputs {
            scene: &scene,
            info: &info,
            camera: &view.camera,
            previous: previous.as_ref(),
            gbuffer: &gbuffer,
            visibility: None,
        };
        let frame = self.filter.begin(&mut graph, settings, &inputs);
        let filtered = match kind {
            Kind::Image => vec![self.filter.image(&mut graph, &frame, "light", &images[0])],
            Kind::Radiance => vec![self.filter.radiance(&mut graph, &frame, "light", &images[0])],
            Kind::Irradiance => {
                let direction = images.pop().expect("irradiance has a direction");
                let irradiance = images.pop().expect("and an amount");
                let light = self.filter.irradiance(&mut graph, &frame, "light", &Irradiance { irradiance, direction });
                vec![light.irradiance, light.direction]
            }
        };
        let reads: Vec<_> = filtered.iter().map(|image| graph.readback_texture(image)).collect();
        let output = self.bench.executor.execute(graph).expect("the frame runs");
        self.previous = Some(view.camera);
        let rgb = |texel: [f32; 4]| Vec3::new(texel[0], texel[1], texel[2]);
        reads.into_iter().map(|read| output.cast::<[f32; 4]>(read).into_iter().map(rgb).collect()).collect()
    }
}

pub(crate) fn noise(random: &mut Random) -> Vec<Vec3> {
    (0..SIZE[0] * SIZE[1]).map(|_| Vec3::new(random.unit(), random.unit(), random.unit())).collect()
}

pub(crate) fn largest_difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
}
