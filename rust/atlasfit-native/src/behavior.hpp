// How C++ exceptions become errors of Rust.
#pragma once

#include <exception>

namespace rust::behavior {

/// cxx's own catches std::exception only.
template <class Try, class Fail>
static void trycatch(Try &&work, Fail &&fail) noexcept {
  try {
    work();
  } catch (const std::exception &error) {
    fail(error.what());
  } catch (...) {
    fail("an exception that is no std::exception");
  }
}

}  // namespace rust::behavior
