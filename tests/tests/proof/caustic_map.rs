//! `caustic-map`: lenses by their equations, flux, the caustics of a ring by their closed forms, and those of a reference.

use crate::beams::horizontal;
use crate::determinism::settings;
use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{BufferDesc, ComputeShader, Graph, TextureDesc};
use lightloom_passes::scene::{Camera, Emission, Light, Material, Scene, Triangle, builtin};
use lightloom_passes::{CameraUniform, GBuffer, Photon, PhotonFlags, PhotonSettings, decode_flux, decode_octahedral};
use lightloom_strategies::{CausticMap, FrameInputs, SortedGrid, Strategy};
use lightloom_tests::reference::Reference;
use lightloom_tests::{Frame, Lab, View};
use std::f64::consts::PI;

fn caustic_map(lab: &Lab, settings: &[(&str, &str)]) -> Box<dyn Strategy> {
    let mut strategy = CausticMap::new(&lab.sources).expect("it builds");
    for (key, value) in settings {
        strategy.set(key, value).expect("it has the parameter");
    }
    Box::new(strategy)
}

fn caustics(photons: &[Photon]) -> impl Iterator<Item = &Photon> {
    photons.iter().filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0)
}

fn flux(photons: &[Photon]) -> DVec3 {
    caustics(photons).map(|photon| decode_flux(photon.flux).as_dvec3()).sum()
}

/// Eight numbers of each of `count` threads of `body`, which may call what `shared/caustic_lens.wgsl` holds.
fn lenses(lab: &mut Lab, body: &str, count: u32) -> Vec<f64> {
    let text = format!(
        "#import \"shared/caustic_lens.wgsl\"\n\
         @group(0) @binding(0) var<storage, read_write> results: array<f32>;\n\
         @compute @workgroup_size(1)\nfn probe(@builtin(global_invocation_id) id: vec3u) {{ let i = f32(id.x);\n{body}\n}}"
    );
    let shader = ComputeShader::new(&lab.sources.with(&[("probe.wgsl", &text)]), "probe.wgsl").expect("the probe is valid");
    let mut graph = Graph::new("probe");
    let mut results = graph.buffer("results", BufferDesc::words(count.into()));
    graph.compute(&shader).write("results", &mut results).dispatch([count, 1, 1]);
    let read = graph.readback_buffer(&results);
    lab.run(graph).cast::<f32>(read).into_iter().map(f64::from).collect()
}

/// PHYSICS check 8, and [WD08, Eq. 7] as printed.
#[test]
fn lenses_follow_their_equations() {
    let Some(mut lab) = Lab::open() else { return };
    // Both faces of power 0.6, 0.7, …: f = 1 / 1.2, 1 / 1.4 …; the light 3 m before, so that there is an image.
    let thin = "let power = 0.6 + 0.1 * i; let lens = Lens(power, 0.5 * power, 0.0, 1.5);
        let image = 1.0 / (1.5 * power - 1.0 / 3.0);";
    for value in lenses(&mut lab, &format!("{thin} results[id.x] = lens_magnification(lens, 1.0 / 3.0, image);"), 8) {
        assert!(value.abs() < 1e-6, "a point at the image: {value}");
    }
    let found = lenses(&mut lab, &format!("{thin} results[id.x] = lens_magnification(lens, 1.0 / 3.0, 0.2 + 0.3 * i);"), 8);
    for (i, found) in found.into_iter().enumerate() {
        let (power, beyond) = (0.6 + 0.1 * i as f64, 0.2 + 0.3 * i as f64);
        let image = 1.0 / (1.5 * power - 1.0 / 3.0);
        let printed = 3.0 / (3.0 + beyond) * (beyond - image) / image;
        assert!((found.abs() - printed.abs()).abs() < 1e-6, "{i}: {found}, printed {printed}");
        assert_eq!(found < 0.0, beyond > image, "{i}: crossed behind the image");
    }
    // f → ∞, thin and thick: within 10⁻⁵ of 1, as weak as 10⁻⁶ m⁻¹; the pane displaces light by a third of its thickness.
    let weak = "let power = pow(10.0, -i);";
    let thin =
        lenses(&mut lab, &format!("{weak} results[id.x] = lens_magnification(Lens(power, power, 0.0, 1.5), 0.5, 4.0);"), 7);
    assert!(thin.windows(2).all(|pair| (pair[1] - 1.0).abs() <= (pair[0] - 1.0).abs()), "{thin:?}");
    assert!((thin[6] - 1.0).abs() < 1e-5, "D → D₀: {}", thin[6]);
    let pane = lenses(&mut lab, "results[id.x] = lens_magnification(Lens(0.0, 0.0, 0.6, 1.5), 0.5, 4.0);", 1)[0];
    assert!((pane - (2.0 + 0.4 + 4.0) / (2.0 + 0.6 + 4.0)).abs() < 1e-6, "a pane: {pane}");
    // A ball of diameter D focuses parallel light n D / (4 (n − 1)) behind its middle.
    let ball = "let ior = 1.2 + 0.1 * i; let radius = 0.7; let power = (ior - 1.0) / radius;
        let focus = ior * 2.0 * radius / (4.0 * (ior - 1.0));
        results[id.x] = lens_magnification(Lens(power, power, 2.0 * radius, ior), 0.0, focus - radius);";
    for (i, value) in lenses(&mut lab, ball, 7).into_iter().enumerate() {
        assert!(value.abs() < 2e-6, "a ball of n = {}: {value}", 1.2 + 0.1 * i as f64);
    }
}

