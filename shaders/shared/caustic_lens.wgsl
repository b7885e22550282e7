// How a lens changes the breadth of a photon's beam [WD08, section 4.2], in Gauss's approximation: of rays near the axis.
//
// [WD08]: Wyman and Dachsbacher, "Reducing noise in image-space caustics with variable-sized splatting", 2008.

struct Lens {
    // Powers (m⁻¹) of its faces, the one that light enters by first: (n − 1) times the curvature, positive if it bulges.
    front: f32,
    back: f32,
    // Way of the light inside (m); 0: a thin lens.
    thickness: f32,
    ior: f32,
}

// Diameter of the beam over the one it would have without the lens, with its sign: negative where the beam has crossed itself.
// `near`: 1 / distance (m⁻¹) from the light to the lens, 0 for parallel light; `beyond`: distance (m) from the lens to the receiver.
//
// Of a thin lens it is d_front / (d_front + d_bg) · (d_image − d_bg) / d_image [WD08, Eq. 7], with 1/d_image = 1/f − 1/d_front and
// 1/f = front + back, written so that nothing is divided by what may be 0. In a thick lens a ray is refracted, moves on, and is refracted.
fn lens_magnification(lens: Lens, near: f32, beyond: f32) -> f32 {
    // Height and slope of a ray, in units of its height at the first face.
    let inside = near - lens.front;
    let height = 1.0 + lens.thickness / lens.ior * inside;
    let slope = inside - height * lens.back;
    return (height + beyond * slope) / (1.0 + near * (lens.thickness + beyond));
}
