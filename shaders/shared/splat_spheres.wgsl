// Spherical splats: [MML13]'s density estimate, one photon at a time. Each adds to the pixels whose visible points lie in its sphere what
// every gathering strategy adds there.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
#import "shared/splat_target.wgsl"

@group(0) @binding(4) var position: texture_2d<f32>;
@group(0) @binding(5) var surface: texture_2d<u32>;

struct Varyings {
    @builtin(position) clip: vec4f,
    // World (m), and radius (m).
    @location(0) @interpolate(flat) sphere: vec4f,
    // Of the photon: flux, direction, normal, bounce and flags.
    @location(1) @interpolate(flat) light: vec4u,
}

// Outgoing radiance (W·m⁻²·sr⁻¹) times `params.scale`.
struct Targets {
    @location(0) indirect: vec4f,
    @location(1) caustic: vec4f,
}

fn sphere_varyings(clip: vec4f, photon: Photon, radius: f32) -> Varyings {
    let light = vec4u(photon.flux, photon.direction, photon.normal, photon.bounce_flags);
    return Varyings(clip, vec4f(photon.position, radius), light);
}

fn splat_sphere(in: Varyings) -> Targets {
    let pixel = vec2u(in.clip.xy);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), camera_position(params.camera));
    let apart = in.sphere.xyz - point.position;
    if !point.gatherable || dot(apart, apart) >= in.sphere.w * in.sphere.w {
        discard;
    }
    let photon = Photon(in.sphere.xyz, in.light.x, in.light.y, in.light.z, 0u, in.light.w);
    let radiance = photon_contribution(point, photon, in.sphere.w) * params.scale;
    let caustic = (photon.bounce_flags & PHOTON_CAUSTIC) != 0u;
    return Targets(vec4f(radiance, 0.0), vec4f(select(vec3f(0.0), radiance, caustic), 0.0));
}
