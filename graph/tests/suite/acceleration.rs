//! Acceleration structures: bound by name, refused where they do not fit, never part of the frame's memory.

use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Declaration, Executor, Gpu, Graph, GraphError, Handle, PlanOptions, ResourceKind, Tlas,
    shader_struct, wgpu,
};

shader_struct! {
    /// As the WGSL `Ray` below.
    pub struct Ray { pub origin: [f32; 3], pub t_max: f32, pub direction: [f32; 3], pub pad0: u32 }
}

fn shader() -> ComputeShader {
    let wgsl = "enable wgpu_ray_query;
        struct Ray { origin: vec3f, t_max: f32, direction: vec3f, pad0: u32 }
        @group(0) @binding(0) var structure: acceleration_structure;
        @group(0) @binding(1) var<storage, read> rays: array<Ray>;
        @group(0) @binding(2) var<storage, read_write> distances: array<f32>;
        @compute @workgroup_size(64) fn query(@builtin(global_invocation_id) id: vec3u) {
            if id.x >= arrayLength(&rays) { return; }
            let ray = rays[id.x];
            var query: ray_query;
            rayQueryInitialize(&query, structure, RayDesc(RAY_FLAG_NONE, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction));
            while rayQueryProceed(&query) {}
            let found = rayQueryGetCommittedIntersection(&query);
            distances[id.x] = select(found.t, -1.0, found.kind == RAY_QUERY_INTERSECTION_NONE);
        }";
    ComputeShader::from_wgsl("query", wgsl).unwrap()
}

fn add(graph: &mut Graph<'_>, structure: &Handle<Tlas>, rays: &Handle<Buffer>) -> Handle<Buffer> {
    let mut distances = graph.buffer("distances", BufferDesc::words(2));
    graph.compute(&shader()).read("structure", structure).read("rays", rays).write("distances", &mut distances).dispatch_1d(2);
    distances
}

#[test]
fn a_frame_with_a_structure_plans_without_a_device_and_costs_no_memory() {
    let mut graph = Graph::new("planned");
    let structure = graph.import_tlas("scene", None);
    let rays = graph.import_buffer("rays", BufferDesc::array_of::<Ray>(2), None);
    let distances = add(&mut graph, &structure, &rays);
    graph.keep(&distances);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    assert_eq!(plan.memory.unshared_bytes, 8, "the distances alone");
    assert!(plan.lifetimes[0].is_some(), "the structure is used");

    let declaration = graph.declaration().unwrap();
    let json = declaration.to_frame_json();
    assert!(json.contains("\"acceleration_structure\""), "{json}");
    let read = Declaration::from_frame_json(&json).unwrap();
    assert_eq!(read.resources[0].kind, ResourceKind::Tlas);
    let transient = json.replacen("\"imported\"", "\"transient\"", 1);
    let error = Declaration::from_frame_json(&transient).unwrap_err().to_string();
    assert!(error.contains("`scene`") && error.contains("imported"), "{error}");
}

type Declare<'a> = &'a dyn Fn(&mut Graph<'_>, &Handle<Tlas>, &Handle<Buffer>);

#[test]
fn what_is_no_structure_is_refused_and_so_is_a_structure_elsewhere() {
    let refused = |declare: Declare<'_>| {
        let mut graph = Graph::new("refused");
        let structure = graph.import_tlas("scene", None);
        let rays = graph.import_buffer("rays", BufferDesc::array_of::<Ray>(2), None);
        declare(&mut graph, &structure, &rays);
        graph.plan(&PlanOptions::default()).unwrap_err()
    };
    let a_buffer = refused(&|graph, _, rays| {
        let mut distances = graph.buffer("distances", BufferDesc::words(2));
        graph.compute(&shader()).read("structure", rays).read("rays", rays).write("distances", &mut distances).dispatch_1d(2);
    });
    let text = a_buffer.to_string();
    for part in ["`structure`", "an acceleration structure", "`import_tlas`", "`rays`", "a buffer"] {
        assert!(text.contains(part), "`{part}` is missing: {text}");
    }
    let elsewhere = refused(&|graph, structure, _| {
        let mut distances = graph.buffer("distances", BufferDesc::words(2));
        let pass = graph.compute(&shader()).read("structure", structure).read("rays", structure);
        pass.write("distances", &mut distances).dispatch_1d(2);
    });
    let text = elsewhere.to_string();
    assert!(matches!(&elsewhere, GraphError::Kind { binding, .. } if binding == "rays"), "{text}");
    for part in ["`scene`", "an acceleration structure", "a storage buffer"] {
        assert!(text.contains(part), "`{part}` is missing: {text}");
    }
    let unbound = refused(&|graph, _, rays| {
        let mut distances = graph.buffer("distances", BufferDesc::words(2));
        graph.compute(&shader()).read("rays", rays).write("distances", &mut distances).dispatch_1d(2);
    });
    assert!(matches!(&unbound, GraphError::Unbound { binding, .. } if binding == "structure"), "{unbound}");
}

