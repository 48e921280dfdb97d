// A mesh with normals and UVs as a binary glTF 2.0 file: no more than the examples need.
#ifndef EXAMPLE_GLB_HPP
#define EXAMPLE_GLB_HPP

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

inline void write_glb(const std::string &path, const std::vector<double> &xyz,
                      const std::vector<float> &normals, const std::vector<std::uint32_t> &triangles,
                      const std::vector<float> &corner_uv, const double origin[3]) {
  std::map<std::tuple<std::uint32_t, float, float>, std::uint32_t> numbers;
  std::vector<std::uint32_t> indices;
  std::vector<float> position, normal, uv;
  std::array<float, 3> low, high;
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (std::size_t c = 0; c < triangles.size(); c++) {
    const std::uint32_t v = triangles[c];
    const auto key = std::make_tuple(v, corner_uv[2 * c], corner_uv[2 * c + 1]);
    const auto [entry, made] = numbers.emplace(key, static_cast<std::uint32_t>(numbers.size()));
    if (made) {
      for (std::size_t k = 0; k < 3; k++) {
        const float x = static_cast<float>(xyz[3 * v + k] - origin[k]);
        low[k] = std::min(low[k], x);
        high[k] = std::max(high[k], x);
        position.push_back(x);
        normal.push_back(normals[3 * v + k]);
      }
      uv.push_back(corner_uv[2 * c]);
      uv.push_back(1.0f - corner_uv[2 * c + 1]);  // glTF's v points down.
    }
    indices.push_back(entry->second);
  }
  const std::size_t n = numbers.size();
  const auto bytes = [](const auto &v) { return v.size() * sizeof v[0]; };
  const std::size_t at[4] = {0, bytes(indices), bytes(indices) + bytes(position),
                             bytes(indices) + bytes(position) + bytes(normal)};
  const std::size_t total = at[3] + bytes(uv);
  const auto view = [](std::size_t offset, std::size_t length) {
    return "{\"buffer\":0,\"byteOffset\":" + std::to_string(offset) +
           ",\"byteLength\":" + std::to_string(length) + "}";
  };
  const auto three = [](const std::array<float, 3> &p) {
    char text[96];
    std::snprintf(text, sizeof text, "[%.9g,%.9g,%.9g]", static_cast<double>(p[0]), static_cast<double>(p[1]),
                  static_cast<double>(p[2]));
    return std::string(text);
  };
  const std::string count = std::to_string(n);
  std::string json =
      "{\"asset\":{\"version\":\"2.0\",\"generator\":\"atlasfit "
      "cpp_denoise\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
      "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"indices\":0,\"attributes\":{\"POSITION\":1,"
      "\"NORMAL\":2,\"TEXCOORD_0\":3}}]}],"
      "\"buffers\":[{\"byteLength\":" +
      std::to_string(total) + "}],\"bufferViews\":[" + view(at[0], bytes(indices)) + "," +
      view(at[1], bytes(position)) + "," + view(at[2], bytes(normal)) + "," + view(at[3], bytes(uv)) +
      "],\"accessors\":[{\"bufferView\":0,\"componentType\":5125,\"type\":\"SCALAR\",\"count\":" +
      std::to_string(indices.size()) +
      "},{\"bufferView\":1,\"componentType\":5126,\"type\":\"VEC3\",\"count\":" + count +
      ",\"min\":" + three(low) + ",\"max\":" + three(high) +
      "},{\"bufferView\":2,\"componentType\":5126,\"type\":\"VEC3\",\"count\":" + count +
      "},{\"bufferView\":3,\"componentType\":5126,\"type\":\"VEC2\",\"count\":" + count + "}]}";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::ofstream file(path, std::ios::binary);
  const auto word = [&file](std::size_t value) {
    const std::uint32_t w = static_cast<std::uint32_t>(value);
    file.write(reinterpret_cast<const char *>(&w), 4);
  };
  const auto array = [&file, &bytes](const auto &v) {
    file.write(reinterpret_cast<const char *>(v.data()), static_cast<std::streamsize>(bytes(v)));
  };
  file.write("glTF", 4);
  word(2);
  word(12 + 8 + json.size() + 8 + total);
  word(json.size());
  file.write("JSON", 4);
  array(json);
  word(total);
  file.write("BIN\0", 4);
  array(indices);
  array(position);
  array(normal);
  array(uv);
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

#endif
