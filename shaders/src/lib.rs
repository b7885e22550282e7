//! The WGSL of Lightloom, embedded, so that each crate can be published and used without its sources beside it.
//!
//! ```text
//! shared/       functions and structs, no entry points
//! passes/       one entry point per file, named like the file: the passes of `lightloom-passes`
//! strategies/   likewise, of `lightloom-strategies`
//! ```
//!
//! Files import one another by lines `#import "shared/math.wgsl"`, textually and once; `lightloom_graph::WgslSources`
//! resolves them.
//!
//! ```
//! let (path, source) = lightloom_shaders::FILES[0];
//! assert!(path.ends_with(".wgsl") && !source.is_empty());
//! ```

/// Pairs of path and source, for paths relative to the folder `shaders`.
macro_rules! embed {
    ($($path:literal),* $(,)?) => { &[$(($path, include_str!(concat!("../", $path)))),*] };
}

/// Every shader source: its path below the folder `shaders`, with forward slashes, and its text.
pub const FILES: &[(&str, &str)] = embed![
    "passes/accumulate.wgsl",
    "passes/ambient_occlusion.wgsl",
    "passes/compose.wgsl",
    "passes/direct.wgsl",
    "passes/filter_atrous.wgsl",
    "passes/filter_demodulate.wgsl",
    "passes/filter_guide.wgsl",
    "passes/filter_motion.wgsl",
    "passes/filter_positions.wgsl",
    "passes/filter_remodulate.wgsl",
    "passes/filter_temporal.wgsl",
    "passes/gbuffer.wgsl",
    "passes/path_trace.wgsl",
    "passes/photon_compact.wgsl",
    "passes/photon_emit.wgsl",
    "passes/photon_scan.wgsl",
    "passes/photon_scatter.wgsl",
    "passes/photon_splat.wgsl",
    "passes/prefix_sum_apply.wgsl",
    "passes/prefix_sum_blocks.wgsl",
    "passes/prefix_sum_scan.wgsl",
    "passes/ray_pipeline/trace_rays.wgsl",
    "passes/ray_query/ambient_occlusion.wgsl",
    "passes/ray_query/direct.wgsl",
    "passes/ray_query/path_trace.wgsl",
    "passes/ray_query/photon_splat.wgsl",
    "passes/ray_query/rsm_map.wgsl",
    "passes/ray_query/specular_pixels.wgsl",
    "passes/ray_query/trace_rays.wgsl",
    "passes/ray_query/visible_points.wgsl",
    "passes/reflect_irradiance.wgsl",
    "passes/rsm_emit.wgsl",
    "passes/rsm_map.wgsl",
    "passes/rsm_pyramid.wgsl",
    "passes/rsm_pyramid_top.wgsl",
    "passes/rsm_view.wgsl",
    "passes/specular_pixels.wgsl",
    "passes/subsample.wgsl",
    "passes/trace_rays.wgsl",
    "passes/upsample.wgsl",
    "passes/visibility.wgsl",
    "passes/visible_points.wgsl",
    "passes/visible_points_resolve.wgsl",
    "shared/blinn_phong.wgsl",
    "shared/bound_points.wgsl",
    "shared/brdf.wgsl",
    "shared/bvh.wgsl",
    "shared/camera.wgsl",
    "shared/caustic_lens.wgsl",
    "shared/caustic_places.wgsl",
    "shared/caustic_receivers.wgsl",
    "shared/caustic_splat.wgsl",
    "shared/caustic_sums.wgsl",
    "shared/caustic_view.wgsl",
    "shared/deposit_cull.wgsl",
    "shared/dielectric.wgsl",
    "shared/dispatch.wgsl",
    "shared/emission.wgsl",
    "shared/environment.wgsl",
    "shared/estimate.wgsl",
    "shared/filter.wgsl",
    "shared/fixed_point.wgsl",
    "shared/flux_ledger.wgsl",
    "shared/gather_run.wgsl",
    "shared/gather_sampling.wgsl",
    "shared/gbuffer.wgsl",
    "shared/hash_grid.wgsl",
    "shared/hit.wgsl",
    "shared/hit_seen.wgsl",
    "shared/light_found.wgsl",
    "shared/light_groups.wgsl",
    "shared/light_reservoir.wgsl",
    "shared/light_views.wgsl",
    "shared/lights.wgsl",
    "shared/math.wgsl",
    "shared/path.wgsl",
    "shared/photon.wgsl",
    "shared/photon_block.wgsl",
    "shared/photon_path.wgsl",
    "shared/photon_start.wgsl",
    "shared/photon_store.wgsl",
    "shared/photon_store_compact.wgsl",
    "shared/pixel_area.wgsl",
    "shared/point_bounds.wgsl",
    "shared/pulled_triangle.wgsl",
    "shared/radiance_sum.wgsl",
    "shared/ray_differential.wgsl",
    "shared/ray_query.wgsl",
    "shared/rays.wgsl",
    "shared/reflectance.wgsl",
    "shared/rng.wgsl",
    "shared/scene.wgsl",
    "shared/scene_bindings.wgsl",
    "shared/scene_traits.wgsl",
    "shared/screen_space_bilateral.wgsl",
    "shared/screen_space_guided.wgsl",
    "shared/shading_normal.wgsl",
    "shared/sort8.wgsl",
    "shared/sorted_grid.wgsl",
    "shared/sorted_grid_gather.wgsl",
    "shared/splat_block_search.wgsl",
    "shared/splat_bound.wgsl",
    "shared/splat_compute_ellipsoid.wgsl",
    "shared/splat_compute_sphere.wgsl",
    "shared/splat_ellipsoid.wgsl",
    "shared/splat_ellipsoids.wgsl",
    "shared/splat_hull.wgsl",
    "shared/splat_kernel.wgsl",
    "shared/splat_spheres.wgsl",
    "shared/splat_sums.wgsl",
    "shared/splat_sums_float.wgsl",
    "shared/splat_target.wgsl",
    "shared/splat_walk.wgsl",
    "shared/surface.wgsl",
    "shared/texture.wgsl",
    "shared/tiles.wgsl",
    "shared/view_points.wgsl",
    "shared/virtual_light.wgsl",
    "shared/warp.wgsl",
    "shared/workgroup_scan.wgsl",
    "strategies/auto_measure.wgsl",
    "strategies/caustic_map_arguments.wgsl",
    "strategies/caustic_map_blend.wgsl",
    "strategies/caustic_map_four.wgsl",
    "strategies/caustic_map_lens.wgsl",
    "strategies/caustic_map_place.wgsl",
    "strategies/caustic_map_project.wgsl",
    "strategies/caustic_map_resolve.wgsl",
    "strategies/caustic_map_splat.wgsl",
    "strategies/caustic_map_view.wgsl",
    "strategies/composed_indirect.wgsl",
    "strategies/density_tiles.wgsl",
    "strategies/exact_gather.wgsl",
    "strategies/exact_resolve.wgsl",
    "strategies/hash_grid_gather.wgsl",
    "strategies/hash_grid_insert.wgsl",
    "strategies/hash_grid_pack.wgsl",
    "strategies/instant_radiosity_gather.wgsl",
    "strategies/instant_radiosity_lights.wgsl",
    "strategies/instant_radiosity_removed.wgsl",
    "strategies/instant_radiosity_resample.wgsl",
    "strategies/instant_radiosity_shade.wgsl",
    "strategies/instant_radiosity_sort.wgsl",
    "strategies/k_nearest_pack.wgsl",
    "strategies/k_nearest_search.wgsl",
    "strategies/list_stats.wgsl",
    "strategies/ray_query/caustic_map_lens.wgsl",
    "strategies/ray_query/instant_radiosity_gather.wgsl",
    "strategies/ray_query/instant_radiosity_lights.wgsl",
    "strategies/ray_query/instant_radiosity_shade.wgsl",
    "strategies/scatter_lists.wgsl",
    "strategies/screen_space_bilateral.wgsl",
    "strategies/screen_space_bilateral_shares.wgsl",
    "strategies/screen_space_deposit.wgsl",
    "strategies/screen_space_guided.wgsl",
    "strategies/screen_space_guided_shares.wgsl",
    "strategies/screen_space_near.wgsl",
    "strategies/screen_space_reflect.wgsl",
    "strategies/screen_space_resolve.wgsl",
    "strategies/sort_lists.wgsl",
    "strategies/sorted_grid_count.wgsl",
    "strategies/sorted_grid_gather.wgsl",
    "strategies/sorted_grid_gather_blocks.wgsl",
    "strategies/sorted_grid_pack.wgsl",
    "strategies/splat_25d_ellipsoid.wgsl",
    "strategies/splat_25d_sphere.wgsl",
    "strategies/splat_3d_ellipsoid.wgsl",
    "strategies/splat_3d_sphere.wgsl",
    "strategies/splat_arguments.wgsl",
    "strategies/splat_block_arguments.wgsl",
    "strategies/splat_blocks.wgsl",
    "strategies/splat_downscale.wgsl",
    "strategies/splat_ellipsoid/splat_blocks.wgsl",
    "strategies/splat_ellipsoid/splat_small.wgsl",
    "strategies/splat_resolve_ellipsoids.wgsl",
    "strategies/splat_resolve_spheres.wgsl",
    "strategies/splat_small.wgsl",
    "strategies/splat_sums_resolve.wgsl",
    "strategies/surface_layers.wgsl",
    "strategies/tiled_bounds.wgsl",
    "strategies/tiled_gather.wgsl",
    "strategies/tiled_insert.wgsl",
    "strategies/view_grid_bounds.wgsl",
    "strategies/view_grid_count.wgsl",
    "strategies/view_grid_gather.wgsl",
    "strategies/view_grid_insert.wgsl",
    "strategies/view_grid_scatter.wgsl",
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    fn walk(root: &Path, folder: &Path, found: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).expect("the folder can be read") {
            let path = entry.expect("the entry can be read").path();
            if path.is_dir() {
                walk(root, &path, found);
            } else if path.extension().is_some_and(|extension| extension == "wgsl") {
                let relative = path.strip_prefix(root).expect("the walk stays inside");
                let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
                found.insert(parts.join("/"));
            }
        }
    }

    #[test]
    fn every_file_is_listed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found = BTreeSet::new();
        walk(root, root, &mut found);
        let listed: BTreeSet<String> = super::FILES.iter().map(|(path, _)| (*path).to_owned()).collect();
        assert_eq!(listed.len(), super::FILES.len(), "a file is listed twice");
        assert_eq!(found, listed, "left: on disk, right: listed in FILES");
    }

    #[test]
    fn every_import_is_listed() {
        for (path, source) in super::FILES {
            // `"a.wgsl"` or `"a.wgsl" as "b.wgsl"`.
            let imports = source.lines().filter_map(|line| line.strip_prefix("#import "));
            for target in imports.flat_map(|paths| paths.split(" as ")) {
                let target = target.trim().trim_matches('"');
                let listed = super::FILES.iter().any(|(other, _)| *other == target);
                assert!(listed, "{path} imports {target}, which is not listed");
            }
        }
    }
}
