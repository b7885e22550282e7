// `strategies/splat_blocks.wgsl`, its splats ellipsoids.
#import "shared/splat_compute_ellipsoid.wgsl" as "shared/splat_compute_sphere.wgsl"
#import "strategies/splat_blocks.wgsl"