/// What the passes up to the map leave behind.
struct Run {
    /// E (W·m⁻²) of each texel, view by view.
    map: Vec<[f32; 4]>,
    /// Depth (m, bits) and normal.
    receivers: Vec<[u32; 2]>,
    /// Clip from world, a matrix per view.
    views: Vec<DMat4>,
    side: u32,
    /// Photons seen and unseen, texels that overflowed.
    stats: Vec<u32>,
    records: Vec<Photon>,
    choice: String,
}

impl Run {
    /// Traces photons and makes maps of `side` texels.
    fn new(lab: &mut Lab, scene: &Scene, photons: &PhotonSettings, mode: &str, side: u32) -> Self {
        let gpu_scene = lab.upload(scene);
        let info = gpu_scene.info();
        let mut strategy = caustic_map(lab, &[("mode", mode), ("side", &side.to_string())]);
        let mut graph = Graph::new("maps");
        let handles = gpu_scene.declare(&mut graph);
        let photons_of = lab.tracing.add(&mut graph, &handles, &info, photons);
        let size = [8, 8];
        let mut nothing = |name, format| graph.import_texture(name, TextureDesc::new_2d(size, format), None);
        // No pass that is run looks at it.
        let gbuffer = GBuffer {
            position: nothing("position", TextureFormat::Rgba32Float),
            surface: nothing("surface", TextureFormat::Rgba32Uint),
            emission: nothing("emission", TextureFormat::Rgba32Float),
            motion: None,
        };
        let eye = Camera::look_at("eye", Vec3::Y, Vec3::ZERO, Vec3::Z, 1.0);
        let camera = CameraUniform::new(&eye, size, [0.5; 2], info.bounds_radius);
        let inputs = FrameInputs {
            scene: &handles,
            info: &info,
            gbuffer: &gbuffer,
            photons: Some(&photons_of),
            camera: &camera,
            size,
            frame_index: 0,
            seed: 0,
            max_bounces: photons.max_bounces,
            deterministic: false,
        };
        let estimate = strategy.declare(&mut graph, &inputs).expect("the strategy takes the frame");
        let last = match info.light_view_count {
            1 => "caustic_map_view".to_owned(),
            views => format!("caustic_map_view#{views}"),
        };
        let taps = (info.light_view_count > 0).then(|| {
            let map = graph.tap("caustic_map_resolve", Some("map")).expect("there is a map");
            (map, graph.tap(&last, Some("receivers")).expect("there are receivers"))
        });
        let [views, stats, records, state] =
            [&handles.light_views, &estimate.stats[0].buffer, &photons_of.records, &photons_of.state]
                .map(|b| graph.readback_buffer(b));
        let output = lab.run(graph);
        let stored = output.cast::<u32>(state)[0] as usize;
        let mut records = output.cast::<Photon>(records);
        records.truncate(stored);
        let matrices = output.cast::<[[f32; 4]; 4]>(views);
        let matrices = matrices.iter().take(info.light_view_count as usize);
        Self {
            map: taps.as_ref().map_or_else(Vec::new, |(map, _)| output.cast(map.readback)),
            receivers: taps.as_ref().map_or_else(Vec::new, |(_, receivers)| output.cast(receivers.readback)),
            views: matrices.map(|m| DMat4::from_cols_array_2d(&m.map(|column| column.map(f64::from)))).collect(),
            side,
            stats: output.cast(stats),
            records,
            choice: strategy.choice().expect("it says which maps there are"),
        }
    }

