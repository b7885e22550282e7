// `strategies/instant_radiosity_shade.wgsl`, its rays traced by ray queries.
enable wgpu_ray_query;
#import "shared/ray_query.wgsl" as "shared/bvh.wgsl"
#import "strategies/instant_radiosity_shade.wgsl"
