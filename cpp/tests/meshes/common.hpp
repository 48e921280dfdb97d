// What the tests of the mesh headers share: claims, made-up meshes as polygons, callbacks that throw.
#ifndef TESTS_MESHES_COMMON_HPP
#define TESTS_MESHES_COMMON_HPP

#include "../want.hpp"

#include <cmath>
#include <cstdio>

/// Polygons over shared vertices.
struct Faces {
  std::vector<std::array<double, 3>> at;
  std::vector<std::vector<std::size_t>> faces;
};

/// Side faces and bottom of a box whose top is an L, a concave hexagon: as many polygons as a box has sides.
inline Faces ell() {
  Faces m;
  const double flat[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  for (const double z : {0.0, 1.0})
    for (const auto &p : flat) m.at.push_back({p[0], p[1], z});
  m.faces = {{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
  for (std::size_t i = 0; i < 6; i++) m.faces.push_back({i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6});
  return m;
}

/// A torus of quads; each second row of them is cut into triangles, so that both kinds are there.
inline Faces torus(std::size_t rings, std::size_t sides) {
  Faces m;
  for (std::size_t i = 0; i < rings; i++)
    for (std::size_t j = 0; j < sides; j++) {
      const double a = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(rings),
                   b = 6.283185307179586 * static_cast<double>(j) / static_cast<double>(sides),
                   r = 2.0 + std::cos(b);
      m.at.push_back({r * std::cos(a), r * std::sin(a), std::sin(b)});
    }
  for (std::size_t i = 0; i < rings; i++)
    for (std::size_t j = 0; j < sides; j++) {
      const std::size_t k = (i + 1) % rings, l = (j + 1) % sides;
      const std::size_t a = i * sides + j, b = k * sides + j, c = k * sides + l, d = i * sides + l;
      if (i % 2 == 0) {
        m.faces.push_back({a, b, c, d});
      } else {
        m.faces.push_back({a, b, c});
        m.faces.push_back({a, c, d});
      }
    }
  return m;
}

/// A zigzag polygon of eight corners, and a spiral stair of one polygon: it winds one and a half times about
/// its axis, so that it cannot lie in the plane without covering itself.
inline Faces bent() {
  Faces m;
  std::vector<std::size_t> face;
  for (std::size_t i = 0; i < 8; i++) {
    const double a = 6.283185307179586 * static_cast<double>(i) / 8.0;
    face.push_back(m.at.size());
    m.at.push_back({std::cos(a) - 3.0, std::sin(a), i % 2 == 0 ? 1.0 : -1.0});
  }
  m.faces.push_back(face);
  face.clear();
  for (std::size_t i = 0; i < 60; i++) {
    const bool outer = i < 30;
    const double n = static_cast<double>(outer ? i : 59 - i), a = 9.42477796076938 * n / 29.0,
                 r = outer ? 1.0 : 0.4;
    face.push_back(m.at.size());
    m.at.push_back({r * std::cos(a), r * std::sin(a), 0.02 * n});
  }
  m.faces.push_back(face);
  return m;
}

/// Noise between -1 and 1, by number.
inline double noise(std::size_t n) {
  const std::uint32_t mixed = (static_cast<std::uint32_t>(n) * 2654435761u) ^ 0x9e3779b9u;
  return static_cast<double>((mixed * 2246822519u) >> 8) / 8388608.0 - 1.0;
}

/// A torus of noisy vertices.
inline Faces noisy_torus() {
  Faces m = torus(60, 30);
  for (std::size_t n = 0; n < m.at.size(); n++) {
    auto &p = m.at[n];
    const double ring = std::hypot(p[0], p[1]), r = 1.0 + 0.02 * noise(n), out = 2.0 + r * (ring - 2.0);
    p = {p[0] / ring * out, p[1] / ring * out, r * p[2]};
  }
  return m;
}

inline double off_torus(double x, double y, double z) {
  return std::abs(std::hypot(std::hypot(x, y) - 2.0, z) - 1.0);
}

/// A sphere of radius 1 with noise, as points.
inline std::vector<std::array<double, 3>> noisy_sphere(std::size_t count) {
  std::vector<std::array<double, 3>> all;
  for (std::size_t i = 0; i < count; i++) {
    const double n = static_cast<double>(i), z = 2.0 * (n + 0.5) / static_cast<double>(count) - 1.0;
    const double a = 2.39996323 * n, s = std::sqrt(1.0 - z * z), r = 1.0 + 0.02 * noise(i);
    all.push_back({r * s * std::cos(a), r * s * std::sin(a), r * z});
  }
  return all;
}

inline double off_sphere(double x, double y, double z) {
  return std::abs(std::sqrt(x * x + y * y + z * z) - 1.0);
}

/// What a callback throws.
struct Stop {};

inline atlasfit::Run stopping() {
  atlasfit::Run run;
  run.progress = [](std::uint32_t, double) -> bool { throw Stop(); };
  return run;
}

template <class F>
bool stops(F &&f) {
  try {
    f();
  } catch (const Stop &) {
    return true;
  }
  return false;
}

inline int verdict() {
  std::printf("%d wrong\n", wrong);
  return wrong != 0;
}

#endif