    /// Σ E a over all texels (W), a the quadrilateral that the rays through a texel's corners cut from its receiver's plane.
    fn flux(&self) -> DVec3 {
        let texels = (self.side * self.side) as usize;
        let mut sum = DVec3::ZERO;
        for (index, (light, receiver)) in self.map.iter().zip(&self.receivers).enumerate() {
            if light[0] > 0.0 {
                let area = self.area(&self.views[index / texels], (index % texels) as u32, *receiver);
                sum += Vec3::new(light[0], light[1], light[2]).as_dvec3() * area;
            }
        }
        sum
    }

    fn area(&self, clip_from_world: &DMat4, texel: u32, [depth, normal]: [u32; 2]) -> f64 {
        let world_from_clip = clip_from_world.inverse();
        let side = f64::from(self.side);
        // A point of the near plane, a millionth of the scene from a lamp, and one behind it: the ray through a point of the map.
        let ray = |x: f64, y: f64| {
            let point = |z: f64| {
                let p: DVec4 = world_from_clip * DVec4::new(x / side * 2.0 - 1.0, 1.0 - y / side * 2.0, z, 1.0);
                p.truncate() / p.w
            };
            (point(1.0), point(0.5) - point(1.0))
        };
        let (_, axis) = ray(0.5 * side, 0.5 * side);
        let (x, y) = (f64::from(texel % self.side), f64::from(texel / self.side));
        let (origin, along) = ray(x + 0.5, y + 0.5);
        let middle = origin + along * (f64::from(f32::from_bits(depth)) / along.dot(axis.normalize()));
        let normal = decode_octahedral(normal).as_dvec3();
        let [a, b, c, d] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(dx, dy)| {
            let (origin, along) = ray(x + dx, y + dy);
            origin + along * (normal.dot(middle - origin) / normal.dot(along))
        });
        0.5 * (c - a).cross(d - b).length()
    }
}

/// PHYSICS check 12 for maps of light: Σ E a is the flux of the caustic photons, through corners and edges of a cube's faces, however broad the splats.
#[test]
fn maps_hold_the_flux_of_the_photons_seen() {
    let Some(mut lab) = Lab::open() else { return };
    let photons = PhotonSettings { caustics_only: true, ..settings(12_000, 5, 3) };
    for mode in ["fixed", "multi-resolution", "thick-lens", "differential"] {
        let run = Run::new(&mut lab, &builtin::caustics(), &photons, mode, 96);
        let count = caustics(&run.records).count();
        assert!(count > 200, "{count} caustic photons");
        assert_eq!(run.stats, [count as u32, 0, 0], "{mode}: the light sees all of the room");
        assert!(run.choice.contains("6 maps of 96×96") && run.choice.contains(mode), "{}", run.choice);
        let ratio = run.flux() / flux(&run.records);
        println!("{mode}: {ratio:.7} of the flux of {count} photons");
        for ratio in ratio.to_array() {
            // Weights, areas and depths are rounded by 10⁻⁷ each; near the horizon of a plane cosines lose some digits.
            assert!((ratio - 1.0).abs() < 2e-5, "{mode}: {ratio} of the flux");
        }
    }
}

