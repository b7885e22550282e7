//! What was uploaded is read back and compared with the scene.

use super::*;
use crate::scene::gpu_types::{ALPHA_TESTED, BvhNode};
use crate::scene::{Alpha, TextureData, TextureUse, builtin};
use glam::Vec3;
use lightloom_graph::Gpu;

/// Contents of a buffer.
fn read(gpu: &Gpu, resident: &Resident) -> Vec<u8> {
    let buffer = resident.buffer.as_ref().unwrap();
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("staging"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    staging.slice(..).map_async(wgpu::MapMode::Read, |result| result.unwrap());
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    staging.slice(..).get_mapped_range().unwrap().to_vec()
}

#[test]
fn buffers_hold_the_scene() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut scene = builtin::cornell();
    scene.textures.push(TextureData {
        name: "half there".into(),
        width: 1,
        height: 2,
        rgba8: vec![255, 255, 255, 255, 255, 255, 255, 0],
    });
    scene.materials[1].base_color_texture = Some(TextureUse::new(0));
    scene.materials[1].alpha = Alpha::Mask(0.5);
    let bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
    let uploaded = GpuScene::upload_with_bvh(&gpu.device, &gpu.queue, &scene, &bvh).unwrap();

    let nodes: Vec<BvhNode> = bvh.nodes().collect();
    assert_eq!(read(&gpu, &uploaded.pose.bvh_nodes), bytemuck::cast_slice::<_, u8>(&nodes));
    let bytes = read(&gpu, &uploaded.pose.bvh_triangles);
    let in_leaf_order: &[BvhTriangle] = bytemuck::cast_slice(&bytes);
    let bytes = read(&gpu, &uploaded.pose.triangles);
    let attributes: &[TriangleAttributes] = bytemuck::cast_slice(&bytes);
    let bytes = read(&gpu, &uploaded.pose.lights);
    let lights: &[Light] = bytemuck::cast_slice(&bytes);
    let bytes = read(&gpu, &uploaded.materials);
    let materials: &[Material] = bytemuck::cast_slice(&bytes);
    assert_eq!(in_leaf_order.len(), scene.triangles.len());
    assert_eq!(materials.len(), scene.materials.len());
    assert_eq!(materials[1].base_color_texture.height, 2);
    for (place, triangle) in in_leaf_order.iter().enumerate() {
        let index = triangle.id & !ALPHA_TESTED;
        assert_eq!(index, bvh.leaf_order()[place]);
        let original = &scene.triangles[index as usize];
        assert_eq!(Vec3::from(triangle.v0), original.positions_world[0], "corner");
        assert_eq!(triangle.material, original.material);
        assert_eq!(triangle.id & ALPHA_TESTED != 0, original.material == 1, "only the mask is tested");
        assert_eq!(triangle.light, attributes[index as usize].light, "both name one light");
        if triangle.light != NONE {
            assert_eq!(lights[triangle.light as usize].triangle, index);
        }
    }
    assert_eq!(lights.len() as u32, uploaded.info().light_count);
    assert!((lights[lights.len() - 1].cdf - 1.0).abs() < f32::EPSILON, "the cdf ends at one");
}

#[test]
fn a_device_that_is_too_small_is_named() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let small = wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits { max_storage_buffer_binding_size: 1 << 16, ..wgpu::Limits::default() },
        ..wgpu::DeviceDescriptor::default()
    };
    let mut request = std::pin::pin!(gpu.adapter.request_device(&small));
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    let (device, queue) = loop {
        if let std::task::Poll::Ready(result) = request.as_mut().poll(&mut context) {
            break result.unwrap();
        }
    };
    let error = GpuScene::upload(&device, &queue, &builtin::caustics()).unwrap_err();
    let message = error.to_string();
    for part in ["`caustics`", "`bvh_nodes`", "bytes", "65536", "max_storage_buffer_binding_size"] {
        assert!(message.contains(part), "`{message}` should say `{part}`");
    }
}

