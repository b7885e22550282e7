// Light from infinitely far away, out of every direction: a latitude-longitude map of radiance, constant within each of
// its texels. The row of the texture runs from +y (top) to −y; its middle column shows −z, columns further right +x.
//
// Besides the map the texture holds what sampling needs: alpha of column x is the probability that a draw within the row
// falls on columns 0..=x, alpha of the extra last column the probability that it falls on rows 0..=y. The first texel of that
// column has the cosine and sine of the map's rotation about +y in red and green.
#import "shared/math.wgsl"
#import "shared/scene_bindings.wgsl"
#import "shared/scene_traits.wgsl"

struct EnvironmentSample {
    // Unit, towards the environment.
    direction: vec3f,
    // W·m⁻²·sr⁻¹.
    radiance: vec3f,
    // Density of the direction (sr⁻¹).
    pdf: f32,
}

// Columns and rows of the map.
fn environment_size() -> vec2u {
    return textureDimensions(environment) - vec2u(1u, 0u);
}

// The texel in `direction` (unit).
fn environment_texel(direction: vec3f) -> vec2u {
    let size = environment_size();
    let turn = textureLoad(environment, vec2u(size.x, 0u), 0).xy;
    let x = turn.x * direction.x - turn.y * direction.z;
    let z = turn.y * direction.x + turn.x * direction.z;
    let at = vec2f(0.5 + atan2(x, -z) / (2.0 * PI), atan2(sqrt(x * x + z * z), direction.y) / PI);
    return min(vec2u(max(at, vec2f(0.0)) * vec2f(size)), size - 1u);
}

// Radiance that comes from `direction` (unit, towards the environment).
fn environment_radiance(direction: vec3f) -> vec3f {
    return textureLoad(environment, environment_texel(direction), 0).rgb;
}

// Solid angle of a texel in row `row` (sr): (2π/columns)(cos θ₀ − cos θ₁), written without the cancellation at the poles.
fn environment_solid_angle(row: u32) -> f32 {
    let size = environment_size();
    let half_row = 0.5 * PI / f32(size.y);
    return 4.0 * PI / f32(size.x) * sin((2.0 * f32(row) + 1.0) * half_row) * sin(half_row);
}

// Probability that rows 0..end are drawn, or columns 0..end of `row`: which column of the texture says.
fn environment_before(column: u32, end: u32, row: u32, of_rows: bool) -> f32 {
    if end == 0u {
        return 0.0;
    }
    return textureLoad(environment, select(vec2u(end - 1u, row), vec2u(column, end - 1u), of_rows), 0).a;
}

// Probability of a texel: the steps of both distributions.
fn environment_probability(texel: vec2u) -> f32 {
    let last = environment_size().x;
    let row = environment_before(last, texel.y + 1u, 0u, true) - environment_before(last, texel.y, 0u, true);
    let column = environment_before(last, texel.x + 1u, texel.y, false) - environment_before(last, texel.x, texel.y, false);
    return row * column;
}

// Density (sr⁻¹) with which `sample_environment` draws `direction`.
fn environment_pdf(direction: vec3f) -> f32 {
    let texel = environment_texel(direction);
    return environment_probability(texel) / environment_solid_angle(texel.y);
}

// The step of a cumulative distribution of `count` steps that `u` in [0, 1) falls on, and where on it, in [0, 1).
fn environment_step(u: f32, count: u32, row: u32, of_rows: bool) -> vec2f {
    let last = environment_size().x;
    var low = 0u;
    var high = count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if u < environment_before(last, middle + 1u, row, of_rows) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let before = environment_before(last, low, row, of_rows);
    let step = environment_before(last, low + 1u, row, of_rows) - before;
    return vec2f(f32(low), clamp((u - before) / max(step, 1.0e-30), 0.0, 0.99999994));
}

// A direction drawn by luminance and solid angle, uniform by solid angle within a texel.
fn sample_environment(u: vec2f) -> EnvironmentSample {
    let size = environment_size();
    let y = environment_step(u.y, size.y, 0u, true);
    let row = u32(y.x);
    let x = environment_step(u.x, size.x, row, false);
    let texel = vec2u(u32(x.x), row);
    // sin²(θ/2) is uniform by solid angle; unlike cos θ it keeps its digits at the upper pole.
    let half_row = 0.5 * PI / f32(size.y);
    let top = sin(f32(row) * half_row);
    let bottom = sin(f32(row + 1u) * half_row);
    let s = mix(top * top, bottom * bottom, y.y);
    let sin_theta = 2.0 * sqrt(max(s * (1.0 - s), 0.0));
    let phi = ((x.x + x.y) / f32(size.x) - 0.5) * 2.0 * PI;
    let local = vec2f(sin_theta * sin(phi), -sin_theta * cos(phi));
    let turn = textureLoad(environment, vec2u(size.x, 0u), 0).xy;
    let direction = vec3f(turn.x * local.x + turn.y * local.y, 1.0 - 2.0 * s, turn.x * local.y - turn.y * local.x);
    let pdf = environment_probability(texel) / environment_solid_angle(row);
    return EnvironmentSample(direction, textureLoad(environment, texel, 0).rgb, pdf);
}
