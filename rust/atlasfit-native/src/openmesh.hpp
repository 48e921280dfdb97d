// OpenMesh behind slices and vectors: what src/openmesh.rs calls.
#pragma once

#include "atlasfit-native/src/behavior.hpp"
#include "rust/cxx.h"

#include <cstdint>
#include <memory>

namespace atlasfit_native {

/// A mesh that is being subdivided.
class Subdivider {
 public:
  virtual ~Subdivider() = default;
  /// One step.
  virtual void step() = 0;
  /// The mesh as it is now.
  virtual void copy(rust::Vec<double> &xyz, rust::Vec<std::uint32_t> &triangles) const = 0;
};

/// Begins; null where the triangles are no surface of a halfedge mesh.
std::unique_ptr<Subdivider> subdivider(rust::Slice<const double> xyz,
                                       rust::Slice<const std::uint32_t> triangles, bool sqrt3);

}  // namespace atlasfit_native
