//! Functions that every model has, written in the language itself. A model's own function of the same name takes the
//! place of one of these.
//!
//! A line of sight is a frame: from `.o` along `.z`. Numbers in brackets are equations of Sultan & Wager.

/// Head and body of each function.
pub const PRELUDE: &[(&str, &str)] = &[
    // (13), (14): the distance along l to the foot of the common normal with r. 1 − (z_L·z_R)² is |z_L × z_R|², which does
    // not lose its digits where the lines are nearly parallel; where they are parallel to 1e-10 rad it is refused.
    (
        "sight_length(l, r)",
        "dot(r.z * dot(r.z, l.z) - l.z, l.o - r.o) / at_least(dot(cross(l.z, r.z), cross(l.z, r.z)), 1e-20)",
    ),
    // (15): the point on the left line
    ("triangulate(l, r)", "l.o + sight_length(l, r) * l.z"),
    // half way between the feet of the common normal
    ("midpoint(l, r)", "(triangulate(l, r) + triangulate(r, l)) / 2"),
    // (20): the kinematic consistency index
    ("kci(l, r)", "-dot(l.o - r.o, cross(r.z, l.z))"),
    // the signed length of the common normal
    ("skew_distance(l, r)", "kci(l, r) / sqrt(at_least(dot(cross(l.z, r.z), cross(l.z, r.z)), 1e-20))"),
    ("distance(p, q)", "norm(p - q)"),
    // from a point to a line
    ("line_distance(p, l)", "norm(cross(p - l.o, l.z))"),
    // from a point to the plane through f.o normal to f.z, positive on the side of f.z
    ("plane_distance(p, f)", "dot(p - f.o, f.z)"),
    // turns about fixed x, then y, then z: Rz(yaw) Ry(pitch) Rx(roll)
    ("rpy(roll, pitch, yaw)", "rotation_z(yaw) * rotation_y(pitch) * rotation_x(roll)"),
    ("axis_angle(axis, angle)", "rotation_vector(angle * unit(axis))"),
    ("translation(v)", "frame(v, rotation_z(0))"),
    ("square(x)", "x * x"),
];
