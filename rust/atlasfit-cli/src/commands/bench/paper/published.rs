//! Figures that the paper (Gadelha et al., *Deep Manifold Prior*) prints: Chamfer distances.

/// Table 1 of the paper: Surface (S8R), Contour (C8R), Implicit, RIMLS, SPSR.
pub const TABLE1: [(&str, [f64; 5]); 8] = [
    ("bunny", [2.71e-4, 6.64e-4, 5.52e-4, 1.43e-3, 3.96e-4]),
    ("dragon", [4.18e-4, 6.12e-4, 1.20e-3, 1.65e-3, 1.46e-2]),
    ("car", [2.73e-4, 4.57e-4, 6.83e-2, 1.50e-3, 2.10e-3]),
    ("cup", [2.59e-4, 5.80e-4, 2.64e-2, 1.74e-3, 1.00e-2]),
    ("mobius", [3.51e-4, 4.95e-4, 3.26e-3, 1.96e-3, 1.89e-2]),
    ("chair", [3.95e-4, 4.22e-4, 7.32e-3, 2.09e-3, 2.58e-2]),
    ("spiral", [1.05e-3, 7.31e-4, 1.64e-2, 2.98e-3, 7.90e-2]),
    ("ring", [5.69e-4, 5.54e-4, 4.81e-2, 2.46e-3, 3.76e-2]),
];
/// Table 2 of the paper: averages over the shapes.
pub const TABLE2: [(&str, f64); 8] = [
    ("S1R", 4.48e-3),
    ("S8R", 4.48e-4),
    ("S1", 2.75e-3),
    ("S8", 1.35e-3),
    ("C1R", 1.08e-3),
    ("C8R", 5.77e-4),
    ("C1", 1.00e-3),
    ("C8", 5.82e-4),
];
/// The supplement's average of the convolutional prior.
pub const CONV: f64 = 4.58e-4;
