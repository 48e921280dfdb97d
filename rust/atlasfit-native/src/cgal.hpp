// CGAL behind slices and vectors: what src/cgal.rs calls. Everything is checked there first, as CGAL takes
// NaN without a word. A C++ exception, of CGAL's too, becomes an error.
#pragma once

#include "atlasfit-native/src/behavior.hpp"
#include "rust/cxx.h"

#include <cstdint>

namespace atlasfit_native {

struct Stop;
using Numbers = rust::Slice<const double>;
using Indices = rust::Slice<const std::uint32_t>;

/// A closed surface around triangles, `offset` away; a ball of radius `alpha` rolls over it.
void alpha_wrap(Numbers xyz, Indices triangles, double alpha, double offset, const Stop &stop,
                rust::Vec<double> &shell_xyz, rust::Vec<std::uint32_t> &shell_triangles);
/// Pairs of triangles that meet elsewhere than in corners and edges that they share.
void self_intersections(Numbers xyz, Indices triangles, const Stop &stop, rust::Vec<std::uint32_t> &pairs);
/// Distances of points from the nearest triangle, exact but for the last rounding.
void exact_distances(Numbers xyz, Indices triangles, Numbers points, const Stop &stop,
                     rust::Vec<double> &distances);

/// Triangles with sides of about `length`, on the surface; false where they are no surface of a halfedge
/// mesh.
bool remesh(Numbers xyz, Indices triangles, double length, std::uint32_t iterations, const Stop &stop,
            rust::Vec<double> &new_xyz, rust::Vec<std::uint32_t> &new_triangles);

}  // namespace atlasfit_native
