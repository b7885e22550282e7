// Hulls of 20 triangles, counter-clockwise from outside: an icosahedron about the unit sphere, a hexagonal prism about the unit cylinder. Both
// circumscribed: none of a photon's flux falls outside.

// Circumscribed to inscribed radius of the icosahedron.
const ICOSAHEDRON_RADIUS: f32 = 1.2584086;
// And of the hexagon.
const HEXAGON_RADIUS: f32 = 1.1547005;

// Two rings of five between two poles, turned by half a step:
//
//      pole   pole             0 to 4   pole, u_i, u_i+1
//      / \    / \              5 to 9   u_i, l_i, u_i+1
//    u_i --- u_i+1             10 to 14 l_i, l_i+1, u_i+1
//      \    / \                15 to 19 pole, l_i+1, l_i
//       l_i --- l_i+1
fn icosahedron_corner(vertex: u32) -> vec3f {
    let triangle = vertex / 3u;
    let corner = vertex % 3u;
    let band = triangle / 5u;
    let polar = corner == 0u && (band == 0u || band == 3u);
    if polar {
        return vec3f(0.0, select(-ICOSAHEDRON_RADIUS, ICOSAHEDRON_RADIUS, band == 0u), 0.0);
    }
    // Steps ahead of i, and whether on the lower ring.
    var step: u32;
    var lower = band >= 2u;
    switch band {
        case 0u: {
            step = corner - 1u;
        }
        case 1u: {
            step = select(0u, 1u, corner == 2u);
            lower = corner == 1u;
        }
        case 2u: {
            step = select(1u, 0u, corner == 0u);
            lower = corner != 2u;
        }
        default: {
            step = 2u - corner;
        }
    }
    let angle = PI * 0.4 * (f32(triangle % 5u + step) + select(0.0, 0.5, lower));
    let height = select(0.4472136, -0.4472136, lower);
    return ICOSAHEDRON_RADIUS * vec3f(0.8944272 * cos(angle), height, -0.8944272 * sin(angle));
}

// Around the third axis, from −1 to 1 along it: triangles 0 to 11 around, 12 to 15 above, 16 to 19 below.
fn prism_corner(vertex: u32) -> vec3f {
    let triangle = vertex / 3u;
    let corner = vertex % 3u;
    var step: u32;
    var up: bool;
    if triangle < 12u {
        // (i, −), (i+1, −), (i+1, +) and (i, −), (i+1, +), (i, +).
        let second = (triangle & 1u) != 0u;
        step = triangle / 2u + select(select(0u, 1u, corner > 0u), select(0u, 1u, corner == 1u), second);
        up = select(corner == 2u, corner > 0u, second);
    } else {
        up = triangle < 16u;
        let fan = (triangle - 12u) % 4u;
        let ahead = select(3u - corner, corner, up);
        step = select(fan + ahead, 0u, corner == 0u);
    }
    let angle = PI / 3.0 * f32(step);
    return vec3f(HEXAGON_RADIUS * cos(angle), HEXAGON_RADIUS * sin(angle), select(-1.0, 1.0, up));
}
