//! Ray-tracing pipelines again, under Vulkan's validation layer: what is made below wgpu's interface is checked by nothing else.

#[path = "../../../graph/tests/suite/layer.rs"]
mod layer;

use layer::{complaint, layer, under};
use lightloom_passes::RayBackend;
use lightloom_tests::Lab;

/// naga 30 gives variables of functions and workgroups the types that it laid out for buffers: every kernel earns this one, those of
/// compute passes too.
const NAGAS: &str = "VUID-StandaloneSpirv-None-10684";

/// Alpha, poses for which the structure is built again, and photons over several bounces.
const TESTS: [&str; 4] = [
    "ray_backends::alpha_lets_the_same_rays_pass",
    "animation::hits_are_those_of_the_scene_that_stands_so",
    "ray_backends::photons_are_the_same",
    "--exact",
];

/// Without it the layer looks at copies and builds, and at no buffer that a shader writes.
const SHADER_ACCESSES: (&str, &str) = ("VK_LAYER_SYNCVAL_SHADER_ACCESSES_HEURISTIC", "1");

#[test]
fn the_layer_has_nothing_to_say_about_pipelines() {
    if Lab::open_with(RayBackend::Pipeline).is_none() {
        return;
    }
    let Some(library) = layer() else { return };
    let Some(text) = under(&library, &TESTS, &[SHADER_ACCESSES]) else { return };
    assert_eq!(complaint(&text, &[NAGAS]), None, "the first of the layer's complaints");
}
