//! What it costs to move a scene by one frame, beside building it anew: a small part of it moves, or all of it.
//!
//! `cargo bench -p lightloom-passes --bench animation [-- SCENE.glb]`; without a scene, built-in ones. A file that moves by
//! itself is posed over its length; of others, one triangle in sixteen is moved about the scene's centre ("a part"), or all are twisted
//! ("all"), further each frame. Upload is the time until the queue has taken the data. Medians over the frames; `growth` is the
//! expected cost of a ray after the last refit, relative to the build.

use glam::{Quat, Vec3};
use lightloom_graph::{Gpu, GpuRequest};
use lightloom_passes::scene::{Bvh, GpuScene, Scene, Triangle, builtin};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

const FRAMES: u16 = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let scenes = if paths.is_empty() {
        vec![builtin::moving(), builtin::caustics(), builtin::closed_sphere(7)]
    } else {
        paths.iter().map(|path| Scene::load(Path::new(path))).collect::<Result<_, _>>()?
    };
    let gpu = Gpu::new(&GpuRequest::default())?;
    println!("{}", gpu.adapter_name());
    let heads = ["scene", "moves", "triangles", "pose ms", "refit ms", "upload ms", "growth", "build ms", "build/refit"];
    println!("{}", row(&heads.map(str::to_owned)));
    for scene in scenes {
        if scene.animation.is_some() {
            measure(&gpu, &scene, "its own", |scene, s| scene.pose(s * scene.duration().unwrap_or(0.0)).is_ok())?;
            continue;
        }
        let rest = scene.triangles.clone();
        let (center, radius) = scene.bounding_sphere();
        let turned = |angle: f32, p: Vec3| center + Quat::from_rotation_y(angle) * (p - center);
        measure(&gpu, &scene, "a part", |scene, s| {
            let part = scene.triangles.len() / 16;
            change(&mut scene.triangles[..part], &rest, |p| turned(s, p))
        })?;
        measure(&gpu, &scene, "all", |scene, s| {
            change(&mut scene.triangles, &rest, |p| turned(s * (p.y - center.y) / radius, p))
        })?;
    }
    Ok(())
}

fn change(triangles: &mut [Triangle], rest: &[Triangle], to: impl Fn(Vec3) -> Vec3) -> bool {
    for (triangle, rest) in triangles.iter_mut().zip(rest) {
        triangle.positions_world = rest.positions_world.map(&to);
    }
    true
}

/// `go` moves the scene to a part of its way, 0 to 1, and says whether it could.
fn measure(gpu: &Gpu, scene: &Scene, what: &str, go: impl Fn(&mut Scene, f32) -> bool) -> Result<(), Box<dyn Error>> {
    let mut scene = scene.clone();
    let mut bvh = Bvh::build(&scene.name, &scene.triangles)?;
    let mut gpu_scene = GpuScene::upload_with_bvh(&gpu.device, &gpu.queue, &scene, &bvh)?;
    let mut times: [Vec<f64>; 4] = Default::default();
    let mut growth = 1.0;
    for frame in 1..=FRAMES {
        let start = Instant::now();
        if !go(&mut scene, f32::from(frame) / f32::from(FRAMES)) {
            return Err("a pose was refused".into());
        }
        let posed = Instant::now();
        growth = bvh.refit(&scene.triangles)?;
        let refitted = Instant::now();
        gpu_scene.update(&scene, &bvh)?;
        let uploaded = Instant::now();
        Bvh::build(&scene.name, &scene.triangles)?;
        let built = Instant::now();
        let steps = [posed - start, refitted - posed, uploaded - refitted, built - uploaded];
        for (times, step) in times.iter_mut().zip(steps) {
            times.push(step.as_secs_f64() * 1e3);
        }
        gpu.queue.submit([]);
        gpu.device.poll(lightloom_graph::wgpu::PollType::wait_indefinitely())?;
    }
    let [pose, refit, upload, build] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    let ms = |time: f64| format!("{time:.2}");
    println!(
        "{}",
        row(&[
            scene.name.clone(),
            what.to_owned(),
            scene.triangles.len().to_string(),
            ms(pose),
            ms(refit),
            ms(upload),
            ms(growth.into()),
            ms(build),
            format!("{:.0}", build / refit),
        ])
    );
    Ok(())
}

fn row(cells: &[String; 9]) -> String {
    let [name, rest @ ..] = cells;
    rest.iter().fold(format!("{name:<14}"), |line, cell| line + &format!("{cell:>12}"))
}