#[test]
fn a_device_without_ray_queries_is_told_what_it_lacks() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut graph = Graph::new("lacking");
    let structure = graph.import_tlas("scene", None);
    let mut rays = graph.buffer("rays", BufferDesc::array_of::<Ray>(2));
    graph.clear_buffer(&mut rays);
    let distances = add(&mut graph, &structure, &rays);
    graph.readback_buffer(&distances);
    let error = Executor::new(&gpu).execute(graph).unwrap_err();
    assert!(matches!(&error, GraphError::RayQuery { resource } if resource == "scene"), "{error}");
    assert!(error.to_string().contains("EXPERIMENTAL_RAY_QUERY"), "{error}");
}

/// A structure of one triangle in the plane z = 2.
fn one_triangle(gpu: &Gpu) -> wgpu::Tlas {
    let corners: [[f32; 3]; 3] = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]];
    let vertices = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices"),
        size: 36,
        usage: wgpu::BufferUsages::BLAS_INPUT | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&vertices, 0, bytemuck::cast_slice(&corners));
    let size = wgpu::BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count: 3,
        index_format: None,
        index_count: None,
        flags: wgpu::AccelerationStructureGeometryFlags::OPAQUE,
    };
    let (flags, update_mode) =
        (wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE, wgpu::AccelerationStructureUpdateMode::Build);
    let blas = gpu.device.create_blas(
        &wgpu::CreateBlasDescriptor { label: None, flags, update_mode },
        wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors: vec![size.clone()] },
    );
    let mut tlas = gpu.device.create_tlas(&wgpu::CreateTlasDescriptor { label: None, max_instances: 1, flags, update_mode });
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    tlas[0] = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
    let geometry = wgpu::BlasTriangleGeometry {
        size: &size,
        vertex_buffer: &vertices,
        first_vertex: 0,
        vertex_stride: 12,
        index_buffer: None,
        first_index: None,
        transform_buffer: None,
        transform_buffer_offset: None,
    };
    let entry = wgpu::BlasBuildEntry { blas: &blas, geometry: wgpu::BlasGeometries::TriangleGeometries(vec![geometry]) };
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.build_acceleration_structures([&entry], [&tlas]);
    gpu.queue.submit([encoder.finish()]);
    tlas
}

#[test]
fn a_kernel_queries_an_imported_structure() {
    let Some(gpu) = Gpu::for_tests_with(wgpu::Features::EXPERIMENTAL_RAY_QUERY) else { return };
    let structure = one_triangle(&gpu);
    let mut executor = Executor::new(&gpu);
    let ray = |x: f32| Ray { origin: [x, 0.0, 0.0], t_max: 10.0, direction: [0.0, 0.0, 1.0], pad0: 0 };
    let rays = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("rays"),
        size: 64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&rays, 0, bytemuck::cast_slice(&[ray(0.0), ray(3.0)]));
    for frame in 0..2 {
        let mut graph = Graph::new("queried");
        let scene = graph.import_tlas("scene", structure.clone());
        let rays = graph.import_buffer("rays", BufferDesc::array_of::<Ray>(2), rays.clone());
        let distances = add(&mut graph, &scene, &rays);
        let read = graph.readback_buffer(&distances);
        let output = executor.execute(graph).unwrap();
        assert_eq!(output.cast::<f32>(read), [2.0, -1.0], "frame {frame}");
        assert_eq!(output.cached_plan, frame > 0);
    }
}

#[test]
fn a_closure_is_handed_the_structure_that_it_declares() {
    let Some(gpu) = Gpu::for_tests_with(wgpu::Features::EXPERIMENTAL_RAY_QUERY) else { return };
    let structure = one_triangle(&gpu);
    let handed = std::cell::RefCell::new(None);
    let mut graph = Graph::new("by hand");
    let scene = graph.import_tlas("scene", structure.clone());
    graph.closure("looks").read(&scene).side_effect().record(|context| {
        *handed.borrow_mut() = Some((context.tlas("scene")?, context.tlas("scenery").unwrap_err()));
        Ok(())
    });
    Executor::new(&gpu).execute(graph).unwrap();
    let (found, refusal) = handed.into_inner().expect("the closure ran");
    assert_eq!(found, structure);
    assert!(refusal.contains("no acceleration structure `scenery`"), "{refusal}");
}
