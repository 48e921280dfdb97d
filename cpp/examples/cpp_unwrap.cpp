// A mesh (OBJ) in, the same mesh with UVs out: cpp_unwrap mesh.obj unwrapped.obj [max_stretch]
#include <atlasfit.hpp>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

int main(int argc, char **argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s MESH.obj OUT.obj [MAX_STRETCH]\n", argv[0]);
    return 2;
  }
  try {
    // Vertices and faces; polygons are cut into fans, which stay together as polygons of the UVs.
    std::vector<double> xyz;
    std::vector<std::uint32_t> triangles, polygon;
    std::ifstream in(argv[1]);
    std::string line, word;
    for (std::uint32_t faces = 0; std::getline(in, line);) {
      std::istringstream words(line);
      words >> word;
      if (word == "v") {
        double p[3];
        if (!(words >> p[0] >> p[1] >> p[2])) throw std::runtime_error("a vertex without three coordinates");
        xyz.insert(xyz.end(), p, p + 3);
      } else if (word == "f") {
        std::vector<std::uint32_t> corners;
        while (words >> word)
          corners.push_back(static_cast<std::uint32_t>(std::strtoul(word.c_str(), nullptr, 10) - 1));
        for (std::size_t k = 2; k < corners.size(); k++) {
          triangles.insert(triangles.end(), {corners[0], corners[k - 1], corners[k]});
          polygon.push_back(faces);
        }
        faces++;
      }
      word.clear();
    }

    atlasfit::UnwrapOptions options;
    if (argc > 3) options.max_stretch = std::atof(argv[3]);
    const atlasfit::Mesh mesh = atlasfit::Mesh(xyz, triangles).face_polygon(polygon.data());
    const atlasfit::UvLayout layout = atlasfit::unwrap(mesh, options);
    const std::vector<float> uv = layout.corners();

    std::ofstream out(argv[2]);
    out.precision(9);
    for (std::size_t v = 0; v < xyz.size(); v += 3)
      out << "v " << xyz[v] << ' ' << xyz[v + 1] << ' ' << xyz[v + 2] << '\n';
    for (std::size_t c = 0; c < uv.size(); c += 2) out << "vt " << uv[c] << ' ' << uv[c + 1] << '\n';
    for (std::size_t c = 0; c < triangles.size(); c += 3) {
      out << 'f';
      for (std::size_t k = c; k < c + 3; k++) out << ' ' << triangles[k] + 1 << '/' << k + 1;
      out << '\n';
    }
    if (!out) throw std::runtime_error("the output cannot be written");

    const atlasfit_uv_quality q = atlasfit::measure_uv(atlasfit::Mesh(xyz, triangles).corner_uv(uv.data()));
    std::printf("%zu triangles in %zu charts, stretch %.3f at 95%%, %.0f%% of the page used\n",
                layout.info().triangles, layout.info().charts, q.stretch_p95, 100.0 * q.coverage);
    return q.flips + q.overlapping_faces == 0 ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