/// A mirror around the y axis, of radius 1, from the floor up to `height`.
fn ring(height: f32, material: u32) -> Vec<Triangle> {
    const SEGMENTS: u32 = 256;
    let at = |i: u32, y: f32| {
        let (sin, cos) = (i as f32 / SEGMENTS as f32 * 2.0 * std::f32::consts::PI).sin_cos();
        Vec3::new(cos, y, sin)
    };
    let triangle = |corners: [Vec3; 3]| {
        let normals_world = corners.map(|p| -Vec3::new(p.x, 0.0, p.z));
        Triangle { positions_world: corners, normals_world, uvs: [Vec2::ZERO; 3], material }
    };
    let strip = |i: u32| {
        let [a, b, c, d] = [at(i, 0.0), at(i + 1, 0.0), at(i + 1, height), at(i, height)];
        [triangle([a, b, c]), triangle([a, c, d])]
    };
    (0..SEGMENTS).flat_map(strip).collect()
}

/// PHYSICS check 7: light from a point of a ring, reflected once, is brightest on a cardioid, parallel light on a nephroid. Along a vertical wall the
/// way down goes on as before, so that a ray is where it would be in the plane.
#[test]
fn caustics_of_a_ring_lie_on_their_curves() {
    const SIZE: u32 = 160;
    const ACROSS: f64 = 2.2;
    let Some(mut lab) = Lab::open() else { return };
    let on = |angle: f64| DVec3::new(angle.cos(), 0.0, angle.sin());
    // Chords from one point of the circle to another, m times as fast, touch their envelope at 1 : m.
    let cardioid = |angle: f64| (on(angle) * 2.0 + on(2.0 * angle)) / 3.0;
    let nephroid = |angle: f64| (on(angle) * 3.0 + on(3.0 * angle - PI)) / 4.0;
    let lamp = Light::Point { position_world: Vec3::new(0.998, 1.5, 0.0), intensity: Vec3::ONE };
    let sun = Light::Directional { direction_world: Vec3::new(-1.0, -1.0, 0.0).normalize(), irradiance: Vec3::ONE };
    let degrees = |from: u32, to: u32| (from..=to).step_by(10).map(|degrees| f64::from(degrees).to_radians());
    let curves: [(&str, Light, f32, Vec<DVec3>); 2] = [
        ("cardioid", lamp, 1.6, degrees(70, 150).map(cardioid).collect()),
        ("nephroid", sun, 0.6, degrees(120, 165).map(nephroid).collect()),
    ];
    for (name, light, height, points) in curves {
        let scene = Scene {
            name: name.into(),
            triangles: [horizontal(0.0, 1.1, true, 0).to_vec(), ring(height, 1)].concat(),
            materials: vec![Material::lambert("floor", Vec3::splat(0.5)), Material::metal("mirror", Vec3::ONE, 0.0)],
            lights: vec![light],
            ..Scene::default()
        };
        // From so high that the picture is a map of the floor, but for the ring's wall.
        let eye = Camera::look_at(
            "above",
            Vec3::new(0.0, 40.0, 0.0),
            Vec3::ZERO,
            Vec3::NEG_Z,
            2.0 * (0.5 * ACROSS as f32 / 40.0).atan(),
        );
        let view = View::new(eye, [SIZE; 2]);
        let photons = PhotonSettings { caustics_only: true, ..settings(150_000, 1, 5) };
        let frame = Frame { photons, maps: None, deterministic: false };
        let strategy = caustic_map(&lab, &[("spread", "2")]);
        let gpu_scene = lab.upload(&scene);
        let estimates = lab.estimate(&gpu_scene, &view, frame, &mut [strategy]);
        let image = &estimates.layers[0][1];
        let pixel = ACROSS / f64::from(SIZE);
        let brightness = |at: DVec3| {
            let [x, y] = [at.x, at.z].map(|c| (c / pixel + 0.5 * f64::from(SIZE)) as u32);
            image.at(x, y)[1]
        };
        for (index, &point) in points.iter().enumerate() {
            let [before, after] = [index.saturating_sub(1), (index + 1).min(points.len() - 1)].map(|i| points[i]);
            let across = (after - before).cross(DVec3::Y).normalize();
            // Half pixels, 20 each way.
            let profile: Vec<f64> =
                (-40..=40).map(|step| brightness(point + across * (0.25 * f64::from(step) * pixel))).collect();
            let (peak, _) = profile.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("there are values");
            let off = (peak as f64 - 40.0) * 0.25;
            println!("{name}, ({:.3}, {:.3}): brightest {off:+} pixels off", point.x, point.z);
            // A pixel is 14 mm, a texel of the map at the floor 4 to 12.
            assert!(off.abs() <= 1.0, "{name} at {point}: brightest {off} pixels beside the curve");
        }
    }
}

