//! naga parses and validates every shader; structs and constants that Rust and WGSL both state are compared.

use lightloom_graph::{Field, ShaderStruct, WgslSources};
use lightloom_passes::scene::{bvh, gpu_types};
use lightloom_passes::{
    CameraUniform, CompactPhoton, DepositCull, LightInfo, LivePaths, PackedDifferential, Photon, PhotonFlags, PhotonGrid,
    PhotonPath, PhotonState, PhotonStore, Ray, RayHit,
};
use lightloom_strategies::SplatSums;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Expression, Literal, Module, TypeInner};
use std::collections::BTreeSet;

/// The flattened file, parsed and validated for any WebGPU device.
fn module(path: &str) -> Module {
    reflected(path, PhotonStore::Whole).0
}

/// As [`module`], with what each entry point uses, of the shaders for `store`.
fn reflected(path: &str, store: PhotonStore) -> (Module, ModuleInfo) {
    reflected_of(path, &store.shaders())
}

fn reflected_of(path: &str, sources: &WgslSources) -> (Module, ModuleInfo) {
    let flat = sources.flatten(path).unwrap_or_else(|error| panic!("{error}"));
    let module =
        naga::front::wgsl::parse_str(flat.source()).unwrap_or_else(|e| panic!("{path}: {}", e.emit_to_string(flat.source())));
    // No capability beyond WebGPU's, to which `pack2x16float` belongs, but for shaders that say so by their folder or by a type.
    let webgpu = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    let beyond = match path {
        _ if path.contains("/ray_query/") => Capabilities::RAY_QUERY,
        _ if path.contains("/ray_pipeline/") => Capabilities::RAY_TRACING_PIPELINE,
        _ if flat.source().contains("atomic<f32>") => Capabilities::SHADER_FLOAT32_ATOMIC,
        _ => Capabilities::empty(),
    };
    let validated = Validator::new(ValidationFlags::all(), webgpu | beyond).validate(&module);
    let info = validated.unwrap_or_else(|e| panic!("{path}: {}", e.emit_to_string(flat.source())));
    (module, info)
}

#[test]
fn naga_validates_every_shader() {
    let floats = SplatSums::Float.shaders(&PhotonStore::Whole.shaders()).expect("both files are embedded");
    let versions = [PhotonStore::Whole.shaders(), PhotonStore::Compact.shaders(), floats];
    let mut covered = BTreeSet::new();
    let mut entry_points = 0;
    for (path, _) in lightloom_shaders::FILES {
        // A second version of a shader has no entry point of its own: it imports the first version's.
        let flats = versions.each_ref().map(|sources| sources.flatten(path).unwrap_or_else(|error| panic!("{error}")));
        let has_entry =
            ["@compute", "@vertex", "@fragment", "@ray_generation"].iter().any(|stage| flats[0].source().contains(stage));
        assert_eq!(has_entry, !path.starts_with("shared/"), "{path}: entry points live outside of shared/");
        if path.starts_with("shared/") {
            continue;
        }
        let module = module(path);
        let stem = path.rsplit('/').next().and_then(|file| file.strip_suffix(".wgsl")).unwrap_or(path);
        for entry in &module.entry_points {
            entry_points += 1;
            let stages = ["", "_vertex", "_fragment", "_any_hit", "_closest_hit", "_miss"];
            let named = stages.iter().any(|stage| entry.name == format!("{stem}{stage}"));
            assert!(named, "{path}: entry point `{}` is named after its file", entry.name);
        }
        covered.insert(*path);
        for (sources, flat) in versions.iter().zip(&flats).skip(1) {
            if *flat != flats[0] {
                reflected_of(path, sources);
            }
        }
        for (shared, _) in lightloom_shaders::FILES {
            if flats.iter().any(|flat| (1..=flat.source().lines().count()).any(|line| flat.locate(line as u32).0 == *shared)) {
                covered.insert(shared);
            }
        }
    }
    println!("{entry_points} entry points");
    for (path, _) in lightloom_shaders::FILES {
        assert!(covered.contains(path), "{path} is used by no entry point, so nothing checks it");
    }
}

/// Whether the first entry point of the file uses the variable.
fn uses(path: &str, variable: &str) -> bool {
    let (module, info) = reflected(path, PhotonStore::Whole);
    let mut globals = module.global_variables.iter();
    let found = globals.find(|(_, global)| global.name.as_deref() == Some(variable));
    found.is_some_and(|(handle, _)| !info.get_entry_point(0)[handle].is_empty())
}

#[test]
fn every_shader_that_traces_has_a_version_with_ray_queries() {
    let known = |wanted: &str| lightloom_shaders::FILES.iter().any(|(path, _)| *path == wanted);
    let mut traced = 0;
    for (path, _) in lightloom_shaders::FILES {
        let Some((folder, file)) = path.rsplit_once('/').filter(|(folder, _)| *folder != "shared" && !folder.contains("/ray_"))
        else {
            continue;
        };
        let second = format!("{folder}/ray_query/{file}");
        assert_eq!(uses(path, "bvh_nodes"), known(&second), "{path} traces rays, left; there is a {second}, right");
        if known(&second) {
            traced += 1;
            assert!(uses(&second, "ray_query_scene"), "{second} traces by ray queries");
            assert!(!uses(&second, "bvh_nodes"), "{second} leaves the hierarchy alone");
        }
    }
    assert!(traced >= 6, "{traced} shaders trace rays");
}