#[test]
fn a_described_scene_declares_the_frame_of_an_uploaded_one() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let scene = builtin::cornell();
    let described = GpuScene::describe(&scene).unwrap();
    let uploaded = GpuScene::upload(&gpu.device, &gpu.queue, &scene).unwrap();
    let declare = |scene: &GpuScene| {
        let mut graph = Graph::new("f");
        scene.declare(&mut graph);
        graph.declaration().unwrap().to_frame_json()
    };
    assert_eq!(declare(&described), declare(&uploaded));
    assert_eq!(described.bytes(), uploaded.bytes());
    assert!(described.pose.bvh_nodes.buffer.is_none() && described.texels.0.is_none(), "something was created");
}

#[test]
fn an_update_writes_what_an_upload_would_into_the_same_buffers() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut scene = builtin::moving();
    let mut moved = GpuScene::upload(&gpu.device, &gpu.queue, &scene).unwrap();
    let mut described = GpuScene::describe(&scene).unwrap();
    scene.pose(1.3).unwrap();
    let lit = moved.info().light_count;
    for lamp_is_there in [true, false] {
        if !lamp_is_there {
            // Its triangles shrink to a point: they stay, and shine no more.
            let lamp = scene.triangles.iter_mut().filter(|t| scene.materials[t.material as usize].emissive[0] > 0.0);
            lamp.for_each(|triangle| triangle.positions_world = [Vec3::Y; 3]);
        }
        let bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
        let before = buffers(&moved).map(|resident| resident.buffer.clone());
        moved.update(&scene, &bvh).unwrap();
        described.update(&scene, &bvh).unwrap();
        let fresh = GpuScene::upload_with_bvh(&gpu.device, &gpu.queue, &scene, &bvh).unwrap();
        for ((old, after), new) in before.iter().zip(buffers(&moved)).zip(buffers(&fresh)) {
            assert_eq!(read(&gpu, after), read(&gpu, new), "{}", new.name);
            let fits = old.as_ref().map(wgpu::Buffer::size) == after.buffer.as_ref().map(wgpu::Buffer::size);
            assert_eq!(*old == after.buffer, fits, "{} is kept where it fits", new.name);
        }
        assert_eq!((moved.info(), moved.budget()), (fresh.info(), fresh.budget()));
        assert_eq!((described.info(), described.bytes()), (fresh.info(), fresh.bytes()));
    }
    assert_eq!(moved.info().light_count, lit - 2, "a lamp of two triangles");
    scene.triangles.pop();
    let error = moved.update(&scene, &Bvh::build("moving", &builtin::cornell().triangles).unwrap()).unwrap_err();
    assert!(matches!(error, SceneError::Refit { .. }), "{error}");
}

/// Those that follow a pose.
fn buffers(scene: &GpuScene) -> [&Resident; 4] {
    let Pose { bvh_nodes, bvh_triangles, triangles, lights, .. } = &scene.pose;
    [bvh_nodes, bvh_triangles, triangles, lights]
}

#[test]
fn what_the_device_was_opened_without_is_refused() {
    let Some(gpu) = Gpu::for_tests() else { return };
    for backend in [RayBackend::RayQuery, RayBackend::Pipeline] {
        let scene = GpuScene::upload(&gpu.device, &gpu.queue, &builtin::cornell()).unwrap();
        assert_eq!(scene.rays(), RayBackend::Bvh, "what every device can");
        let error = scene.with_rays(backend).unwrap_err();
        if backend.is_built() {
            assert!(matches!(error, SceneError::Rays(RayBackendError::NotEnabled { .. })), "{error}");
            assert!(error.to_string().contains("RayBackend::enable"), "{error}");
        } else {
            assert!(matches!(error, SceneError::Rays(RayBackendError::NotBuilt { .. })), "{error}");
        }
    }
}