/// Light through a pane on a floor, of lamps of every kind: each has its views, several add up, and each photon is on one map.
#[test]
fn every_kind_of_lamp_has_maps() {
    let Some(mut lab) = Lab::open() else { return };
    let sun = Light::Directional { direction_world: Vec3::new(0.1, -1.0, 0.2).normalize(), irradiance: Vec3::ONE };
    let lamp = Light::Point { position_world: Vec3::new(-0.4, 2.0, 0.3), intensity: Vec3::splat(4.0) };
    let spot = |half_angle: f32| Light::Spot {
        position_world: Vec3::new(0.5, 2.2, -0.2),
        direction_world: Vec3::new(-0.2, -1.0, 0.1).normalize(),
        intensity: Vec3::splat(6.0),
        cos_inner: (0.7 * half_angle).cos(),
        cos_outer: half_angle.cos(),
    };
    let cases: [(&str, Vec<Light>, u32); 3] =
        [("a sun", vec![sun], 1), ("a spot", vec![spot(0.5)], 1), ("all", vec![sun, spot(0.5), spot(1.2), lamp], 14)];
    for (name, lights, views) in cases {
        let scene = Scene {
            name: name.into(),
            triangles: [horizontal(0.0, 1.5, true, 0), horizontal(1.2, 1.5, true, 1), horizontal(1.0, 1.5, false, 1)].concat(),
            materials: vec![Material::lambert("floor", Vec3::splat(0.5)), Material::glass("pane", 1.5, 0.2)],
            lights,
            ..Scene::default()
        };
        let photons = PhotonSettings { caustics_only: true, ..settings(6_000, 2, 7) };
        let run = Run::new(&mut lab, &scene, &photons, "differential", 64);
        let count = caustics(&run.records).count() as u32;
        assert_eq!(run.views.len() as u32, views, "{name}");
        assert!(count > 200, "{name}: {count} photons");
        assert_eq!(run.stats, [count, 0, 0], "{name}: nothing hides the floor");
        let ratio = (run.flux() / flux(&run.records)).x;
        assert!((ratio - 1.0).abs() < 2e-5, "{name}: {ratio} of the flux");
    }
}