/// Name, offset and size (bytes) of a member.
type Member = (String, usize, usize);

/// The members of a WGSL struct, and its size.
fn wgsl_layout(module: &Module, name: &str) -> Option<(Vec<Member>, usize)> {
    let members = |(_, ty): (_, &naga::Type)| match &ty.inner {
        TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => Some((members.clone(), *span)),
        _ => None,
    };
    let (members, span) = module.types.iter().find_map(members)?;
    let layout = members.iter().map(|member| {
        let size = module.types[member.ty].inner.size(module.to_ctx());
        (member.name.clone().unwrap_or_default(), member.offset as usize, size as usize)
    });
    Some((layout.collect(), span as usize))
}

fn compare<T: ShaderStruct>(module: &Module, wgsl: &str) {
    let (members, span) = wgsl_layout(module, wgsl).unwrap_or_else(|| panic!("no WGSL struct `{wgsl}`"));
    let rust = T::FIELDS.iter().map(|&Field { name, offset, size }| (name.to_owned(), offset, size));
    let real =
        |fields: Vec<Member>| -> Vec<Member> { fields.into_iter().filter(|(name, ..)| !name.starts_with("pad")).collect() };
    assert_eq!(real(rust.collect()), real(members), "{wgsl}: name, offset and size; left Rust, right WGSL");
    assert_eq!(size_of::<T>(), span, "{wgsl}: size");
}

#[test]
fn structs_lie_alike_in_rust_and_wgsl() {
    let scatter = module("passes/photon_scatter.wgsl");
    compare::<gpu_types::BvhTriangle>(&scatter, "BvhTriangle");
    compare::<gpu_types::TriangleAttributes>(&scatter, "TriangleAttributes");
    compare::<gpu_types::TextureSlot>(&scatter, "TextureSlot");
    compare::<gpu_types::Material>(&scatter, "Material");
    compare::<Photon>(&scatter, "Photon");
    compare::<PhotonPath>(&scatter, "PhotonPath");
    compare::<PackedDifferential>(&scatter, "PackedDifferential");
    compare::<DepositCull>(&scatter, "DepositCull");
    let emit = module("passes/photon_emit.wgsl");
    compare::<gpu_types::Light>(&emit, "Light");
    compare::<LightInfo>(&emit, "LightInfo");
    compare::<LivePaths>(&emit, "LivePaths");
    compare::<PhotonState>(&module("passes/photon_scan.wgsl"), "PhotonState");
    let compact = reflected("passes/photon_compact.wgsl", PhotonStore::Compact).0;
    compare::<CompactPhoton>(&compact, "CompactPhoton");
    compare::<PhotonGrid>(&compact, "PhotonGrid");
    compare::<CameraUniform>(&module("passes/direct.wgsl"), "Camera");
    let rays = module("passes/trace_rays.wgsl");
    compare::<Ray>(&rays, "Ray");
    compare::<RayHit>(&rays, "RayHit");
}

fn constant(module: &Module, name: &str) -> u32 {
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, constant)| constant.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no WGSL constant `{name}`"));
    match module.global_expressions[constant.init] {
        Expression::Literal(Literal::U32(value)) => value,
        ref other => panic!("`{name}` is {other:?}"),
    }
}

#[test]
fn constants_are_alike_in_rust_and_wgsl() {
    let [rays, emit, scatter] =
        ["trace_rays", "photon_emit", "photon_scatter"].map(|name| module(&format!("passes/{name}.wgsl")));
    let check = |module, name: &str, value: u32| assert_eq!(constant(module, name), value, "`{name}`: left WGSL, right Rust");
    check(&rays, "TRAVERSAL_STACK_SIZE", bvh::MAX_DEPTH);
    let expect = |name: &str, value: u32| check(&scatter, name, value);
    expect("ALPHA_TESTED", gpu_types::ALPHA_TESTED);
    expect("NO_HIT", RayHit::NONE);
    expect("NO_LIGHT", gpu_types::NONE);
    expect("NO_TEXTURE", gpu_types::NONE);
    expect("MATERIAL_LAMBERT", gpu_types::MATERIAL_LAMBERT);
    expect("PHOTON_CAUSTIC", PhotonFlags::CAUSTIC);
    expect("PHOTON_LIGHT_ONLY", PhotonFlags::LIGHT_ONLY);
    expect("PHOTON_GLOSSY", PhotonFlags::GLOSSY);
    expect("PHOTON_DIFFUSE", PhotonFlags::DIFFUSE);
    let expect = |name: &str, value: u32| check(&emit, name, value);
    expect("LIGHT_POINT", gpu_types::LightKind::Point as u32);
    expect("LIGHT_SPOT", gpu_types::LightKind::Spot as u32);
    expect("LIGHT_DIRECTIONAL", gpu_types::LightKind::Directional as u32);
    expect("LIGHT_ENVIRONMENT", gpu_types::LightKind::Environment as u32);
    expect("MATERIAL_TWO_SIDED", gpu_types::MATERIAL_TWO_SIDED);
    expect("NO_PHOTONS", gpu_types::NONE);
}
