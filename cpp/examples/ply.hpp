// The positions of a PLY file (ASCII or binary, little endian): no more than the examples need.
#ifndef EXAMPLE_PLY_HPP
#define EXAMPLE_PLY_HPP

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

inline std::vector<double> read_ply(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  const auto damaged = [&path](const char *what) { return std::runtime_error(path + ": " + what); };
  std::string line, word;
  if (!std::getline(file, line) || line.compare(0, 3, "ply") != 0) throw damaged("no PLY file");
  struct Property {
    std::string type, name;
    std::size_t size;
  };
  std::vector<Property> properties;
  std::size_t count = 0;
  bool ascii = false, in_vertex = false, first = true;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "end_header") break;
    if (word == "format") {
      words >> word;
      ascii = word == "ascii";
      if (word == "binary_big_endian") throw damaged("big endian is not read here");
    } else if (word == "element") {
      words >> word;
      in_vertex = word == "vertex";
      if (in_vertex) {
        if (!first) throw damaged("vertices do not come first");
        words >> count;
      }
      first = false;
    } else if (word == "property" && in_vertex) {
      Property p;
      words >> p.type >> p.name;
      const auto is = [&p](const char *name) { return p.type == name; };
      p.size = 0;
      if (is("char") || is("uchar") || is("int8") || is("uint8")) p.size = 1;
      if (is("short") || is("ushort") || is("int16") || is("uint16")) p.size = 2;
      if (is("int") || is("uint") || is("float") || is("int32") || is("uint32") || is("float32")) p.size = 4;
      if (is("double") || is("float64")) p.size = 8;
      if (p.size == 0) throw damaged("a vertex property of a kind that is not read here");
      properties.push_back(p);
    }
  }
  std::vector<double> xyz;
  std::vector<char> row;
  for (std::size_t i = 0; i < count; i++) {
    double place[3] = {0, 0, 0};
    for (const Property &p : properties) {
      const std::size_t axis = p.name == "x" ? 0 : p.name == "y" ? 1 : p.name == "z" ? 2 : 3;
      double value = 0;
      if (ascii) {
        if (!(file >> value)) throw damaged("the points end early");
      } else {
        row.resize(p.size);
        if (!file.read(row.data(), static_cast<std::streamsize>(p.size)))
          throw damaged("the points end early");
        if (p.type == "double" || p.type == "float64") {
          std::memcpy(&value, row.data(), 8);
        } else if (p.type == "float" || p.type == "float32") {
          float single;
          std::memcpy(&single, row.data(), 4);
          value = static_cast<double>(single);
        }
      }
      if (axis < 3) place[axis] = value;
    }
    xyz.insert(xyz.end(), place, place + 3);
  }
  return xyz;
}

#endif
