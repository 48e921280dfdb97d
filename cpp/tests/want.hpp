// Claims of the C++ tests: what is wrong is told and counted.
#ifndef TESTS_WANT_HPP
#define TESTS_WANT_HPP

#include <atlasfit.hpp>

#include <cstdio>

static int wrong = 0;

static inline void want(bool good, const char *what) {
  if (!good) {
    std::fprintf(stderr, "wrong: %s\n", what);
    wrong++;
  }
}

/// The status that a call fails with.
template <class F>
atlasfit_status status_of(F &&f) {
  try {
    f();
    return ATLASFIT_OK;
  } catch (const atlasfit::Error &e) {
    want(e.what()[0] != '\0', "an error has a text");
    return e.status();
  }
}

#endif