/// What no light would see is counted, and not put elsewhere; lamps that are surfaces have no maps.
#[test]
fn photons_that_no_light_sees_are_counted() {
    let Some(mut lab) = Lab::open() else { return };
    let photons = PhotonSettings { caustics_only: true, ..settings(20_000, 1, 7) };
    // A mirror below a lamp, and a board over its shadow's edge: light from the mirror meets the board's lower side.
    let mut scene = Scene {
        name: "board".into(),
        triangles: [horizontal(0.0, 1.0, true, 1), horizontal(1.0, 0.5, true, 0)].concat(),
        materials: vec![Material::lambert("board", Vec3::splat(0.5)), Material::metal("mirror", Vec3::ONE, 0.0)],
        lights: vec![Light::Point { position_world: Vec3::new(0.7, 1.5, 0.0), intensity: Vec3::ONE }],
        ..Scene::default()
    };
    let run = Run::new(&mut lab, &scene, &photons, "fixed", 64);
    let count = caustics(&run.records).count() as u32;
    assert!(count > 100, "{count} photons come back from the mirror");
    assert_eq!(run.stats, [0, count, 0], "the lamp sees the board's other side");
    assert!(run.map.iter().all(|texel| texel[0] == 0.0), "they light nothing");

    // A second lamp, below: it sees them all.
    scene.lights.push(Light::Point { position_world: Vec3::new(0.0, 0.5, 0.0), intensity: Vec3::splat(1e-3) });
    let run = Run::new(&mut lab, &scene, &photons, "fixed", 64);
    let count = caustics(&run.records).count() as u32;
    assert_eq!(run.stats, [count, 0, 0], "another lamp sees them");
    let ratio = (run.flux() / flux(&run.records)).x;
    assert!((ratio - 1.0).abs() < 2e-5, "{ratio} of the flux");

    scene.lights.clear();
    scene.materials.push(Material::emitter("lamp", Vec3::ONE));
    scene.triangles.extend(horizontal(0.9, 0.2, false, 2));
    let run = Run::new(&mut lab, &scene, &photons, "fixed", 64);
    let count = caustics(&run.records).count() as u32;
    assert!(count > 200, "{count} photons of a lamp that is a surface");
    assert_eq!(run.stats, [0, count, 0], "no map");
    assert!(run.choice.contains("no map") && run.choice.contains("`screen-space`"), "{}", run.choice);
}

/// The pictures of an independent renderer with and without caustics differ by the light whose first scattering was specular. Photons that are
/// followed there alone bring what other surfaces scatter of it afterwards, which is smooth, by another strategy; the rest is the caustic layer.
#[test]
fn caustics_are_those_of_the_reference() {
    const LENSES: [&str; 2] = ["differential", "thin-lens"];
    let Some(mut lab) = Lab::open() else { return };
    let Some(reference) = Reference::load("caustics_point", 0) else { return };
    let gpu_scene = lab.upload(&reference.scene);
    let camera = reference.scene.camera(None).expect("the scene has a camera");
    let frame = |emitted, max_bounces| {
        let photons = PhotonSettings { caustics_only: true, ..settings(emitted, max_bounces, 9) };
        Frame { photons, maps: None, deterministic: false }
    };

    let mut global = SortedGrid::new(&lab.sources).expect("it builds");
    global.set("radius", "0.05").expect("it has the parameter");
    let view = View::new(camera.clone(), reference.size());
    let all = lab.estimate_by(Emission::Guided, &gpu_scene, &view, frame(20_000, 24), &mut [Box::new(global)]);
    let rest = reference.smooth.mean(&all.layers[0][0].zip(&all.layers[0][1], |all, caustic| all - caustic));
    let theirs = reference.smooth.mean(&reference.radiance.mean.zip(&reference.part("_without_caustics"), |a, b| a - b));

    // Foci are smaller than the reference's pixels, which hold means over their area: 4 × 4 places in each.
    let view = View::new(camera, reference.size().map(|side| 4 * side));
    let mut maps = LENSES.map(|mode| caustic_map(&lab, &[("mode", mode)]));
    let estimates = lab.estimate_by(Emission::Guided, &gpu_scene, &view, frame(40_000, 5), &mut maps);
    let average = |four: [f64; 4]| four.iter().sum::<f64>() / 4.0;
    for (mode, [caustics, _]) in LENSES.iter().zip(&estimates.layers) {
        let found = reference.smooth.mean(&caustics.halved(average).halved(average));
        println!(
            "{mode}: {:.4} of the reference's light, {:.4} of its caustics",
            (rest + found) / theirs,
            found / (theirs - rest)
        );
        // The difference of the reference's pictures is known to 1.5 % (see `references`).
        assert!(((rest + found) / theirs - 1.0).abs() < 0.03, "{mode}: {found} and {rest}, the reference has {theirs}");
    }
}
